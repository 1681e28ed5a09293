"""Building: the same arrays whatever the workers, the order and the interruptions; a bad frame costs itself alone."""

from __future__ import annotations

import json
import pickle
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import zarr
from distributed import Client, Future, LocalCluster

from sonarsynth import evaluation, pipeline, planning, store
from sonarsynth.planning import Plan
from sonarsynth.recipe import Recipe
from sonarsynth.schedule import build, cluster, making, tasks
from sonarsynth.schedule.making import job_of
from tests.waiting import wait_until


@pytest.fixture(scope="module")
def here() -> Iterator[str]:
    """Address of a Dask scheduler whose one worker is a thread of this process."""
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=":0"
    ) as threads:
        yield threads.scheduler_address


def arrays(path: Path) -> dict[str, bytes]:
    root = zarr.open_group(path, mode="r")
    return {
        name: f"{array.dtype} {array.shape}".encode() + contents(np.asarray(array[...]))
        for name, array in root.members(max_depth=None)
        if isinstance(array, zarr.Array)
    }


def contents(values: np.ndarray) -> bytes:
    return str(values.tolist()).encode() if values.dtype.kind in "TO" else values.tobytes()


def assert_same(path: Path, reference: Path) -> None:
    """Same arrays, bit for bit, same contents in every mark, and nothing damaged."""
    ours, theirs = arrays(path), arrays(reference)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
    assert store.verify(path).problems == ()


def test_a_dataset_is_whole_and_says_what_it_cost(reference: Path) -> None:
    report = store.verify(reference)
    assert report.ok
    assert report.complete == tuple(range(20))
    rows = [json.loads(line) for line in store.beside(reference, "times.jsonl").read_text().splitlines()]
    assert sorted(row["frame"] for row in rows) == list(range(20))
    assert all(set(row["seconds"]) == set(tasks.STAGES) for row in rows)
    assert not store.beside(reference, "failed.jsonl").exists()


def test_a_worker_of_a_running_scheduler_makes_the_same_arrays(
    tmp_path: Path, small_plan: Plan, reference: Path, here: str
) -> None:
    seen: list[tuple[int, int, int]] = []
    report = build(small_plan, tmp_path / "s.zarr", scheduler=here, progress=lambda *counts: seen.append(counts))
    assert report.ok
    assert seen[0] == (0, 20, 0)
    assert seen[-1] == (20, 20, 0)
    assert_same(tmp_path / "s.zarr", reference)


@pytest.mark.parametrize(
    ("products", "seconds", "chains"),
    [
        ("cloud", 3.0, ["trace-beamform-range"]),
        ("truth", 3.0, ["trace"]),
        ("cloud", 0.0, ["trace", "beamform", "range"]),
        ("image", 0.0, ["trace", "beamform"]),
    ],
)
def test_dask_runs_stages_as_tasks_and_those_of_a_block_of_short_frames_as_one(
    tmp_path: Path, small: Recipe, here: str, monkeypatch: pytest.MonkeyPatch, products: str, seconds: float,
    chains: list[str],
) -> None:  # fmt: skip
    keys: list[str] = []
    submit = Client.submit

    def noted(client: Client, *arguments: Any, key: str, **options: Any) -> Future[Any]:
        keys.append(key)
        return submit(client, *arguments, key=key, **options)

    monkeypatch.setattr(Client, "submit", noted)
    monkeypatch.setattr(making, "BLOCK_SECONDS", seconds)
    assert build(small, tmp_path / "s.zarr", products=products, scheduler=here).ok
    kinds = [(key.rsplit("-", 2)[0], int(key.split("-")[-1])) for key in keys]
    firsts = (0, 8, 16) if seconds else range(20)  # shards of 8 of 20 frames, named by their first frames
    assert sorted(kinds) == sorted([(c, n) for c in chains for n in firsts] + [("shard", n) for n in range(3)])


