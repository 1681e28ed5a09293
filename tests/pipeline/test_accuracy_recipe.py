"""The accuracy of a recipe: errors that fall with the knob, an exact way that is exact, verdicts, picture, command."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from math import inf, isfinite, nan
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.cli import app
from sonarsynth.cli.accuracy_tables.frontier_table import show
from sonarsynth.cli.running import run
from sonarsynth.environment.boundaries import SeaBottom, Sediment
from sonarsynth.frontiers import AccuracyReport, Point, exact_frame, measure, usual_frames
from sonarsynth.frontiers.exact_frame import differences, each_hydrophone, exact_plan, spread
from sonarsynth.frontiers.frontier_report import write
from sonarsynth.frontiers.image_knobs import off_by
from sonarsynth.frontiers.rows import merged
from sonarsynth.frontiers.verdicts import cheapest, verdicts
from sonarsynth.imaging import AutoBeamforming, FocusedDelayAndSum
from sonarsynth.planning import Choices, plan
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import BeamGrid, PlanarLattice
from sonarsynth.recipe import Accuracy, Recipe, reading
from sonarsynth.signals import GriddedSynthesis
from tests.scenes import remus

STAGES = {"trace", "synthesis", "image", "range", "frame"}
ARRAY = PlanarLattice(columns=6, rows=4, pitch=0.05)


def small(signal: float = 1e-2, frames: int = 2) -> Recipe:
    """The vehicle before 24 hydrophones."""
    beams = BeamGrid(azimuth_span=0.6, azimuths=13, elevation_span=0.3, elevations=9)
    made = remus(frames=frames, array=ARRAY, beams=beams)
    return replace(made, accuracy=Accuracy(signal=signal))


@pytest.fixture(scope="module")
def alone() -> pytest.MonkeyPatch:
    """Without libraries of others: they compile for long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sonarsynth.frontiers.peer_rows.installed", lambda library: False)
        yield patch


@pytest.fixture(scope="module")
def measured(alone: pytest.MonkeyPatch) -> AccuracyReport:
    return measure(small(), [1])


def rows(measured: AccuracyReport, stage: str, knob: str = "") -> list[Point]:
    return [p for p in measured.points if p.stage == stage and (p.knob == knob or not knob)]


def test_the_exact_way_errs_by_nothing_and_is_itself_checked(measured: AccuracyReport) -> None:
    for stage in ("trace", "image", "frame"):
        (exact,) = rows(measured, stage, "exact")
        assert exact.error == 0.0
        assert exact.seconds > next(p.seconds for p in rows(measured, stage) if p.chosen)
    (check,) = (p for p in measured.points if p.role == "check")
    assert 0.0 < check.error <= check.allowed < 1e-2


def test_every_curve_tends_to_nothing_as_its_knob_goes_to_exact(measured: AccuracyReport) -> None:
    """With all else exact, what is left is how far two computations differ that share nothing: of a moving target."""
    curves = {knob: [p.error for p in rows(measured, "trace", knob)] for knob in ("subarrays", "dynamic range")}
    curves["subarrays"] = [p.error for p in rows(measured, "trace", "subarrays") if not p.chosen]
    for errors in curves.values():
        assert len(errors) >= 2
        assert errors[-1] < 0.01 * measured.points[1].allowed
        assert errors[-1] <= min(errors) * 1.01 + 1e-6
    assert curves["dynamic range"][0] > 1e-3
    faint = curves["dynamic range"]
    assert all(b <= a * 1.05 + 1e-6 for a, b in pairwise(faint))
    auto = [p.error for p in rows(measured, "synthesis", "auto")]
    assert len(auto) >= 4
    assert all(b < a for a, b in zip(auto, auto[2:], strict=False))
    (plane,) = (p for p in rows(measured, "image") if p.setting == "plane waves")
    chosen = next(p for p in rows(measured, "image") if p.chosen)
    assert plane.error > chosen.error > 0.0
    assert plane.error <= plane.also["largest_db"]


