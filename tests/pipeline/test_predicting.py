"""What a build is predicted to take, and that only what was asked for runs."""

from __future__ import annotations

import json
import math
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from sonarsynth import pipeline, schedule, store
from sonarsynth.planning import Plan, plan
from sonarsynth.planning.costs import frame_size
from sonarsynth.products import Arrivals
from sonarsynth.ranging.picking.peaks import Peaks
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.scene import Frame
from sonarsynth.schedule import benchmark_frames
from sonarsynth.store import creating

TASKS = {
    "signals,image,cloud": ["trace", "beamform", "range"],
    "image": ["trace", "beamform"],
    "cloud": ["trace", "beamform", "range"],
    "signals": ["trace", "beamform"],
    "truth": ["trace"],
}
OF_NOISE = {"noise flat", "signal to noise"}
HEARD = {"trace", "label", "synthesise", "collect", *OF_NOISE}
PARTS = {
    "signals,image,cloud": {*HEARD, "measure", "locate", "beamform", "range"},
    "image": {*HEARD, "locate", "beamform"},
    "cloud": {*HEARD, "locate", "beamform", "range"},
    "signals": {*HEARD, "measure"},
    "truth": {"label"},
}


@pytest.fixture(scope="module")
def prediction(small_plan: Plan) -> schedule.Prediction:
    return schedule.predict(small_plan, workers=0)


def split(names: str) -> list[str]:
    return [name for name in names.split(",") if name]


def test_a_brief_build_of_one_shard_is_predicted_in_the_process_itself(small_plan: Plan, tmp_path: Path) -> None:
    """As it is built: the 4 s in which workers start are not in it."""
    one, two = (schedule.predict(small_plan, frames=frames) for frames in (8, 9))
    built = schedule.build(small_plan, tmp_path / "s", frames=range(8))
    assert (one.workers, two.workers) == (built.workers, min(schedule.usable_cores(), 2)) == (0, two.workers)
    assert one.seconds < one.of(workers=1).seconds - 1.0


@pytest.mark.parametrize("products", TASKS)
def test_only_what_was_asked_for_runs(small: Recipe, tmp_path: Path, products: str) -> None:
    """Of worker processes too: test_object_store builds images."""
    report = schedule.build(small, tmp_path / "s", frames=[0], products=split(products), workers=0)
    (row,) = map(json.loads, (tmp_path / "s.times.jsonl").read_text().splitlines())
    assert list(row["seconds"]) == list(row["cpu"]) == list(report.stage_cpu) == TASKS[products]
    assert row["parts"].keys() == PARTS[products]
    assert row["parts"].keys() <= {*pipeline.STAGES, *OF_NOISE}
    planned = {stage.stage for stage in plan(small, split(products)).stages}
    assert planned - {"write"} == PARTS[products] - {"collect"}
    assert math.fsum(row["parts"].values()) == pytest.approx(math.fsum(row["cpu"].values()), abs=0.01)


def test_laps_count_to_the_innermost_and_nowhere_else(small_plan: Plan) -> None:
    with pipeline.stage_timer() as outer:
        with pipeline.stage_timer() as inner:
            pipeline.trace_frame(small_plan, 0)
        assert outer == {}
    assert inner.keys() == {"trace", "label"}
    pipeline.trace_frame(small_plan, 0)
    assert inner.keys() == {"trace", "label"}


def test_the_size_of_a_store_is_foreseen(small_plan: Plan, prediction: schedule.Prediction, tmp_path: Path) -> None:
    report = schedule.build(small_plan, tmp_path / "s", workers=0, prediction=prediction)
    found = benchmark_frames.disk_use(tmp_path / "s")
    assert report.prediction["measured_file_bytes"] == found.files
    assert prediction.file_bytes == pytest.approx(found.files, rel=0.1)
    assert prediction.bytes == pytest.approx(found.disk, rel=0.1)
    last = json.loads((tmp_path / "s.times.jsonl").read_text().splitlines()[-1])
    assert last == {"build": report.prediction}
    assert last["build"]["seconds_ratio"] == pytest.approx(prediction.seconds / report.seconds)