def test_a_task_is_of_one_frame_where_they_are_long(small_plan: Plan) -> None:
    def block(seconds: float) -> int:
        stages = tuple(replace(stage, seconds=seconds / len(small_plan.stages)) for stage in small_plan.stages)
        return job_of(Path("s"), replace(small_plan, stages=stages, shard_frames=64), "").block

    assert block(20.0) == block(2.0) == 1
    assert block(0.99) == 3
    assert block(0.2) == small_plan.frames_together * (15 // small_plan.frames_together) > 0  # no group is cut
    assert block(1e-9) == 64


def test_frames_that_go_through_stages_together_are_those_that_go_alone(small_plan: Plan) -> None:
    job = job_of("nowhere", small_plan, "")
    assert job.together > 2
    made = []
    for together in (1, 2, job.together):
        asked = replace(job, together=together)
        tasks.remember(asked, small_plan)
        made.append(tasks.render_frames(asked, range(5)))
    for alone, *others in zip(*made, strict=True):
        for other in others:
            assert alone.value.keys() == other.value.keys()
            pairs = ((np.asarray(value), np.asarray(other.value[name])) for name, value in alone.value.items())
            assert all(contents(one) == contents(same) for one, same in pairs)


def test_a_part_and_then_the_whole_is_the_whole_at_once(tmp_path: Path, small_plan: Plan, reference: Path) -> None:
    path = tmp_path / "s.zarr"
    part = build(small_plan, path, frames=[*range(5), 17], workers=0)
    assert (part.written, part.shards, part.wanted, part.frames) == (6, 2, 6, 20)
    assert store.frames_there(path) == [0, 1, 2, 3, 4, 17]
    assert np.isnan(zarr.open_array(path / "truth/sonar_position", mode="r")[5:17]).all()
    again = build(small_plan, path, frames=range(3), workers=0)
    assert (again.written, again.there) == (0, 3)
    rest = build(small_plan, path, workers=0)
    assert (rest.written, rest.shards, rest.there) == (20, 3, 0)
    assert build(small_plan, path, workers=0).written == 0
    assert_same(path, reference)


@pytest.mark.parametrize("shards", [0, pytest.param(2, marks=pytest.mark.long)])
def test_an_interrupted_build_goes_on(tmp_path: Path, small_plan: Plan, reference: Path, shards: int) -> None:
    def interrupt(done: int, total: int, failed: int) -> None:
        if done >= 8 * shards:
            raise KeyboardInterrupt

    path = tmp_path / "s.zarr"
    with pytest.raises(KeyboardInterrupt):
        build(small_plan, path, workers=0, progress=interrupt)
    assert store.frames_there(path) == list(range(8 * shards))
    assert build(small_plan, path, workers=0).written == 20 - 8 * shards
    assert_same(path, reference)


def test_a_build_that_dies_within_a_shard_goes_on(
    tmp_path: Path, small_plan: Plan, reference: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(
            "sonarsynth.store.writing.save_mark", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left"))
        )
        with pytest.raises(OSError, match="No space left"):
            build(small_plan, path, workers=0)
    assert store.frames_there(path) == []
    assert "without a completion mark" in store.verify(path).problems[0].what
    assert build(small_plan, path, workers=0).written == 20
    assert_same(path, reference)


def test_disk_trouble_on_a_worker_ends_the_build(
    tmp_path: Path, small_plan: Plan, here: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "sonarsynth.store.writing.save_mark", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left"))
    )
    with pytest.raises(OSError, match="No space left"):
        build(small_plan, tmp_path / "s.zarr", scheduler=here)
    wait_until(lambda: not store.beside(tmp_path / "s.zarr", "lock").exists())  # a worker may still write


@pytest.mark.parametrize(
    ("stage", "distributed"),
    [
        ("trace_paths", False),
        pytest.param("range_frame", False, marks=pytest.mark.long),
        pytest.param("beamform_frame", True, marks=pytest.mark.long),
    ],
)
def test_frames_that_raise_fail_and_the_rest_goes_on(
    tmp_path: Path,
    small_plan: Plan,
    reference: Path,
    here: str,
    stage: str,
    distributed: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "s.zarr"
    works = getattr(pipeline, stage)

    def fails(made: Plan, index: int, *parts: object) -> object:
        if index in (3, 16):
            raise ZeroDivisionError("no\nway")
        return works(made, index, *parts)

    where = {"scheduler": here} if distributed else {"workers": 0}
    with monkeypatch.context() as patch:
        patch.setattr(pipeline, stage, fails)
        report = build(small_plan, path, **where)
    assert sorted(f.frame for f in report.failures) == [3, 16]
    assert {(f.stage, f.error) for f in report.failures} == {(stage.partition("_")[0], "ZeroDivisionError: no way")}
    assert all("raise ZeroDivisionError" in f.traceback for f in report.failures)
    assert store.frames_there(path) == [f for f in range(20) if f not in (3, 16)]
    assert store.verify(path).problems == ()
    failed = store.beside(path, "failed.jsonl")
    assert sorted(json.loads(line)["frame"] for line in failed.read_text().splitlines()) == [3, 16]
    left = build(small_plan, path, workers=0)
    assert (left.written, sorted(f.frame for f in left.failures), left.there) == (0, [3, 16], 18)
    assert build(small_plan, path, workers=0, retry_failed=True).ok
    assert not failed.exists()
    assert_same(path, reference)


def test_values_that_do_not_fit_set_their_frame_aside(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    works = pipeline.range_frame
    monkeypatch.setattr(pipeline, "range_frame", lambda made, i, *parts: {} if i == 2 else works(made, i, *parts))
    report = build(small_plan, tmp_path / "s.zarr", workers=0)
    assert [(f.frame, f.stage) for f in report.failures] == [(2, "range")]


def test_a_shard_with_no_good_frame_is_not_marked(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "trace_paths", lambda made, i: 1 / 0)
    report = build(small_plan, tmp_path / "s.zarr", frames=range(10), workers=0)
    assert (report.written, report.shards, len(report.failures)) == (0, 0, 10)
    assert store.frames_there(tmp_path / "s.zarr") == []


def test_products_decide_what_is_stored(tmp_path: Path, small: Recipe, reference: Path) -> None:
    path = tmp_path / "s.zarr"
    build(small, path, products=["image"], workers=0)
    ours, all_of_it = arrays(path), arrays(reference)
    assert {"image/energy", "truth/beams/target", "link_budget/paths", "step"} <= ours.keys()
    assert not any(name.startswith(("signals/", "cloud/")) for name in ours)
    assert [name for name in ours if ours[name] != all_of_it[name]] == []
    assert "link_budget/measured_level" not in ours  # nothing to compare it with
    with pytest.raises(store.Mismatch, match="products"):
        build(small, path, workers=0)
    with pytest.raises(ValueError, match="'film' is not a product"):
        build(small, path, products=["film"], workers=0)


def test_truth_alone_is_made_without_sound(
    tmp_path: Path, small: Recipe, reference: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("nothing of sound is needed")

    for name in ("tracing.arrivals.trace", "signals.GriddedSynthesis.signals", "planning.choosing.sampled_arrivals"):
        monkeypatch.setattr(f"sonarsynth.{name}", never)
    path = tmp_path / "s.zarr"
    assert build(small, path, products="truth", workers=0).ok
    ours, all_of_it = arrays(path), arrays(reference)
    assert {"truth/beams/target", "truth/targets/box", "truth/emissions/position", "step"} <= ours.keys()
    assert not any(name.startswith(("signals/", "image/", "link_budget/", "truth/targets/echo_")) for name in ours)
    assert [name for name in ours if ours[name] != all_of_it[name]] == []
    assert all(check.ok for check in evaluation.check(xr.open_datatree(path, engine="zarr")))
    assert "holds | truth" in store.beside(path, "card.md").read_text()


def test_a_restart_begins_anew(tmp_path: Path, small: Recipe, reference: Path) -> None:
    path = tmp_path / "s.zarr"
    build(small, path, products=["image"], workers=0)
    assert build(small, path, workers=0, restart=True).written == 20
    assert len(store.beside(path, "times.jsonl").read_text().splitlines()) == 20
    assert_same(path, reference)


def test_a_worker_refuses_a_store_of_another_recipe(reference: Path) -> None:
    job = tasks.Job(str(reference), "0" * 64, ("cloud", "image", "signals"))
    with pytest.raises(store.Damage, match="is not the same on this worker"):
        tasks.plan_of(job)


def test_a_worker_is_given_what_was_planned_and_looks_at_no_frames(
    small: Recipe, reference: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = planning.plan(small)
    job = job_of(reference, plan, "given")
    tasks.give(job, pickle.loads(pickle.dumps(tasks.resolved(plan))))
    monkeypatch.setattr("sonarsynth.planning.sample_frames", None)
    given = tasks.plan_of(job)
    assert given.digest == plan.digest and given.recipe is not plan.recipe
    assert repr(given.as_json()) == repr(plan.as_json())
    np.testing.assert_array_equal(given.windows.start, plan.windows.start)
    ours = tasks.render_frames(job, [19])[0].value
    tasks.remember(job, plan)
    theirs = tasks.render_frames(job, [19])[0].value
    for name in theirs:
        np.testing.assert_array_equal(ours[name], theirs[name])
    other = replace(job, digest="0" * 64)
    tasks.give(other, tasks.resolved(plan))
    with pytest.raises(store.Damage, match="is not the same on this worker"):
        tasks.plan_of(other)


class Lost:
    """A client whose workers are known, and die as told."""

    def __init__(self, workers: list[list[str]]) -> None:
        self.lives = iter(workers)
        self.last: list[str] = []

    def nthreads(self) -> dict[str, int]:
        self.last = next(self.lives, self.last)
        return dict.fromkeys(self.last, 1)


class FakeFuture:
    """A task that never comes back."""

    cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


def test_a_build_whose_workers_never_come_back_ends() -> None:
    builder = cluster._Builder(Lost([[]]), tasks.Job("", "", ()), lambda written: None, patience=0.0)  # type: ignore[arg-type]
    builder._next = lambda: None  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="no worker process came back"):
        builder._pass([cluster._Flight(0, (0,))])


def test_shards_of_a_dead_worker_go_to_another_and_after_two_deaths_to_the_end() -> None:
    builder = cluster._Builder(
        Lost([["a", "b"], ["b"], ["b"], ["c"], ["c"]]), tasks.Job("", "", ()), lambda written: None
    )  # type: ignore[arg-type]
    launched: list[tuple[int, str]] = []
    futures: list[FakeFuture] = []

    def submit(flight: cluster._Flight) -> FakeFuture:
        launched.append((flight.shard, flight.worker))
        futures.append(FakeFuture())
        futures[-1].add_done_callback = lambda put: None  # type: ignore[attr-defined]
        return futures[-1]

    builder._submit = submit  # type: ignore[method-assign, assignment]
    builder._next = lambda: None  # type: ignore[method-assign]
    suspects = builder._pass([cluster._Flight(0, (0,))])
    assert launched == [(0, "a"), (0, "b")]
    assert all(future.cancelled for future in futures)
    assert [(flight.shard, flight.losses) for flight in suspects] == [(0, 2)]
