"""The planner keeps within the accuracy of a recipe, on frames, seeds and hydrophones that it did not measure at."""

import importlib
import sys
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.pipeline import beamform_frame, range_frame, synthesise, trace_frame
from sonarsynth.planning import Choices, Plan, arrivals_of, choosing, frame_start
from sonarsynth.planning.choosing import HEARD_AT, heard_at
from sonarsynth.receiver.subarrays import subarray, subarrays
from sonarsynth.recipe import Accuracy, reading
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.segments import Reception
from tests.scenes import remus

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
DEEP_GRADIENT = "scene.world.environment.sound_speed={kind: tabulated, depth: [0 m, 300 m], speed: [1500, %s]}"
DEEP_SOURCE = "scene.world.sources.0.position=[18, -9, -%d]"
RECIPES = {
    "remus.yaml": (),
    "tank.yaml": ("scene.trajectory.frames=4",),
    "deep.yaml": (),
    "thermocline.yaml": ("scene.physics.tracing.bounces=0", "scene.world.environment.sound_speed.mixed_depth=4.6 m"),
    "crowd.yaml": (),
}
"""The thesis's scene, its tank, deep water, the array in a thermocline, and a crowd."""
SMALL_BOX = """
accuracy: {signal: 1e-3}
scene:
  world:
    environment: {depth: 7 m, sound_speed: {kind: isovelocity, speed: 1480 m/s}}
    targets:
      - name: box
        shape: {kind: box, size: [2 cm, 2 cm, 4 cm], edge: 4 cm}
        motion: {kind: still, position: [4.3, -1.5, -1.4], heading: 26 deg, pitch: 25 deg}
        scattering: {kind: mirror_lobe, width: 45 deg, reflectivity: 0.8, diffuse: 0.2}
    sources: [{kind: snapping_shrimp, position: [3.9, 0.5], source_level: 190 dB}]
  sonar:
    array: {kind: position_table, face: 0 m, positions: [%s]}
    band: {low: 4 kHz, high: 13 kHz}
    beams: {azimuths: 3, elevations: 3}
  trajectory: {frames: 1, interval: 1 s, sonar: {kind: still, position: [0, 0, -3.5], heading: 0 deg}}
"""
EXACT = GriddedSynthesis(width=16, precision="float64", tolerance=1e-9)
"""Within 1e-8 of `DirectSum` (tests/extremes)."""


@cache
def _planned(name: str, signal: float, seed: int) -> Plan:
    sets = (f"accuracy.signal={signal}", f"seed={seed}", *RECIPES[name])
    return planning.plan(reading.load(CONFIGS / name, sets), {"signals"})


def _error(made: Plan, index: int, sensors: np.ndarray) -> float:
    """Error of echoes or direct arrivals, as planned, against every hydrophone traced and summed by itself."""
    made = made.at(index)
    frame = made.recipe.frame(index)[1]
    start, samples = frame_start(made, frame), made.windows.samples
    sonar, snaps = made.scene.sonar, frame.moment.snaps
    alone = replace(made, choices=Choices(negligible=0.0))
    worst = []
    for direct in (False, True):
        missed, size = 0.0, 0.0
        for part in subarrays(made.elements, made.choices.subarrays):
            mine = np.flatnonzero(np.isin(part.sensor, sensors))
            if not len(mine):
                continue
            arrivals = arrivals_of(made, frame, part)
            some = arrivals.select(arrivals.direct == direct)
            method = made.choices.synthesis
            heard = method.signals(
                some, snaps, Reception(part.elements, sonar, made.absorption, start, samples)
            ).pressure
            for n in mine:
                one = subarray(made.elements, part.sensor[n : n + 1])
                own = arrivals_of(alone, frame, one)
                own = own.select(own.direct == direct)
                truth = EXACT.pressure(own, snaps, Reception(one.elements, sonar, made.absorption, start, samples))[0][
                    0
                ]
                missed += float(np.sum((heard[n] - truth) ** 2))
                size += float(np.sum(truth**2))
        worst.append(np.sqrt(missed / size))
    return max(worst)


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("remus.yaml", 1e-2),
        ("remus.yaml", 1e-5),
        pytest.param("tank.yaml", 1e-5, marks=pytest.mark.long),
        ("deep.yaml", 1e-3),
        pytest.param("deep.yaml", 1e-5, marks=pytest.mark.long),
        pytest.param("thermocline.yaml", 1e-2, marks=pytest.mark.long),
        pytest.param("thermocline.yaml", 1e-5, marks=pytest.mark.long),
        pytest.param("crowd.yaml", 1e-3, marks=pytest.mark.long),
    ],
)
def test_signals_are_within_the_accuracy(name: str, signal: float) -> None:
    made = _planned(name, signal, seed=11)
    measured = heard_at(made.elements)
    others = np.setdiff1d(np.flatnonzero(made.elements.gain), measured)
    sensors = np.random.default_rng(4).choice(others, HEARD_AT, replace=False)
    index = made.recipe.frames // 3  # the first, the middle and the last were measured in
    assert _error(made, index, sensors) <= signal


