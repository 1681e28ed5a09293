"""Range images: where echoes are in them, how strong, whose cells are whose; and counts too coarse for noise."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sonarsynth import FieldError, render
from sonarsynth.conventions import direction
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.geometry.motion import ConstantVelocity, Motion, Still
from sonarsynth.labels.views.range_cells_met import met_at_ranges
from sonarsynth.planning import plan
from sonarsynth.receiver import Band, BandPass, BeamGrid, Converter, PlanarLattice, RangeGrid
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.sources.transmitter import Sweep, TransmitBeam, Transmitter
from sonarsynth.targets.shapes import Sphere
from tests.laws.test_transmitters import with_source
from tests.scenes import point_scene

GRID = RangeGrid(near=25.0, far=33.0, step=0.005)
PING = Transmitter(position=(0.1, 0.05, -0.3), pulse=Sweep(start=40e3, stop=80e3, duration=2e-3), source_level=190.0)
TARGET = (30.0, 2.0, -51.0)


def scene(source: Any, motion: Motion | None = None, **more: Any) -> Recipe:
    band = {"band": Band(low=38e3, high=82e3), "filter": BandPass(low=38e3, high=82e3)}
    beams = BeamGrid(azimuth_span=np.deg2rad(20), azimuths=21, elevation_span=np.deg2rad(20), elevations=21)
    array = PlanarLattice(columns=16, rows=12, pitch=0.01, face=0.0)
    own: dict[str, Any] = {"array": array, "beams": beams, "sound_speed_error": 0.0, "ranges": GRID} | band | more
    return with_source(point_scene(TARGET, (10.0, 3.0, -55.0), strength=1e-2, **own), source, motion)


def loudest(recipe: Recipe) -> tuple[float, float, float]:
    """Range (m) and azimuth (degrees) of the loudest cell of frame 0, and its power."""
    image = render(plan(recipe, ["range_image"]), 0)["range_image"]
    row, column = np.unravel_index(np.nanargmax(image["energy"].values), image["energy"].shape)
    return float(image["range"][row]), float(image["azimuth"][column]), float(image["energy"][row, column])


@pytest.mark.parametrize("source", [PING, SnappingShrimp(position=(10.0, 3.0, -55.0))], ids=["ping", "snap"])
def test_an_echo_is_where_the_target_is(source: Any) -> None:
    """Of a sonar's own ping, and of a snap 11 m away, whose delays are no ranges: of beams half a degree beside the
    target they say another one."""
    far, side, _ = loudest(scene(source))
    near = GRID.step if source is PING else 0.02
    assert far == pytest.approx(np.linalg.norm(np.array(TARGET) - [0.0, 0.0, -50.0]), abs=near)
    assert side == pytest.approx(np.rad2deg(np.arctan2(2.0, 30.0)), abs=0.5)


def test_a_sonar_that_goes_on_has_ranges_from_where_it_hears_the_echo() -> None:
    """Sideways, so that nothing shifts the pulse: at 8 m/s it is 0.32 m on by then, and 2 cm nearer."""
    north = ConstantVelocity(start=(0.0, 0.0, -50.0), heading=0.0, speed=8.0)
    recipe = scene(PING, replace(north, heading=0.5 * np.pi))
    target = replace(recipe.scene.world.targets[0], motion=Still(position=(8.0 * 0.02, 30.0, -50.0)))
    east = replace(north, start=(0.0, 0.0, -50.0), heading=0.5 * np.pi)
    world = replace(recipe.scene.world, targets=(target,))
    wide = BeamGrid(azimuth_span=np.deg2rad(179), azimuths=359, elevation_span=np.deg2rad(4), elevations=5)
    scanned = replace(recipe.scene, world=world, sonar=replace(recipe.scene.sonar, beams=wide))
    far, _, _ = loudest(replace(recipe, scene=replace(scanned, trajectory=replace(scanned.trajectory, sonar=east))))
    late = 2.0 * 30.0 / 1500.0
    heard = np.array([8.0 * late, 0.0, -50.0])
    assert far == pytest.approx(np.linalg.norm(np.array([0.16, 30.0, -50.0]) - heard), abs=0.015)


def test_it_is_as_strong_as_its_echo_is_beside_the_direct_pulse() -> None:
    recipe = scene(PING)
    frame = render(plan(recipe, ["range_image", "signals"]), 0)
    pressure, rate = frame["signals/pressure"].values.astype(float), recipe.scene.sonar.sampling_frequency
    late = float(frame["signals/start"]) + np.arange(pressure.shape[1]) / rate > 0.02
    echo, direct = (np.mean(np.sum(pressure[:, some] ** 2, axis=1)) for some in (late, ~late))
    assert 10.0 * np.log10(loudest(recipe)[2]) == pytest.approx(10.0 * np.log10(echo / direct), abs=0.15)


def test_a_cell_has_the_loudest_of_what_is_heard_in_it() -> None:
    """So a coarse cell has the loudest of the fine ones that it is made of, wherever delays of profiles fall: what
    rises in it up to its edge counted up to the last delay before that (0.7 dB too little in random scenes)."""
    recipe = scene(PING)
    processing = replace(recipe.scene.processing, echo_window=EchoWindow(start=35e-3, stop=43e-3))

    def energy(near: float, far: float, step: float) -> Any:
        sonar = replace(recipe.scene.sonar, ranges=RangeGrid(near=near, far=far, step=step))
        made = plan(replace(recipe, scene=replace(recipe.scene, sonar=sonar, processing=processing)), ["range_image"])
        return render(made, 0)["range_image/energy"].values

    whole, parts = energy(29.5, 30.5, 0.01), energy(29.496, 30.504, 0.002)
    np.testing.assert_allclose(whole, parts.reshape(len(whole), 5, -1).max(axis=1), rtol=1e-4)


def test_cells_that_are_not_in_the_echo_window_hold_nothing() -> None:
    recipe = scene(PING)
    window = EchoWindow(start=35e-3, stop=42e-3)
    processing = replace(recipe.scene.processing, echo_window=window)
    image = render(plan(replace(recipe, scene=replace(recipe.scene, processing=processing)), ["range_image"]), 0)
    energy, r = image["range_image/energy"].values, image["range_image/range"].values
    heard = (r > 0.5 * 1500.0 * 35.3e-3 + 0.4) & (r < 0.5 * 1500.0 * 41.5e-3)
    assert np.isfinite(energy[heard]).all() and np.isnan(energy[r < 0.5 * 1500.0 * 34.8e-3]).all()
    whole = render(plan(recipe, ["range_image"]), 0)["range_image/energy"].values
    assert np.isfinite(whole).all()  # the planner's own window holds all ranges


def test_cells_are_of_the_target_that_their_beams_meet() -> None:
    """Of a sphere: beams at an angle q off its middle meet it at D cos q - sqrt(R^2 - D^2 sin^2 q)."""
    recipe = scene(PING)
    radius, place = 0.8, np.array([29.0, 1.0, -50.5])
    ball = replace(
        recipe.scene.world.targets[0], shape=Sphere(radius=radius, edge=0.05), motion=Still(position=tuple(place))
    )
    world = replace(recipe.scene.world, targets=(ball,))
    image = render(plan(replace(recipe, scene=replace(recipe.scene, world=world)), ["range_image"]), 0)
    target, r = image["range_image/target"].values, image["range_image/range"].values
    away = place - [0.0, 0.0, -50.0]
    distance = np.linalg.norm(away)
    elevation = recipe.scene.sonar.beams.elevation
    for column, azimuth in enumerate(recipe.scene.sonar.beams.azimuth):
        cosine = direction(np.full(len(elevation), azimuth), elevation) @ (away * [1.0, 1.0, 1.0]) / distance
        square = radius**2 - distance**2 * (1.0 - cosine**2)
        cells = r[target[:, column] == 0]
        if not (square > 0.02).any():
            assert len(cells) == 0 or square.max() > -0.02
            continue
        met = (distance * cosine - np.sqrt(np.maximum(square, 0.0)))[square > 0.02]
        assert cells.min() == pytest.approx(met.min(), abs=0.01)
        assert cells.max() < distance and np.diff(cells).max(initial=0.0) < 0.3


def test_two_bodies_one_before_the_other_leave_what_is_between_them_to_nobody() -> None:
    target = np.array([[0], [0], [1], [-1]], np.int16)
    away = np.array([[10.0], [10.1], [12.0], [50.0]], np.float32)
    ranges = np.arange(9.0, 13.0, 0.05)
    met = met_at_ranges(target, away, np.array([0.0, 0.01, 0.02, 0.03]), ranges)[:, 0]
    assert np.allclose(ranges[met == 0], [10.0, 10.05, 10.1]) and np.allclose(ranges[met == 1], [12.0])
    apart = met_at_ranges(np.array([[0], [0]], np.int16), away[[0, 2]], np.array([0.0, 0.01]), ranges)[:, 0]
    assert np.count_nonzero(apart == 0) == 2  # no surface that is seen is so steep


@pytest.mark.parametrize("times", [(0.0,), (0.0, 3e-3)])
def test_the_plan_says_that_ranges_are_by_the_first_of_two_snaps(times: tuple[float, ...]) -> None:
    """Echoes of the other are in the image as well, 2.3 m off: it comes 3 ms later."""
    made = plan(scene(SnappingShrimp(position=(10.0, 3.0, -55.0), snap_times=times)), ["range_image"])
    said = [line for line in made.warnings if "range images have those of the other at wrong ranges" in line]
    assert len(said) == len(times) - 1
    image = render(made, 0)["range_image/energy"]
    assert "Ranges are by the first source estimate" in image.attrs["comment"]
    profile = np.nan_to_num(image.values).max(axis=1)
    loud = image["range"].values[profile > 0.01 * profile.max()]
    assert (np.ptp(loud) > 2.0) == (len(times) > 1)


def test_a_range_image_without_ranges_is_refused_in_one_line() -> None:
    with pytest.raises(FieldError, match=r"scene\.sonar\.ranges: is left out: a range image needs near, far and step"):
        plan(scene(PING, ranges=None), ["range_image"])
    for wrong, line in (({"near": 5.0, "far": 4.0}, "far must be beyond near"), ({"step": 1e-6}, "more than 100000")):
        with pytest.raises(ValueError, match=line):
            RangeGrid(**({"near": 5.0, "far": 30.0, "step": 0.02} | wrong))


def test_where_nothing_is_recorded_no_cell_has_a_number() -> None:
    """Of no echo over no direct pulse, which warned of 0/0."""
    coarse = scene(PING, converter=Converter(bits=16, full_scale=1e9))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        image = render(plan(coarse, ["range_image"]), 0)
    assert np.isnan(image["range_image/energy"].values).all()


def test_the_plan_says_where_counts_are_too_coarse_for_the_noise() -> None:
    """And there the stored noise is another: from half a count on it adds that of rounding, step/sqrt 12."""
    for full_scale in (1.0, 3.0, 30.0):
        recipe = scene(replace(PING, ping_times=(), beam=TransmitBeam(azimuth_width=1.0, elevation_width=1.0)))
        world = recipe.scene.world
        noisy = replace(world, targets=(), environment=replace(world.environment, noise=FlatNoise(level=40.0)))
        sonar = replace(recipe.scene.sonar, converter=Converter(bits=12, full_scale=full_scale))
        made = plan(replace(recipe, scene=replace(recipe.scene, world=noisy, sonar=sonar)), ["signals"])
        step = full_scale / (2**11 - 1)
        exact = 1e-6 * 10.0 ** (40.0 / 20.0) * np.sqrt(44e3)
        stored = float(np.std(render(made, 0)["signals/pressure"].values))
        said = any("under half a count" in line for line in made.warnings)
        assert said == (exact < 0.5 * step)
        if not said:
            assert stored == pytest.approx(np.hypot(exact, step / np.sqrt(12.0)), rel=0.05)
        elif exact < 0.25 * step:
            assert stored < 0.3 * exact
