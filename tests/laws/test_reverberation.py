"""Reverberation of frames: its energy is that of the sonar equation, whatever the number of scatterers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.fft import irfft

from sonarsynth.environment.boundaries import SeaBottom, Sediment
from sonarsynth.environment.reverberation import Reverberation
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.reverberation.speckle import SINC
from sonarsynth.frontiers.signal_knobs import speckle_points
from sonarsynth.geometry import Pose
from sonarsynth.geometry.hovering import Hover
from sonarsynth.geometry.motion import Still, Waypoint, Waypoints, pose
from sonarsynth.pipeline import render, synthesise, trace_at
from sonarsynth.pipeline.synthesis import frame_signals
from sonarsynth.planning import Plan, arrivals_of, frame_start, plan
from sonarsynth.planning.measured.reverberation_levels import frame_scatterers
from sonarsynth.products import ORIGINS
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.receiver import Band, BandPass, BeamGrid, PlanarLattice, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow, Processing, Scene, Trajectory, World
from sonarsynth.recipe.tolerance import Accuracy
from sonarsynth.scattering.boundaries import Lambert, WindySurface
from sonarsynth.signals.filtered_pulse import pulse_spectrum, snap_gains
from sonarsynth.signals.isolated_paths import sent_energy
from sonarsynth.signals.pulse_sums.reverberation_synthesis import path_error
from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
from sonarsynth.state import Emission, Medium, Receiver
from sonarsynth.tracing.reverberation.cells import cells_about, scatterers, texture
from sonarsynth.tracing.reverberation.geometry_of_paths import back_ways, out_ways
from sonarsynth.tracing.reverberation.geometry_of_paths import scattered_paths as scattering_paths
from tests.echoes import BOTTOM_DEPTH, EAST, PROFILE, ROMANIS, WATER
from tests.echoes import heard as heard_at_rest
from tests.scenes import remus

SPEED, DEPTH, HEIGHT, MU = 1500.0, 60.0, 8.0, -15.0
BACK = Still(position=(0.0, 0.0, -52.0))
SNAP = (-0.1, 0.0)
LAMBERT = Reverberation(bottom=Lambert(mu=MU), surface=None, bounces=0)


def recipe(
    described: Reverberation = LAMBERT,
    seed: int = 1,
    speckle: float = 0.1,
    snap: tuple[float, float] = SNAP,
    **more: Any,
) -> Recipe:
    """A few hydrophones 8 m over a wide bottom, that hear a snap beside them come back; no target, no noise."""
    environment = Environment(depth=DEPTH, sound_speed=Isovelocity(speed=SPEED), absorption=Absorption(formula="none"))
    sonar = Sonar(
        array=PlanarLattice(columns=3, rows=2, pitch=0.02, face=more.pop("face", 0.02)),
        band=Band(low=25e3, high=85e3),
        filter=BandPass(low=25e3, high=85e3),
        assumed_sound_speed=SPEED,
    )
    source = SnappingShrimp(
        position=snap, height=more.pop("source_height", HEIGHT), snap_times=more.pop("snap_times", (0.0,))
    )
    return Recipe(
        seed=seed,
        accuracy=Accuracy(speckle=speckle),
        scene=Scene(
            world=World(environment=environment, sources=(source,), reverberation=described),
            sonar=sonar,
            trajectory=Trajectory(frames=1, sonar=more.pop("sonar", BACK)),
            processing=Processing(echo_window=EchoWindow(start=0.0, stop=30e-3)),
        ),
    )


def heard(made: Plan, index: int = 0) -> ReverberationArrivals:
    """What comes back in a frame."""
    frame = made.recipe.frame(index)[1]
    return frame_scatterers(made, frame, frame_start(made, frame))


def sent(made: Plan) -> float:
    """Energy of the snap (Pa2 s) in the band at 1 m."""
    return float(sent_energy(made.recipe.frame(0)[1].moment.snaps, made.scene.sonar)[0])


def test_energy_is_that_of_the_sonar_equation_and_not_of_the_number_of_scatterers() -> None:
    """Own snap over a Lambert bottom: mu (h/r)^2 2 pi r (c/2)/r^4 per second, integrated over steps of 3 ms; and over
    the last 0.6 ms that are listened for, which cells whose middle comes later share in."""
    edges = np.append(np.arange(12e-3, 30e-3, 3e-3), [31.15e-3, 31.75e-3])
    fine = np.linspace(edges[0], edges[-1], 60_001)
    far = 0.5 * SPEED * fine
    rate = 10.0 ** (MU / 10.0) * (HEIGHT / far) ** 2 * np.pi * far * SPEED / far**4 * (far >= HEIGHT)
    known = np.histogram(fine, edges, weights=rate * (fine[1] - fine[0]))[0]
    counts, draws = [], 16
    for speckle in (1.0, 0.1, 0.02):
        shares, squares = np.zeros((2, draws, len(known)))
        frames = [plan(recipe(seed=seed, speckle=speckle)) for seed in range(draws)]
        arrivals = [heard(frame) for frame in frames]
        for n, (a, frame) in enumerate(zip(arrivals, frames, strict=True)):
            shares[n] = np.histogram(a.delay, edges, weights=a.energy)[0] / sent(frame) / known
            squares[n] = np.histogram(a.delay, edges, weights=a.energy**2)[0] / (sent(frame) * known) ** 2
        counts.append(np.mean([len(a.delay) for a in arrivals]))
        total = shares @ known / known.sum()
        for share in (*shares.T, total):  # four standard errors of the mean of the draws
            assert share.mean() == pytest.approx(1.0, abs=4.0 * share.std(ddof=1) / draws**0.5), speckle
        poisson = squares.mean(axis=0)  # variance where nothing evened scatterers out over cells
        assert total.std(ddof=1) < 0.8 * np.sqrt(poisson @ known**2) / known.sum(), speckle
    assert counts[2] > 4.0 * counts[1] > 30.0 * counts[0]


def test_the_contrast_counted_in_a_frame_is_what_the_knob_says() -> None:
    """By the energies of the scatterers that were drawn, not by the formula that says how many there are to be; how
    they spread is counted once, at 0.1, and serves all settings."""
    made = plan(recipe(), ("signals",))
    frame = made.recipe.frame(0)[1]
    signals = frame_signals(made, frame, arrivals_of(made, frame))
    points = list(speckle_points(made, frame, signals))
    assert [p.setting for p in points if p.chosen] == ["0.1"]
    for point in points:
        assert point.error / float(point.setting) == pytest.approx(1.0, abs=0.06 if float(point.setting) < 1.0 else 0.2)
        assert abs(point.also["level_db"]) < 10.0 * np.log10(1.0 + 4.0 / point.also["scatterers"] ** 0.5)


def test_a_sonar_that_turns_where_it_is_hears_scatterers_where_they_are() -> None:
    """Each at its time in the attitude of then: those that a sonar at rest hears, at 90 degrees a second."""
    times = ((0.0, 0.0), (2.0, np.pi))
    points = tuple(Waypoint(time=t, position=BACK.position, heading=0.99 * angle) for t, angle in times)
    turning, still = Waypoints(points=points, pitch=0.3), replace(BACK, pitch=0.3)
    found, rest = heard(plan(recipe(sonar=turning))), heard(plan(recipe(sonar=still)))
    assert np.array_equal(found.delay, rest.delay) and np.ptp(found.delay) > 0.02
    for n in range(0, len(found.delay), 97):
        there = pose(still, 0.0).turn_to_world(rest.direction[n])
        seen = pose(turning, float(found.delay[n])).turn_to_body(there)
        np.testing.assert_allclose(found.direction[n], seen, atol=1e-12)


def test_a_sonar_that_swings_hears_scatterers_where_they_are_however_long_after_the_instant_of_a_frame() -> None:
    """On the bottom, after as long as sound takes there and back: 0.3 s after it they were up to 0.8 m off."""
    swings = Hover(position=BACK.position, heading=0.3, surge=1.0, sway=1.0, yaw=np.deg2rad(20.0), period=4.0)
    found = heard(plan(recipe(sonar=swings, snap_times=(0.3,))))
    snap = np.array([*SNAP, HEIGHT - DEPTH])
    for n in range(0, len(found.delay), 97):
        then = pose(swings, float(found.delay[n]))
        place = then.to_world(found.direction[n] * found.length[n])
        took = (np.linalg.norm(place - snap) + np.linalg.norm(place - then.position)) / SPEED
        assert place[2] == pytest.approx(-DEPTH, abs=1e-3)
        assert found.delay[n] == pytest.approx(0.3 + took, abs=2e-6)


def test_nothing_comes_before_the_first_possible_echo() -> None:
    found = heard(plan(recipe()))
    assert found.delay.min() > 2.0 * HEIGHT / SPEED - 1e-6
    assert (found.length + found.lit_from > 2.0 * HEIGHT - 1e-3).all()


@pytest.mark.parametrize("face", [0.02, 0.05])
def test_pressure_is_the_sum_of_the_pulses_of_all_scatterers(face: float) -> None:
    """Brute force: each pulse at each hydrophone from where its scatterer is, each frequency, in float64."""
    made = plan(recipe(speckle=1.0, face=face))
    traced = trace_at(made, made.recipe.frame(0)[1])
    arrivals = traced.reverberation
    assert arrivals is not None and len(arrivals.delay) > 300
    silent = synthesise(made, replace(traced, reverberation=None))
    found = synthesise(made, traced).pressure.astype(float) - silent.pressure
    sonar, snap, padded = made.scene.sonar, traced.frame.moment.snaps[0], 16384
    rate = sonar.sampling_frequency
    f, pulse = pulse_spectrum(snap.waveform, sonar.antialias, rate, padded)
    known = np.zeros_like(found)
    for s, q in enumerate(made.elements.position):
        towards = arrivals.direction * arrivals.length[:, None] - q
        r = np.linalg.norm(towards, axis=1)
        spectrum = np.zeros(len(f), complex)
        for n in range(len(r)):
            late = arrivals.delay[n] + (r[n] - arrivals.length[n]) / SPEED - silent.start
            face = element_directivity(f, towards[n] / r[n], made.elements.face, SPEED)
            spectrum += arrivals.gain[n] * arrivals.length[n] / r[n] * face * np.exp(-2j * np.pi * f * late)
        known[s] = irfft(spectrum * pulse * rate, padded)[: found.shape[1]]
    known *= float(snap_gains((snap,))[0])
    quiet = slice(100, -100)
    error = path_error(made.elements, sonar, SPEED)
    assert np.linalg.norm((found - known)[:, quiet]) < error * np.linalg.norm(known[:, quiet])


def test_the_energy_of_its_paths_is_heard() -> None:
    """By hydrophones that hear alike from everywhere."""
    made = plan(recipe(face=1e-3))
    traced = trace_at(made, made.recipe.frame(0)[1])
    arrivals = traced.reverberation
    assert arrivals is not None
    silent = synthesise(made, replace(traced, reverberation=None))
    pressure = synthesise(made, traced).pressure.astype(float) - silent.pressure
    rate = made.scene.sonar.sampling_frequency
    time = silent.start + np.arange(pressure.shape[1]) / rate
    heard_energy = (pressure[:, (time > 14e-3) & (time < 28e-3)] ** 2).mean(axis=0).sum() / rate
    sent_paths = arrivals.energy[(arrivals.delay > 14e-3) & (arrivals.delay < 28e-3)].sum()
    assert 10.0 * np.log10(heard_energy / sent_paths) == pytest.approx(0.0, abs=0.4)


def test_snap_and_hydrophone_may_be_swapped() -> None:
    edges = np.arange(14e-3, 29e-3, 5e-3)

    def mean_rate(**places: Any) -> np.ndarray:
        found = []
        for seed in (1, 2, 3):
            made = plan(recipe(seed=seed, **places))
            arrivals = heard(made)
            found.append(np.histogram(arrivals.delay, edges, weights=arrivals.energy)[0] / sent(made))
        return np.mean(found, axis=0)

    there = mean_rate(snap=(6.0, 3.0), source_height=5.0)
    back = mean_rate(snap=(0.0, 0.0), sonar=Still(position=(6.0, 3.0, 5.0 - DEPTH)))
    assert np.abs(10.0 * np.log10(there / back)).max() < 0.3


@pytest.mark.parametrize("shape", [1.0, 4.0])
def test_patches_are_gamma_of_mean_1_and_stay_where_they_are(shape: float) -> None:
    """So that Gaussian speckle of mean power 1 over them has the contrast 2 (1 + 1/shape)."""
    draw = np.random.default_rng(2)
    place = np.column_stack([draw.uniform(-200.0, 200.0, (400_000, 2)), np.full(400_000, -DEPTH)])
    bright = texture(3, place, 1.0, shape)
    assert bright.mean() == pytest.approx(1.0, abs=0.02)
    power = bright * draw.exponential(size=len(bright))
    assert (power**2).mean() / power.mean() ** 2 == pytest.approx(2.0 * (1.0 + 1.0 / shape), rel=0.06)
    inside = np.floor(place) + draw.uniform(0.0, 1.0, place.shape)
    assert np.array_equal(texture(3, inside, 1.0, shape), bright)
    assert not np.array_equal(texture(4, inside, 1.0, shape), bright)


def test_scatterers_are_the_same_wherever_and_however_many_are_asked_for() -> None:
    """The first of each cell: for another place, a wider reach and more of them."""
    few, wide = (
        cells_about(np.array(at), reach, 2.0, "bottom", DEPTH) for at, reach in (((3.0, 1.0), 6.0), ((0.0, 0.0), 20.0))
    )
    place, cell, _ = scatterers(5, few, np.full(len(few.key), 2))
    more, cell_of_more, _ = scatterers(5, wide, np.full(len(wide.key), 3))
    by_key = {tuple(key): more[cell_of_more == n] for n, key in enumerate(wide.key.tolist())}
    for n, key in enumerate(few.key.tolist()):
        assert np.array_equal(place[cell == n], by_key[tuple(key)][:2])


@pytest.mark.parametrize(("depth", "height"), [(0.011, DEPTH - 5.0), (DEPTH - 0.011, 0.5)])
def test_at_surface_and_bottom_every_number_is_finite(depth: float, height: float) -> None:
    """Of an array 1 mm from there, and a snap so high over the bottom: grazing angles of nearly 0."""
    described = replace(LAMBERT, surface=WindySurface(wind_speed=10.0), bounces=1)
    found = heard(plan(recipe(described, sonar=Still(position=(0.0, 0.0, -depth)), source_height=height)))
    for value in (found.gain, found.energy, found.delay, found.direction):
        assert np.isfinite(value).all()
    assert len(found.gain) and (found.energy >= 0.0).all()


def test_nothing_that_scatters_is_silent() -> None:
    assert not len(heard(plan(recipe(replace(LAMBERT, bottom=None)))).delay)


def test_patches_change_no_mean_energy() -> None:
    def energy(shape: float | None) -> float:
        described = replace(LAMBERT, patchiness=shape, patch=1.0)
        return float(np.mean([heard(plan(recipe(described, seed=seed))).energy.sum() for seed in (1, 2, 3)]))

    assert 10.0 * np.log10(energy(4.0) / energy(None)) == pytest.approx(0.0, abs=0.4)


def test_many_scatterers_make_gaussian_noise_and_few_the_law() -> None:
    """<I^2>/<I>^2 of the complex envelope of a brute-force sum of signs behind a flat band of a tenth of the rate."""
    draw, samples, band = np.random.default_rng(3), 1_000_000, 0.1
    frequency = np.fft.fftfreq(samples)
    for per_pulse in (1.0, 3.0, 10.0):
        series = np.zeros(samples)
        place = draw.integers(0, samples, int(per_pulse * band * samples))
        np.add.at(series, place, draw.choice([-1.0, 1.0], len(place)))
        spectrum = np.fft.fft(series)
        spectrum[(frequency < 0.2) | (frequency >= 0.2 + band)] = 0.0
        power = np.abs(np.fft.ifft(spectrum)) ** 2
        assert (power**2).mean() / power.mean() ** 2 == pytest.approx(2.0 + SINC / per_pulse, rel=0.02)


def test_points_that_scatterers_make_say_so_and_those_of_targets_stay() -> None:
    """Where nothing else is heard every point is of reverberation; a target in the midst of it keeps what is its own.
    Of one scatterer in five for all, a tenth of the points had none."""
    array = PlanarLattice(columns=12, rows=10, pitch=0.05)
    base = remus(2, array=array, beams=BeamGrid(elevation_span=np.deg2rad(60), azimuth_span=np.deg2rad(60)))
    base = replace(base, accuracy=replace(base.accuracy, speckle=0.2))
    world = replace(base.scene.world, reverberation=Reverberation())
    processing = replace(base.scene.processing, echo_window=EchoWindow(start=7e-3, stop=12.7e-3))
    labels = []
    for some in (replace(world, targets=()), world):
        made = plan(replace(base, scene=replace(base.scene, world=some, processing=processing)))
        labels.append(render(made, 1)["cloud"].dataset.dropna("point", subset=["range"]))
    alone, beside = labels
    origin = ORIGINS.index("reverberation")
    assert alone.sizes["point"] > 20
    assert (alone.origin == origin).mean() > 0.98
    assert (alone.emission == 0).mean() > 0.98
    assert (alone.target == -1).all()
    echo = beside.isel(point=np.flatnonzero(beside.target == 0))
    assert echo.sizes["point"] > 0
    assert (echo.distance < 0.3).all()
    assert (beside.origin == origin).sum() > 50


@pytest.mark.parametrize("source", [(30.0, 4.0, -BOTTOM_DEPTH), (30.0, 4.0, -12.0), (30.0, 4.0, 0.0)])
@pytest.mark.parametrize("bounces", [0, 1, 2, 3])
def test_what_lights_a_scatterer_is_what_a_hydrophone_hears_there(source: tuple[float, ...], bounces: int) -> None:
    """Way by way. Of a snap on the bottom, or at the surface where they cancel, it and its image there are one way and
    add as pressures, not as energies."""
    place = np.array([3.0, -2.0, -15.0])
    water = replace(WATER, bottom=SeaBottom(reflection=Sediment(name="medium sand")))
    direct = heard_at_rest((), np.array(source), (), array=place, bounces=bounces, water=water)
    _, same = np.unique(np.round(direct.delay, 12), return_inverse=True)
    pressure = np.zeros(same.max(initial=-1) + 1, complex)
    np.add.at(pressure, same, direct.amplitude * np.exp(1j * direct.phase))
    medium = Medium(water, PROFILE)
    snap = Emission(np.array(source), 0.0, LogarithmicBubble(), None)
    receiver = Receiver(Pose(place + [0.0, 5.0, 0.0], EAST), ROMANIS)
    end = np.array([-place[2]])
    (back, *_) = back_ways(medium, receiver, end, 0, "volume")
    out = out_ways(medium, snap, end, bounces, "volume")
    found = [scattering_paths(place[None], snap, medium, receiver, way, back) for way in out]
    lit = np.array([float(p.amplitude[0] * p.back[0]) for p in found])
    lit, known = lit[np.argsort([p.delay[0] for p in found])], np.abs(pressure)
    assert np.allclose(lit[lit > 1e-12], known[known > 1e-12], rtol=1e-9, atol=0.0)
