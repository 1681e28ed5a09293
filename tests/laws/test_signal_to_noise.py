"""The signal-to-noise ratio of a target: each part of the sound made alone, and its beams summed by brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from sonarsynth import render
from sonarsynth.conventions import direction
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.environment.sea import Environment, Isovelocity
from sonarsynth.geometry.motion import Still
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.labels.odds import NO_ODDS, brightest_about, odds
from sonarsynth.pipeline import synthesise, trace_frame
from sonarsynth.planning import plan
from sonarsynth.receiver import Band, BandPass, BeamGrid, PlanarLattice, Sonar
from sonarsynth.receiver.sensor_errors import Electronics
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
from sonarsynth.scattering import Isotropic, MirrorLobe
from sonarsynth.schedule import predict
from sonarsynth.sources.chorus import Chorus
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Sphere
from sonarsynth.targets.target import Target

SPEED = 1500.0
PARTS = ("chorus", "reverberation", "noise", "electronics")


def recipe(targets: tuple[str, ...] = ("left", "right"), parts: tuple[str, ...] = PARTS) -> Recipe:
    """Two balls 12 m ahead, apart from each other, and what is asked for of the sounds that they are heard against."""
    places = {"left": (12.0, 2.5, -5.0), "right": (12.0, -2.5, -5.0)}
    bodies = tuple(
        Target(name=name, shape=Sphere(radius=0.6, edge=0.1), motion=Still(position=places[name])) for name in targets
    )
    environment = Environment(depth=10.0, sound_speed=Isovelocity(speed=SPEED))
    if "noise" in parts:
        environment = replace(environment, noise=FlatNoise(level=50.0))
    world = World(
        environment=environment,
        targets=bodies,
        sources=(SnappingShrimp(position=(6.0, 1.0)),),
        chorus=Chorus(density=0.02) if "chorus" in parts else None,
        reverberation=Reverberation() if "reverberation" in parts else None,
    )
    sonar = Sonar(
        array=PlanarLattice(columns=12, rows=8, pitch=0.02),
        band=Band(low=25e3, high=85e3),
        filter=BandPass(low=25e3, high=85e3),
        beams=BeamGrid(azimuth_span=np.deg2rad(40), azimuths=41, elevation_span=np.deg2rad(20), elevations=21),
        electronics=Electronics(level=45.0) if "electronics" in parts else None,
        assumed_sound_speed=SPEED,
    )
    return Recipe(
        seed=4,
        scene=Scene(
            world=world,
            sonar=sonar,
            trajectory=Trajectory(frames=1, sonar=Still(position=(0.0, 0.0, -5.0), heading=0.5 * np.pi)),
            physics=Physics(scattering=Isotropic(strength=1e-2)),
            processing=Processing(
                beamforming=FocusedDelayAndSum(focus=None), echo_window=EchoWindow(start=8e-3, stop=13e-3)
            ),
        ),
    )


def brute(made: Recipe, silent: Recipe | None, window: tuple[float, float], towards: np.ndarray) -> float:
    """Energy (Pa2 s) of the pressure of a recipe, less that of another, summed over beams: every sensor in every beam,
    every bin, in double precision."""
    sound = plan(made, ("signals",))
    signals = synthesise(sound, trace_frame(sound, 0))
    if silent is not None:
        quiet = plan(silent, ("signals",))
        without = synthesise(quiet, trace_frame(quiet, 0))
        assert without.start == signals.start
        signals = replace(signals, pressure=signals.pressure - without.pressure)
    seen = snapshots_of(signals, made.scene.sonar, *window)
    late = -(towards @ sound.elements.position.T) / SPEED  # (beam, sensor): heard before the centre is
    total = 0.0
    for n, f in enumerate(seen.frequency):
        beams = np.exp(2j * np.pi * f * late) @ seen.spectra[:, n].astype(complex) / late.shape[1]
        total += float(np.sum(np.abs(beams) ** 2))
    return total * 2.0 * seen.spacing / seen.sampling_frequency**2


@pytest.mark.long
def test_parts_are_those_of_each_sound_alone_in_the_beams_of_the_target() -> None:
    frame = render(plan(recipe(), ("image", "signals")), 0)
    truth, image = frame["truth/targets"].dataset, frame["image"].dataset
    window = float(image.start), float(image.stop)
    grid = direction(*np.deg2rad(np.meshgrid(image.azimuth, image.elevation)))
    for n, name in enumerate(("left", "right")):
        mine = np.asarray(frame["truth/beams/target"]) == n
        assert 4 < mine.sum() <= 64
        alone = brute(recipe((name,), ()), None, window, grid[mine])
        rest = [brute(recipe(parts=(part,)), recipe(parts=()), window, grid[mine]) for part in PARTS]
        for part, known in zip(("echo", *PARTS), (alone, *rest), strict=True):
            got = float(truth[f"{part}_energy"][n])
            assert got == pytest.approx(10.0 * np.log10(known) + 120.0, abs=0.1), (name, part)
        assert float(truth["snr"][n]) == pytest.approx(10.0 * np.log10(alone / sum(rest)), abs=0.1)


def test_a_near_target_has_the_energy_of_all_of_its_beams() -> None:
    """Of hundreds, in few of which it glints: of 64 of them, spread evenly, it was 0.3 dB too much here."""
    made = recipe(("left",), ("electronics",))
    ball = replace(made.scene.world.targets[0], shape=Sphere(radius=1.8, edge=0.1), motion=Still(position=(12, 0, -5)))
    world = replace(made.scene.world, targets=(ball,))
    sonar = replace(made.scene.sonar, array=PlanarLattice(columns=24, rows=16, pitch=0.04))
    physics = replace(made.scene.physics, scattering=MirrorLobe(width=np.deg2rad(10)))
    heard = replace(made.scene.processing, echo_window=EchoWindow(start=3e-3, stop=9e-3))
    scene = replace(made.scene, world=world, sonar=sonar, physics=physics, processing=heard)
    made = replace(made, scene=scene)
    frame = render(plan(made, ("image", "signals")), 0)
    image, mine = frame["image"].dataset, np.asarray(frame["truth/beams/target"]) == 0
    assert mine.sum() > 150
    towards = direction(*np.deg2rad(np.meshgrid(image.azimuth, image.elevation)))[mine]
    silent = replace(made, scene=replace(made.scene, sonar=replace(sonar, electronics=None)))
    known = brute(silent, None, (float(image.start), float(image.stop)), towards)
    assert float(frame["truth/targets/echo_energy"][0]) == pytest.approx(10.0 * np.log10(known) + 120.0, abs=0.1)


def test_odds_count_frames_whose_brightest_beam_is_on_a_target_that_is_no_clutter() -> None:
    beams = np.full((9, 12), -1, np.int16)
    beams[4, 2], beams[4, 9] = 0, 1
    image, clutter, snr = np.ones((9, 12)), np.array([False, True]), np.array([3.0, 20.0])
    found = NO_ODDS
    for at, hit in (((4, 2), True), ((4, 3), True), ((4, 5), False), ((4, 9), False)):
        here = image.copy()
        here[at] = 2.0
        found += (one := odds(here, beams, clutter, snr, (1, 1)))
        assert vars(one) == {"frames": 1, "found": hit, "among_peaks": hit, "chance": 5 / 108, "snr": (3.0,)}
        for third in (False, True):  # two brighter peaks, then a third
            here[1, [5, 7]], here[7, 6] = 2.5, 2.5 if third else 1.0
            one_of = odds(here, beams, clutter, snr, (1, 1))
            assert (one_of.found, one_of.among_peaks) == (0, hit and not third)
    assert found.line == (
        "of 4 frames with a target, the brightest beam is on it in 2 (95 %: 0.15 to 0.85), a beam at random in 0.19, "
        "one of the 3 brightest peaks in 2 (95 %: 0.15 to 0.85); snr of targets 3 to 3 dB, median 3"
    )
    assert odds(image, beams, clutter, None, (1, 1)) == NO_ODDS  # nothing but echoes
    assert odds(image, np.full((9, 12), -1, np.int16), clutter, snr, (1, 1)).line == ""


@pytest.mark.parametrize("shape", [(9, 12), (1, 7), (7, 1), (20, 23)])
def test_the_brightest_beam_about_each_is_that_of_an_ellipse(shape: tuple[int, int]) -> None:
    """However far the ellipse reaches beyond the image, and where nothing is known of a beam."""
    random = np.random.default_rng(4)
    energy = np.where(random.random(shape) < 0.2, -np.inf, random.normal(size=shape))
    place = np.stack(np.indices(shape), axis=-1).reshape(-1, 2)
    off = place[:, None] - place
    for reach in ((1, 1), (2, 2), (5, 5), (31, 31), (1, 7), (6, 2)):
        within = ((off * reach[::-1]) ** 2).sum(axis=-1) <= np.prod(reach) ** 2
        about = np.where(within, energy.ravel(), -np.inf).max(axis=1).reshape(shape)
        assert np.array_equal(brightest_about(energy, reach), about)


@pytest.mark.parametrize(("level", "far"), [(-10.0, 60.0), (115.0, -40.0)])
def test_loud_targets_are_found_in_all_tried_frames_faint_ones_by_chance(level: float, far: float) -> None:
    """Faint: more than so many by chance is one in 1000. The array is sparse, for narrow beams."""
    scene = recipe(("left",), ("electronics",)).scene
    sonar = replace(
        scene.sonar, array=PlanarLattice(columns=12, rows=10, pitch=0.04), electronics=Electronics(level=level)
    )
    eight = replace(scene, sonar=sonar, trajectory=replace(scene.trajectory, frames=8))
    made = plan(replace(recipe(), scene=eight), ("image",))
    told = predict(made)
    seen = told.odds
    assert seen.line in " ".join(str(told.tried(made)).split()) and "says them" in str(made)
    assert seen.frames == 8 and len(seen.snr) == 8 and seen.chance < 1.0
    if far > 0.0:
        assert min(seen.snr) > far and seen.found == seen.among_peaks == 8
    else:
        assert max(seen.snr) < far and seen.found <= binom.ppf(0.999, 8, seen.chance / 8)