def test_what_all_fast_ways_would_share_is_seen(measured: AccuracyReport) -> None:
    """A frame traced as if nothing moved differs from the exact way, which no tracing serves."""
    made = plan(small(), ("signals",), Choices())
    exact = exact_frame(made, 1, 2)
    scene = replace(made.scene, physics=replace(made.scene.physics, doppler=False))
    frozen = replace(made, recipe=replace(made.recipe, scene=scene))
    still = each_hydrophone(exact_plan(frozen), exact.frame, sensors=exact.sensor)
    assert differences(still.pressures, exact.pressures)[0] > 1e-2
    assert differences(exact.single.at(exact.sensor), exact.pressures)[0] < 1e-4


def test_the_table_fits_120_columns(
    measured: AccuracyReport, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever it is printed on: not a terminal, or one of a hundred thousand columns."""
    for columns in ("40", "100000"):
        monkeypatch.setenv("COLUMNS", columns)
        show(measured)
        lines = capsys.readouterr().out.splitlines()
        assert max(len(line) for line in lines) <= 120
        assert sum("chosen" in line for line in lines) >= 4


def test_one_setting_of_each_stage_is_the_plans(measured: AccuracyReport) -> None:
    made = plan(small())
    assert measured.choices == made.choices.as_json()
    for stage in STAGES - {"frame"}:
        assert len([p for p in rows(measured, stage) if p.chosen]) == 1
    assert [v.stage for v in measured.verdicts] == ["trace", "synthesis", "image", "range", "frame"]
    assert {p.knob for p in rows(measured, "frame") if p.chosen} == {"signals", "image", "range"}
    assert 4 <= measured.hydrophones <= 24


def test_the_plan_keeps_within_the_accuracy_of_signals(measured: AccuracyReport) -> None:
    (signals,) = rows(measured, "frame", "signals")
    assert 0.0 < signals.error <= signals.allowed == 1e-2
    tracing = next(p for p in rows(measured, "trace") if p.chosen)
    assert signals.error == pytest.approx(tracing.error, abs=0.5e-2)


def test_json_has_no_number_that_is_none(measured: AccuracyReport) -> None:
    answer = json.loads(json.dumps(measured.as_json(), allow_nan=False))
    assert {row["stage"] for row in answer} == STAGES | {"picking"}
    assert {row["row"] for row in answer} == {"point", "peer", "check", "verdict"}
    for row in answer:
        wanted = {"stage", "error", "unit", "allowed", "seconds", "frames", "recipe"}
        assert wanted | ({"ok", "ratio", "cheapest"} if row["row"] == "verdict" else {"meets", "chosen"}) <= set(row)
    absent = [row for row in answer if row["setting" if "setting" in row else "note"] == "not installed"]
    assert {row["knob"] for row in absent} == {"FINUFFT", "Acoular"}
    assert all(row["error"] is None and not row["meets"] for row in absent)
    (thesis,) = (row for row in answer if row["row"] == "peer" and "thesis" in row["knob"])
    assert thesis["error"] > 0.1
    assert next(row for row in answer if row["stage"] == "range" and row["row"] == "point")["direction_rad"] >= 0.0


def test_rows_and_picture_are_written(measured: AccuracyReport, tmp_path: Path) -> None:
    files = write(measured, tmp_path / "new", "scene")
    assert [file.name for file in files] == ["scene.json", "scene.png"]
    assert len(json.loads(files[0].read_text())) == len(measured.points) + len(measured.verdicts)
    assert files[1].stat().st_size > 30_000


def test_a_few_hydrophones_say_so() -> None:
    made = plan(small())
    exact = exact_frame(made, 1, 5)
    assert len(exact.sensor) == 5 and not exact.whole
    everything = exact_frame(made, 1)
    assert everything.whole and len(everything.single.sensor) == 24
    for few, every in zip(exact.single.pressures, everything.single.at(exact.sensor), strict=True):
        np.testing.assert_array_equal(few, every)
    assert np.array_equal(everything.pressure, everything.single.pressures[0] + everything.single.pressures[1])
    assert spread(np.arange(508), 24).size == 24


def test_differences_are_of_the_worse_of_echoes_and_direct_arrivals() -> None:
    exact = np.array([[3.0, 4.0]]), np.array([[0.0, 10.0]])
    found = np.array([[3.0, 4.5]]), np.array([[1.0, 10.0]])
    assert differences(found, exact) == pytest.approx((0.1, 0.125))
    assert differences((np.ones((1, 2)), found[1]), (np.zeros((1, 2)), exact[1])) == pytest.approx((0.1, 0.1))
    assert off_by(np.array([2.0, 5.0]), np.array([1.0, 1e-3])).tolist() == pytest.approx([3.0103])


def point(stage: str, seconds: float, error: float, *, chosen: bool = False, **more: object) -> Point:
    also = {"trace_s": 0.9 * seconds, "synthesis_s": 0.1 * seconds} if stage == "trace" else {}
    return Point(stage, "knob", f"{seconds:g}", error, "1", 1e-2, seconds, chosen, also=also, **more)  # type: ignore[arg-type]


def verdict_of(*points: Point) -> dict[str, bool]:
    return {v.stage: v.ok for v in verdicts(points, small().scene, 0.0)}


def test_verdicts() -> None:
    good = point("trace", 1.0, 5e-3, chosen=True), point("synthesis", 0.1, 1e-3, chosen=True)
    frame = point("frame", 1.0, 6e-3, chosen=True)
    assert verdict_of(*good, frame) == {"trace": True, "synthesis": True, "frame": True}
    cheaper = point("trace", 0.5, 9e-3)
    assert verdict_of(*good, frame, cheaper) == {"trace": False, "synthesis": True, "frame": False}
    assert verdict_of(*good, frame, replace(cheaper, error=2e-2))["trace"]  # it does not keep within
    assert verdict_of(*good, frame, replace(cheaper, error=9.99e-3))["trace"]  # nor with the error of the synthesis
    assert verdict_of(*good, frame, replace(cheaper, role="peer"))["trace"]
    assert not verdict_of(replace(good[0], error=2e-2), good[1], frame)["trace"]
    assert not verdict_of(*good, replace(frame, error=nan))["frame"]
    own = point("image", 1.0, 1e-3, chosen=True), point("image", 0.1, 1e-3)
    scene = small().scene
    for method, ok in ((FocusedDelayAndSum(), True), (AutoBeamforming(), False)):
        chosen = replace(scene, processing=replace(scene.processing, beamforming=method))
        (image,) = (v for v in verdicts([*good, frame, *own], chosen, 0.0) if v.stage == "image")
        assert image.ok == ok and image.ratio == pytest.approx(10.0)
        assert image.note == ("set in the recipe" if ok else "")
    assert cheapest([point("trace", 1.0, inf)]) is None


def test_frames_are_merged_by_their_worst() -> None:
    one, two = point("trace", 1.0, 1e-3), point("trace", 1.0, 4e-3)
    (row,) = merged([one, replace(two, seconds=3.0)])
    assert (row.error, row.seconds) == (4e-3, 2.0)
    (lost,) = merged([one, replace(two, error=nan)])
    assert not isfinite(lost.error) and not lost.meets
    assert len(merged([one, replace(two, setting="other")])) == 2


def test_frames_that_no_plan_measures_in() -> None:
    assert usual_frames(64) == (21, 42)
    assert usual_frames(2) == (1,)
    assert usual_frames(1) == (0,)


@pytest.mark.long
def test_another_seed_keeps_the_choices(alone: pytest.MonkeyPatch) -> None:
    made = measure(small(), [0], hydrophones=2, seed=77, peers=False)
    assert made.choices == plan(small()).choices.as_json()
    assert not any(p.role == "peer" for p in made.points)
    assert {p.knob for p in rows(made, "frame")} == {"signals"}  # too few hydrophones for an image
    assert "at 2 hydrophones" in rows(made, "frame", "signals")[0].note


@pytest.mark.long
def test_the_command(
    alone: pytest.MonkeyPatch, measured: AccuracyReport, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(reading.dump(small()))
    asked: list[object] = []

    def measures(recipe: Recipe, frames: object = None, **more: object) -> AccuracyReport:
        asked.extend([recipe.accuracy.signal, frames, more["hydrophones"], more["seed"], more["peers"]])
        return replace(measured, verdicts=tuple(replace(v, ok=False) for v in measured.verdicts))  # all too slow

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sonarsynth.cli.accuracy_tables.frontier_table.measure", measures)
        options = ["--set", "accuracy.signal=0.003", "--frames", "1", "--hydrophones", "7", "--seed", "5", "--no-peers"]
        assert run(app, ["accuracy", str(file), *options, "--out", str(tmp_path)]) == 0
    assert asked == [0.003, (1,), 7, 5, False]
    said = capsys.readouterr().out
    assert "verdicts" in said and "slow" in said and "dynamic" in said and "not installed" in said
    assert str(tmp_path / "scene.json") in said and (tmp_path / "scene.png").exists()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "sonarsynth.cli.accuracy_tables.frontier_table.measure", lambda *a, **k: replace(measured, verdicts=())
        )
        assert run(app, ["accuracy", str(file), "--json", "--out", str(tmp_path)]) == 0
        assert len(json.loads(capsys.readouterr().out)) == len(measured.points)
        wrong = (replace(measured.verdicts[0], error=1.0),)
        patch.setattr(
            "sonarsynth.cli.accuracy_tables.frontier_table.measure", lambda *a, **k: replace(measured, verdicts=wrong)
        )
        assert run(app, ["accuracy", str(file), "--out", str(tmp_path)]) == 1
        assert "FAILED" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["FILE", "--reference", "rays"], "give only one of"),
        (["FILE", "--extremes"], "give only one of"),
        (["--frames", "1"], "need a recipe"),
        (["--extremes", "--seed", "1"], "need a recipe"),
        (["FILE", "--hydrophones", "few"], "--hydrophones few"),
        (["FILE", "--hydrophones", "0"], "--hydrophones 0"),
        (["FILE", "--frames", "7"], "ends past the last frame"),
        (["FILE", "--set", "accuracy.signal=2"], "accuracy.signal"),
        (["nowhere.yaml"], "nowhere.yaml"),
    ],
)
def test_bad_options_are_one_line(
    options: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text(reading.dump(small()))
    named = [str(file) if option == "FILE" else option for option in options]
    assert run(app, ["accuracy", *named, "--out", str(tmp_path)]) in (1, 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and says in said


@pytest.mark.parametrize("bounces", [0, 1])
def test_finufft_and_ours_agree(bounces: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sonarsynth.frontiers.peer_rows.installed", lambda library: True)
    from sonarsynth.frontiers.peer_rows import synthesis_peers
    from sonarsynth.planning import arrivals_of

    recipe, bottom = small(1e-4), SeaBottom(reflection=Sediment(name="medium sand"))
    world = replace(recipe.scene.world, environment=replace(recipe.scene.world.environment, bottom=bottom))
    physics = replace(recipe.scene.physics, tracing=AutoTracing(bounces=bounces))
    recipe = replace(recipe, scene=replace(recipe.scene, world=world, physics=physics))
    made = plan(recipe, choices=Choices(synthesis=GriddedSynthesis(width=8, tolerance=1e-5)))
    frame = made.recipe.frame(1)[1]
    found = list(synthesis_peers(made, frame, arrivals_of(made, frame)))
    errors = [p.error for p in found if p.knob == "FINUFFT"]
    assert errors[0] > errors[2] > errors[-1]
    assert errors[-1] < 1e-6
    assert found[-1].knob == "ours, on the same" and found[-1].meets
