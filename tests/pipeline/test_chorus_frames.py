"""Frames with a chorus: what it adds, what it leaves alone, and which snap is taken for the light."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from sonarsynth.description import FieldError
from sonarsynth.evaluation import check
from sonarsynth.geometry.motion import pose
from sonarsynth.pipeline import render
from sonarsynth.pipeline.frame_chorus import frame_chorus
from sonarsynth.planning import plan
from sonarsynth.randomness import number
from sonarsynth.recipe import reading
from sonarsynth.schedule import build
from sonarsynth.sources.chorus import ListeningWindow, draw_snaps
from sonarsynth.store import open_store

REMUS = Path(__file__).resolve().parents[2] / "configs" / "remus.yaml"
SMALL = (
    "scene.sonar.array={kind: planar_lattice, columns: 6, rows: 6, pitch: 10 cm}",
    "scene.world.targets.0.shape={kind: sphere, radius: 0.5 m}",
    "scene.processing.beamforming={kind: dense}",
    "scene.sonar.beams={azimuths: 21, elevations: 21}",
    "scene.world.environment.noise={kind: flat, level: 30 dB}",
)


@cache
def frame_of(*more: str, index: int = 1) -> xr.DataTree:
    """A frame of a small scene."""
    return render(reading.load(str(REMUS), [*SMALL, *more]), index)


def test_no_density_changes_no_number() -> None:
    without, empty = frame_of(), frame_of("scene.world.chorus={density: 0}")
    for name in ("signals/pressure", "image/energy", "cloud/range", "link_budget/received_level"):
        assert np.array_equal(without[name].values, empty[name].values, equal_nan=True), name
    assert int(empty["truth/soundscape"].snaps) == 0 and int(empty["truth/soundscape"].clear) == 1


PARTS = (
    "scene.world.environment.noise=[{kind: flat, level: 30 dB}, {kind: wind, directions: {kind: surface}}]",
    "scene.world.chorus={density: 0.02, reach: 100 m, images: 2}",
    "scene.world.reverberation={bottom: {kind: lambert}, surface: null}",
    "scene.world.noise_sources="
    "[{name: ship, motion: {kind: still, position: [60, 20, -2]}, sound: {kind: flat, level: 130 dB}}]",
    "scene.sonar.electronics={level: 50 dB}",
)


def test_parts_of_the_sea_add_up_and_change_no_draw_of_each_other() -> None:
    """All parts at once bring what each brings alone; a part that changed a draw of another would bring other noise."""

    def heard(*more: str) -> np.ndarray:
        recipe = reading.load(str(REMUS), [*SMALL, "scene.sonar.converter=null", *more])
        return render(plan(recipe, ("signals",)), 1)["signals"].pressure.values.astype(float)

    silent = heard()
    alone = [heard(part) - silent for part in PARTS]
    together = heard(*PARTS) - silent
    quietest = min(np.sqrt(np.mean(part**2)) for part in alone)
    assert np.abs(together - sum(alone)).max() < 1e-2 * quietest


STILL = "{kind: still, position: [0, 0, -5], heading: 90 deg}"
OVER_A_BORDER = "{kind: course, start: [24.994 m, 0 m, -5 m], heading: 90 deg, speed: 2 m/s}"  # of a cell
TURNS = (
    "{kind: waypoints, points: [{time: -1 s, position: [0, 0, -5], heading: 20 deg}, "
    "{time: 1 s, position: [0, 0, -5], heading: 160 deg}]}"
)


@pytest.mark.parametrize("sonar", [STILL, OVER_A_BORDER, TURNS])
def test_overlapping_windows_hear_the_same_chorus(sonar: str) -> None:
    """Two frames 2 ms apart hear the same sea: their records agree where they overlap."""
    more = (
        f"scene.trajectory.sonar={sonar}",
        "scene.world.chorus={density: 0.05, reach: 60 m, images: 1, distant: false}",
        "scene.world.sources.0.source_level=0 dB",
        "scene.world.environment.noise=null",
        "scene.trajectory.interval=2 ms",
        "scene.sonar.converter=null",
        "scene.trajectory.frames=3",
    )
    one, other = (frame_of(*more, index=n)["signals"] for n in (1, 2))
    rate = 196e3
    late = round((2e-3 + float(other.start) - float(one.start)) * rate)
    a, b = one.pressure.values[:, late:], other.pressure.values[:, : one.pressure.shape[1] - late]
    assert np.abs(a - b).max() < 0.02 * np.abs(a).max()


def test_the_loudest_is_not_the_light_where_its_echoes_would_be_hidden() -> None:
    """A stranger 7 m off, much louder, whose echo window holds the direct pulse of the other."""
    stranger = (
        "scene.world.sources=[{kind: snapping_shrimp, position: [14, -5]}, {kind: snapping_shrimp, name: stranger, "
        "position: [4.9, 0.5], source_level: 200 dB, snap_times: [-14 ms]}]",
        "scene.sonar.array={kind: romanis}",  # a small array takes the one for an echo of the other
    )
    tree = frame_of(*stranger)
    found, arrival = tree["source_estimates"], tree["truth/emissions"].arrival.values
    assert int(found.emission[0]) == 0 and int(found.usable) == 1
    assert arrival[1] < arrival[0]
    assert float(tree["image"].start) > arrival[0]


def test_a_frame_without_a_clock_has_an_image_of_its_record() -> None:
    tree = frame_of("scene.world.sources.0.source_level=0 dB", "scene.world.chorus={density: 1e-9}")
    start, stop = float(tree["image"].start), float(tree["image"].stop)
    assert np.isfinite(tree["image"].energy.values).all() and stop > start
    assert int(tree["source_estimates"].usable) == 0 and int(tree["cloud"]["count"]) == 0


def test_plan_says_what_the_chorus_is_and_leaves_out() -> None:
    for more, far in (
        (", distant: false", "re all of the chorus"),
        (", reach: 1 km", "Gaussian noise of their spectrum"),
    ):
        recipe = reading.load(str(REMUS), [*SMALL, f"scene.world.chorus={{density: reef{more}}}"])
        text = " ".join(str(plan(recipe)).split())
        for words in ("an estimate", "excess kurtosis", "echoes of the chorus off targets", far):
            assert words in text, words


def test_a_chorus_whose_recording_is_absent_is_refused() -> None:
    absent = "scene.world.chorus={snap: {kind: recorded_snap, path: absent.wav}}"
    with pytest.raises(reading.RecipeError, match=r"chorus.snap.path: no such file"):
        reading.load(str(REMUS), [*SMALL, absent])


@pytest.mark.parametrize("snap", ["{kind: ricker, frequency: 1 kHz}", "{kind: gabor, frequency: 60 kHz, cycles: 500}"])
def test_a_chorus_of_snaps_that_are_too_long_is_refused_when_it_is_planned(snap: str) -> None:
    """Frames failed, with a traceback."""
    long = f"scene.world.chorus={{density: 1e-3, reach: 50 m, snap: {snap}}}"
    with pytest.raises(FieldError, match=r"^scene\.world\.chorus\.snap: lasts [\d.]+ ms .* is the most$"):
        plan(reading.load(str(REMUS), [*SMALL, long]), ("signals",))


def test_a_chorus_that_is_brighter_than_the_echoes_is_no_fault_of_the_store(tmp_path: Path) -> None:
    chorus = "scene.world.chorus={density: 0.2, reach: 100 m, images: 2}"
    made = plan(reading.load(str(REMUS), [*SMALL, chorus, "scene.trajectory.frames=2"]))
    assert build(made, tmp_path / "chorus.zarr", workers=0).ok
    checks = check(open_store(tmp_path / "chorus.zarr"))
    assert not [one for one in checks if one.ok is False]
    assert any("also heard: chorus" in one.warning for one in checks)


@pytest.mark.parametrize(
    ("sonar", "exact"),
    [
        ("kind: course, start: [0, 0, -5], heading: 90 deg, speed: 8 m/s, climb: 1.5 m/s", 1e-7),
        ("kind: hover, position: [0, 0, -5], surge: 1, sway: 1, heave: 1, yaw: 20 deg, period: 4 s", 1e-3),
    ],
    ids=["climbs", "swings"],
)
@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_sonar_that_moves_hears_snaps_when_they_reach_it(sonar: str, exact: float, late: float) -> None:
    """And from where it is then, up and down too: they came up to 0.2 us off, and 20 us where it climbs; 0.3 s after
    the instant of a frame, to a sonar that swings, 60 us off and 2 degrees aside."""
    heard = "scene.world.chorus={density: 0.05, reach: 30 m, images: 2, distant: false}"
    few, snap = "scene.trajectory.frames=2", f"scene.world.sources.0.snap_times=[{late} s]"
    sets = [*SMALL, few, snap, f"scene.trajectory.sonar={{{sonar}}}", heard]
    made = plan(reading.load(str(REMUS), sets), ("signals",))
    frame = made.recipe.frame(0)[1]
    chorus, found = made.scene.world.chorus, frame_chorus(made, frame)
    assert chorus is not None and found is not None and len(found.delay) > 5
    hears = ListeningWindow(np.zeros(2), frame.time - 0.1, frame.time + 0.5, 40.0, 40.0, 1400.0, 1600.0)
    snaps = draw_snaps(chorus, number(frame.seed, "chorus", frame.key), hears)
    rows = [int(np.flatnonzero((snaps.key == key).all(axis=1))[0]) for key in found.key]
    snaps = snaps.select(np.array(rows)[found.snap])
    up = made.medium.depth * np.array([-1.0, 1.0, -3.0])[found.boundaries]  # images: by none, surface, that and bottom
    then = [pose(made.scene.trajectory.sonar, frame.time + heard_at) for heard_at in found.delay]
    away = np.column_stack([snaps.position, up]) - [one.position for one in then]
    length = np.linalg.norm(away, axis=1)
    arrives = snaps.time - frame.time + length / found.sound_speed
    np.testing.assert_allclose(found.delay, arrives, rtol=0.0, atol=max(1e-8, 2e-3 * exact))
    towards = [one.turn_to_world(seen) for one, seen in zip(then, found.direction, strict=True)]
    np.testing.assert_allclose(towards, away / length[:, None], rtol=0.0, atol=exact)


def test_a_sonar_that_moves_hears_all_snaps_up_to_the_end_of_a_long_record(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those ahead of it come sooner than they would to where it is at the instant of the frame: of half a second at
    8 m/s, the last 2 ms lacked those from afar."""
    sonar = "{kind: course, start: [0, 0, -9], heading: 90 deg, speed: 8 m/s}"
    heard = "scene.world.chorus={density: 0.5, reach: 60 m, images: 1, distant: false}"
    long = "scene.processing.echo_window={start: 1 ms, stop: 500 ms}"
    few = "scene.trajectory.frames=2"
    made = plan(reading.load(str(REMUS), [*SMALL, few, long, f"scene.trajectory.sonar={sonar}", heard]), ("signals",))
    frame = made.recipe.frame(0)[1]
    found = frame_chorus(made, frame)
    module = import_module("sonarsynth.pipeline.frame_chorus")
    narrow: Callable[..., ListeningWindow] = module.listening

    def wider(window: ListeningWindow) -> ListeningWindow:
        return window._replace(start=window.start - 0.01, stop=window.stop + 0.01)

    monkeypatch.setattr(module, "listening", lambda *of: wider(narrow(*of)))
    every = frame_chorus(made, frame)
    assert found is not None and every is not None and len(found.delay) > 1000
    assert sorted(found.delay.tolist()) == sorted(every.delay.tolist())