def test_nothing_is_left_of_a_trial(small_plan: Plan, tmp_path: Path) -> None:
    made = schedule.predict(small_plan, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert made.basis.startswith("timing frames on this machine (number")
    assert made.failures == ()


def test_a_store_does_not_depend_on_predictions(
    small: Recipe, prediction: schedule.Prediction, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(creating, "begun", lambda source=None: {})  # when, on what machine
    for name, given in (("a", None), ("b", prediction)):
        schedule.build(small, tmp_path / name, frames=range(8), workers=0, prediction=given)
    for file in (tmp_path / "a").rglob("*"):
        if file.is_file():
            assert file.read_bytes() == (tmp_path / "b" / file.relative_to(tmp_path / "a")).read_bytes()


def test_where_nothing_can_be_tried_counts_serve(
    small_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = schedule.predict(small_plan, folder=tmp_path / "not there")
    assert made.basis.startswith("counts of operations: no frame could be timed")
    assert made.frame_seconds == pytest.approx(sum(stage.seconds for stage in small_plan.stages))
    assert made.bytes > 0
    assert math.isfinite(made.seconds)

    def fails(plan: Plan, *traced: object) -> None:
        raise ValueError("no such\nwater")

    monkeypatch.setattr(pipeline, "trace_at", fails)
    made = schedule.predict(small_plan)
    assert made.failures[0].endswith("ValueError: no such water")


def test_a_frame_that_fails_is_named_and_the_others_serve(small_plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    real = pipeline.trace_at

    def fails(plan: Plan, frame: Frame, *traced: Arrivals) -> pipeline.TracedFrame:
        if frame.index == 12:
            raise ValueError("no water")
        return real(plan, frame, *traced)

    monkeypatch.setattr(pipeline, "trace_at", fails)
    made = schedule.predict(small_plan)
    assert made.failures == ("frame 12: ValueError: no water",)
    assert made.basis.startswith("timing frames on this machine (number")
    assert "12" not in made.basis


def test_frames_are_timed_as_workers_make_them(small_plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one thread, and without what the first of their kind load: tables of a pulse, for one."""
    real, begun = pipeline.trace_at, set[int]()
    threads = set[int]()

    def loads(plan: Plan, frame: Frame, *traced: Arrivals) -> pipeline.TracedFrame:
        threads.update(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")
        until = time.thread_time() + 0.1 * (frame.index not in begun)
        begun.add(frame.index)
        while time.thread_time() < until:
            pass
        return real(plan, frame, *traced)

    monkeypatch.setattr(pipeline, "trace_at", loads)
    with threadpool_limits(2, "blas"):
        made = schedule.predict(small_plan)
    assert threads == {1}
    assert made.frame_seconds < 0.1
    assert len(begun) > 1


def test_predictions_grow_as_they_must(prediction: schedule.Prediction) -> None:
    quiet = replace(prediction, cores=4, waiting=1.0, starting=2.0)
    one = replace(quiet, stages={"trace": 0.1, "write": 0.01})  # on any machine
    times = [one.of(frames=n, workers=2).seconds for n in (8, 800, 8000)]
    assert times == sorted(times)
    large = [one.of(frames=80000, workers=n).seconds for n in (1, 2, 4)]
    assert large[0] / large[1] == pytest.approx(2.0, rel=0.1)
    assert large[1] / large[2] == pytest.approx(2.0, rel=0.1)
    assert one.of(frames=80000, workers=40).seconds > 0.95 * large[2]  # no more cores than there are
    assert one.of(frames=16, workers=9).workers == 2  # of two shards
    busy = replace(one, waiting=2.0).of(frames=80000, workers=4)
    assert busy.seconds / large[2] == pytest.approx(2.0, rel=0.05)
    sizes = [one.of(frames=n).file_bytes for n in (0, 1000, 2000)]
    assert sizes[2] - sizes[1] == pytest.approx(sizes[1] - sizes[0], abs=2)


def test_where_one_frame_takes_long_none_is_tried(small_plan: Plan) -> None:
    hours = replace(small_plan, stages=tuple(replace(stage, seconds=400.0) for stage in small_plan.stages))
    made = schedule.predict(hours)
    assert made.basis == "counts of operations: no frame could be timed (one would take more than 5 s)"
    assert made.frame_seconds == pytest.approx(400.0 * len(hours.stages))


@pytest.mark.long
def test_the_commands_predict_and_compare(small_file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from sonarsynth.cli import app
    from sonarsynth.cli.running import run

    def command(*arguments: object) -> str:
        assert run(app, [str(a) for a in arguments]) == 0
        return capfd.readouterr().out

    answer = json.loads(command("plan", small_file, "--json"))
    assert answer["predicted_for"] == {
        "frames": 20,
        "workers": min(schedule.usable_cores(), 3),
        "cores": schedule.usable_cores(),
    }
    assert 0 < answer["predicted_file_bytes"] < answer["predicted_bytes"]
    assert answer["predicted_frame_seconds"] * 20 < answer["predicted_core_seconds"]
    assert re.search(r"predicted: .* for 20 frames with \d+ workers, .* on disk", command("plan", small_file))
    built = json.loads(
        command("build", small_file, tmp_path / "s", "--workers", 0, "--frames", "0:8", "--json", "--predict")
    )
    assert built["prediction"]["frames"] == 8
    assert built["prediction"]["bytes_ratio"] == pytest.approx(1.0, abs=0.1)
    again = json.loads(
        command("build", small_file, tmp_path / "s", "--workers", 0, "--frames", "0:8", "--json", "--predict")
    )
    assert again["prediction"] == {}
    said = command("build", small_file, tmp_path / "s", "--workers", 0, "--predict")
    assert re.search(r"^took [\d.]+ \w+ \(predicted [\d.]+ \w+\)$", said, re.M)
    assert re.search(r"^the store takes [\d.]+ \w+ \(predicted [\d.]+ \w+\)$", said, re.M)
    quiet = command("build", small_file, tmp_path / "t", "--workers", 0, "--frames", "0:1")
    assert "predicted" not in quiet  # nor timed: it takes less than that would
    assert store.verify(tmp_path / "s", quick=True).ok
    assert reading.load(small_file).frames == 20


def test_ranging_is_counted_by_the_frequencies_of_the_window(small_plan: Plan) -> None:
    """As long windows take longer: `survey.yaml` was counted as `remus.yaml` is, where it takes 16 times the time."""
    size = frame_size(small_plan)
    short, long = (replace(size, bins=bins, beams=beams) for bins, beams in ((343, 10_201), (1819, 1271)))
    assert Peaks().cost(long) > 3.0 * Peaks().cost(short) > 0.0