def test_signals_are_within_the_accuracy_at_all_hydrophones_of_a_wide_array() -> None:
    """A side of a small box is seen by some hydrophones of a table, those of one rim, and not by the others."""
    places = np.random.default_rng(2).uniform(-0.9, 0.9, (30, 2)).round(3)
    table = ", ".join(f"[0, {y}, {z}]" for y, z in places.tolist())
    made = planning.plan(reading.loads(SMALL_BOX % table), {"signals"})
    assert _error(made, 0, np.arange(30)) <= 1e-3


def test_more_accuracy_takes_more_work() -> None:
    """Of each choice, more or as much, at every accuracy."""
    plans = [_planned("deep.yaml", signal, seed=11).choices for signal in (1e-2, 1e-4, 1e-5)]
    for rough, fine in pairwise(plans):
        assert fine.negligible < rough.negligible
        assert fine.subarrays >= rough.subarrays
        assert isinstance(rough.synthesis, GriddedSynthesis) and isinstance(fine.synthesis, GriddedSynthesis)
        assert fine.synthesis.tolerance < rough.synthesis.tolerance


@pytest.mark.parametrize("depth", [160, 150])
def test_bending_that_moves_nothing_is_left_out(depth: int) -> None:
    """A gradient of 1e-6 per second bends no ray by a thousandth of a wave, nor one between ends of one depth, which
    turns half way; one of 1 does."""
    even, bent = (
        planning.plan(reading.load(CONFIGS / "deep.yaml", (DEEP_GRADIENT % speed, DEEP_SOURCE % depth)), {"signals"})
        for speed in ("1500.0003", "1800")
    )
    assert (even.propagation.kind, bent.propagation.kind) == ("straight", "refracted")
    assert even.errors.expansion <= Accuracy().signal


def test_what_only_a_rim_of_the_array_sees_is_seen_at_a_thousandth(monkeypatch: pytest.MonkeyPatch) -> None:
    """In frame 58 of the pass a facet is hidden from one rim of the array alone. Hydrophones there, traced by
    themselves, hear echoes to a thousandth as they are planned, and by the view of the middle not to two."""
    recipe = replace(reading.load(CONFIGS / "remus.yaml"), accuracy=Accuracy(signal=1e-3))
    made = planning.plan(recipe, {"signals"})
    assert (made.choices.subarrays, made.choices.occlusion) == (1, "sensors")
    monkeypatch.setattr(choosing, "heard_at", lambda elements: np.array([0, 227, 504]))
    rim = choosing.PerSensorReference.of(made, 58)
    assert rim.error(1, "sensors") < 1e-3 < 0.5 * rim.error(1, "centre")


def test_exact_is_every_slow_way() -> None:
    recipe = replace(remus(1), accuracy=Accuracy(exact=True))
    made = planning.plan(recipe)
    assert made.choices.subarrays == made.elements.count and made.choices.negligible == 0.0
    assert made.choices.synthesis.kind == "direct_sum" and made.choices.beamforming.kind == "dense"