def test_plan_says_how_far_off_a_moving_sonar_hears_the_chorus() -> None:
    """By the times at which two hydrophones that go on hear a snap 45 degrees off the axis."""
    moves = "scene.trajectory.sonar={kind: line, start: [0, 0, -5], stop: [0, 30, -5], duration: 6 s, heading: 90 deg}"
    recipe = reading.load(str(REMUS), [*SMALL, moves, "scene.world.chorus={density: 1e-4, reach: 100 m}"])
    (row,) = (row for row in plan(recipe, ["signals"]).left_out if row.what == "Doppler in the chorus")
    places, snap, speed = np.array([[0.0, 0.1], [0.0, -0.1]]), 1e3 * np.sqrt([0.5, 0.5]), np.array([0.0, 5.0])
    heard = np.zeros(2)
    for _ in range(9):
        heard = np.linalg.norm(snap - places - heard[:, None] * speed, axis=1) / 1540.0
    first = np.linalg.norm(snap - heard.mean() * speed)
    true = np.arcsin((snap[1] - heard.mean() * speed[1]) / first)
    off = np.rad2deg(np.arcsin(1540.0 * (heard[1] - heard[0]) / 0.2) - true)
    said = float(row.bound.split("up to ")[1].split(" degrees")[0])
    assert 0.5 * said < abs(off) < said