def test_choices_of_the_scene_are_kept_and_their_error_is_said() -> None:
    scene = remus(1).scene
    physics = replace(
        scene.physics, subarrays=1, dynamic_range=20.0, synthesis=GriddedSynthesis(width=4, tolerance=0.01)
    )
    asked = Accuracy(signal=1e-3)
    made = planning.plan(replace(remus(1), scene=replace(scene, physics=physics), accuracy=asked))
    assert made.choices.subarrays == 1 and made.choices.synthesis == physics.synthesis
    assert made.choices.negligible == pytest.approx(0.01)
    assert any("accuracy.signal allows 0.001" in note for note in made.warnings)


def test_subarrays_make_the_signals_that_the_whole_array_hears() -> None:
    """Cut in 8, every hydrophone hears what it did, to what one expansion errs by."""
    recipe = remus(1)
    whole = planning.plan(recipe, {"signals"})
    cut = replace(whole, choices=replace(whole.choices, subarrays=8))
    one, parts = (synthesise(made, trace_frame(made, 0)) for made in (whole, cut))
    assert one.outside == parts.outside == 0
    difference = np.linalg.norm(one.pressure - parts.pressure) / np.linalg.norm(one.pressure)
    assert 0.0 < difference <= 1e-3


@pytest.mark.parametrize("count", [1, 2, 5, 64, 508, 1000])
def test_parts_hold_every_element_once_about_their_middle(count: int) -> None:
    elements = planning.plan(remus(1), set()).elements
    parts = subarrays(elements, count)
    assert len(parts) >= min(count, elements.count) and len(parts) <= min(2 * count - 1, elements.count)
    assert np.array_equal(np.sort(np.concatenate([p.sensor for p in parts])), np.arange(elements.count))
    for part in parts:
        assert np.allclose(part.elements.position + part.centre, elements.position[part.sensor], atol=1e-15)
        assert part.elements.aperture <= 1.05 * elements.aperture


BENT = (
    "equations.rays.ray_chain", "equations.rays.ray_in_layer", "equations.rays.ray_arcs",
    "ranging.location.refraction", "propagation.eigenrays", "propagation.ray_steps", "tracing.ray_fan",
)  # fmt: skip
"""Modules that solve, follow or invert rays that bend."""


def _forbidden(monkeypatch: pytest.MonkeyPatch) -> int:
    """Let every function of those modules raise, wherever it is known; gives how many names that were."""
    modules = {name: module for name, module in sys.modules.items() if name.startswith("sonarsynth")}
    homes = {f"sonarsynth.{name}" for name in BENT}

    def refused(*arguments: object, **named: object) -> None:
        raise AssertionError("a ray that bends, in uniform water")

    names = [
        (module, name)
        for module in modules.values()
        for name, value in vars(module).items()
        if callable(value) and not isinstance(value, type) and getattr(value, "__module__", None) in homes
    ]
    for module, name in names:
        monkeypatch.setattr(module, name, refused)
    return len(names)


SMALL = (
    "scene.world.targets.0.shape={kind: remus100, edge: 5 cm}",
    "scene.sonar.array={kind: planar_lattice, columns: 12, rows: 8, pitch: 5 cm}",
    "scene.sonar.beams={azimuth_span: 50 deg, azimuths: 41, elevation_span: 50 deg, elevations: 41}",
)


def _frame(made: Plan) -> list[bytes]:
    traced = trace_frame(made, 1)
    values = range_frame(made, 1, traced, beamform_frame(made, 1, traced))
    return [np.asarray(value).tobytes() for value in values.values()]


def test_a_frame_in_uniform_water_is_made_without_any_code_for_rays_that_bend(monkeypatch: pytest.MonkeyPatch) -> None:
    uniform = planning.plan(reading.load(CONFIGS / "remus.yaml", SMALL))
    bending = planning.plan(reading.load(CONFIGS / "thermocline.yaml", (*RECIPES["thermocline.yaml"], *SMALL)))
    whole = _frame(uniform)
    for name in BENT:
        importlib.import_module(f"sonarsynth.{name}")
    assert _forbidden(monkeypatch) > 30
    assert _frame(uniform) == whole
    with pytest.raises(AssertionError, match="bends"):  # so these functions are those that matter
        _frame(bending)
