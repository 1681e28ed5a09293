"""Signals against closed forms and the slow exact sum, and the laws that they obey."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Demand
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.kernels.fourier_sums import waves
from sonarsynth.products import ArrayExpansion, Arrivals, Kind
from sonarsynth.receiver import POINT, Band, BandPass, Converter, Elements, PositionTable, Romanis, Sonar, elements
from sonarsynth.signals import DirectSum, GriddedSynthesis, convert, pulse_support
from sonarsynth.signals.auto_synthesis import AutoSynthesis
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.gridded.nodes import chebyshev, interpolation, nodes_for
from sonarsynth.signals.gridded_synthesis import deposit_error, waves_of_few
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.state import Emission
from tests.filtered import filtered_pulse
from tests.hearing import hearing

MODEL = LogarithmicBubble()
SNAPS = (Emission(np.zeros(3), 0.0, MODEL, None),)
SONAR = Sonar()
SHARP = Sonar(filter=BandPass(low=35e3, high=75e3, transition=15e3, attenuation=160))  # nothing beyond 98 kHz
FACES = elements(Romanis())
C = 1540.0
APERTURE = FACES.aperture
SIZES = {"delay": 3e-7, "amplitude": 1e-3}
"""Of terms over the aperture, s and 1."""


def absorption(frequency: Floats) -> Floats:
    """dB/m, shaped like sea water's."""
    return 1e-3 * (0.05 + 35.0 * frequency**2 / (frequency**2 + 60e3**2))


def some_of(array: Elements, step: int, face: float | None = None) -> Elements:
    return replace(array.select(np.arange(0, array.count, step)), face=array.face if face is None else face)


def arrivals(
    delay: Floats,
    direction: Floats,
    radius: Floats,
    amplitude: Floats,
    *,
    loss: Floats | None = None,
    snap: Floats | None = None,
    target: Floats | None = None,
    expanded: dict[str, Floats] | None = None,
) -> Arrivals:
    n = len(delay)
    one, zero = np.ones(n), np.zeros(n, np.int64)
    return Arrivals(
        delay=np.asarray(delay, float),
        direction=np.asarray(direction, float) / np.linalg.norm(direction, axis=1, keepdims=True),
        radius=np.asarray(radius, float),
        expansion=replace(ArrayExpansion.none(n, APERTURE), **(expanded or {})),
        amplitude=np.asarray(amplitude, float),
        spreading_out=one,
        spreading_in=one,
        scattering=one,
        boundary=one,
        absorption=np.zeros(n) if loss is None else loss,
        length=np.asarray(radius, float),
        snap=zero if snap is None else np.asarray(snap, np.int64),
        kind=np.where(zero if target is None else np.asarray(target) < 0, Kind.DIRECT, Kind.ECHO).astype(np.int8),
        target=zero if target is None else np.asarray(target, np.int64),
        facet=zero,
        point=np.zeros((n, 3)),
        surface=zero,
        bottom=zero,
        turning=zero,
        caustics=zero,
        lit_by=zero,
        arrives_by=zero,
        phase=np.zeros(n),
        delay_std=np.zeros(n),
        echo_delay_std=np.zeros(n),
        doppler=np.zeros(n),
        coherent=np.zeros(n, bool),
        corner_delays=np.zeros((n, 3)),
        coherent_fraction=np.zeros(n),
        height_delay_std=np.zeros(n),
        occluded=np.zeros((n, 0), np.uint8),
        centre=55e3,
        sound_speed=C,
    )


def target_at(distance: float, count: int, seed: int, *, refracted: bool = False, direct: bool = True) -> Arrivals:
    """Echoes of points of a body of 1.6 m, some metres off the axis, and the direct snap 50 dB above them."""
    rng = np.random.default_rng(seed)
    points = np.array([distance, 0.15 * distance, 0.08 * distance])
    points = points + rng.uniform(-1, 1, (count, 3)) * [0.3, 0.8, 0.1]
    source = np.array([0.4 * distance, -0.2 * distance, -0.2 * distance])
    out = np.linalg.norm(points - source, axis=1)
    radius = np.linalg.norm(points, axis=1)
    amplitude = 0.02 * rng.standard_normal(count) / (radius * out)
    delay, target = (radius + out) / C, np.zeros(count)
    if direct:
        r = np.linalg.norm(source)
        points, radius, amplitude = np.vstack([points, source]), np.append(radius, r), np.append(amplitude, 1 / r)
        delay, target = np.append(delay, r / C), np.append(target, -1)
    n = len(delay)
    return arrivals(
        delay,
        points,
        radius,
        amplitude,
        loss=0.018 * delay * C,
        target=target,
        expanded={name: rng.uniform(-1, 1, (n, 20)) * s for name, s in SIZES.items()} if refracted else None,
    )


def error(got: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(got - exact).max() / np.abs(exact).max())


# ---- the exact sum against closed forms ------------------------------------------------------------------------------


def test_exact_sum_is_the_filtered_snap_at_the_exact_delays() -> None:
    """Point hydrophones, spherical waves: amplitude R/|R d - q| and delay |R d - q|/c, evaluated in time."""
    array = some_of(FACES, 100, face=0.0)
    of = target_at(12.0, 3, 1, direct=False)
    hears = hearing(of, SHARP, array)
    got, _ = DirectSum().pressure(of, SNAPS, hears)
    expected = np.zeros_like(got)
    t = hears.start + np.arange(hears.samples) / SHARP.sampling_frequency
    for e in range(3):
        source = of.radius[e] * of.direction[e]
        for s, q in enumerate(array.position):
            far = np.linalg.norm(source - q)
            late = of.delay[e] + (far - of.radius[e]) / C
            near = np.abs(t - late) < 1e-3
            wave = filtered_pulse(t[near] - late, MODEL.bubble, fir(SHARP.antialias))
            expected[s, near] += of.amplitude[e] * of.radius[e] / far * wave
    assert error(got, expected) < 1e-7


def test_exact_sum_with_the_default_filter_leaves_out_what_would_fold() -> None:
    of = arrivals([0.01], [[1.0, 0.2, 0.0]], [10.0], [1.0])
    hears = hearing(of, SONAR, POINT)
    got, _ = DirectSum().pressure(of, SNAPS, hears)
    t = hears.start + np.arange(hears.samples) / SONAR.sampling_frequency - 0.01
    exact = filtered_pulse(t, MODEL.bubble, fir(SONAR.antialias))
    assert 1e-8 < error(got[0], exact) < 2e-5  # 80 dB down and beyond half the sampling frequency


def test_element_face_is_the_mean_of_points_over_it() -> None:
    """A plane wave: the mean over a fine grid of points on the face, to the square of the grid's spacing."""
    n, face = 24, FACES.face
    offset = (np.arange(n) + 0.5) / n * face - 0.5 * face
    points = tuple((0.0, float(y), float(z)) for y in offset for z in offset)
    of = arrivals([0.01], [[1.0, 0.35, -0.2]], [np.inf], [1.0])
    hears = hearing(of, SONAR, replace(POINT, face=face))
    got, _ = DirectSum().pressure(of, SNAPS, hears)
    mean, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=elements(PositionTable(positions=points))))
    assert error(got[0], mean.mean(axis=0)) < 3e-3
    assert element_directivity(80e3, of.direction[0], face, C) < 0.7  # so the face does something


@pytest.mark.parametrize("even", [True, False])
def test_waves_are_those_of_each_frequency(even: bool) -> None:
    """Of even steps, products of two waves, and of any others; from 0 Hz on."""
    random = np.random.default_rng(5)
    frequency = np.arange(401) * 245.0 if even else np.append(0.0, np.sort(random.uniform(0.0, 98e3, 400)))
    time = random.uniform(-0.02, 0.02, 11)
    assert np.abs(waves(frequency, time) - np.exp(-2j * np.pi * np.outer(time, frequency))).max() < 1e-11


def test_absorption_is_relative_to_the_band_centre() -> None:
    """A path of 40 dB at the centre: each frequency is as loud as its own absorption says."""
    of = arrivals([0.01], [[1.0, 0.0, 0.0]], [10.0], [10 ** (-40 / 20)], loss=np.array([40.0]))
    hears = hearing(of, SONAR, POINT, absorption)
    lost, _ = DirectSum().pressure(of, SNAPS, hears)
    plain, _ = DirectSum().pressure(of, SNAPS, hears._replace(absorption=None))
    f = np.fft.rfftfreq(hears.samples, 1 / SONAR.sampling_frequency)
    inside = (f > 30e3) & (f < 80e3)
    ratio = np.abs(np.fft.rfft(lost[0]) / np.fft.rfft(plain[0]))[inside]
    centre = absorption(np.array([SONAR.band.centre]))
    np.testing.assert_allclose(20 * np.log10(ratio), 40 - 40 * absorption(f[inside]) / centre, atol=2e-3)


# ---- the fast synthesis against the exact sum ------------------------------------------------------------------------


def test_many_echoes_of_one_sign_keep_the_error_of_each() -> None:
    """Isotropic facets in a narrow band: where the filter stops the snap, long waves add up over all of them."""
    rng, count = np.random.default_rng(0), 4000
    sonar, method = Sonar(filter=BandPass(low=60e3, high=63e3)), GriddedSynthesis(width=8, tolerance=1e-3)
    spread = rng.uniform(-1, 1, (count, 3)) * [0.1, 0.03, 0.03]
    found = arrivals(0.02 + 1.5e-4 * rng.random(count), [1.0, 0.0, 0.0] + spread, np.full(count, 20.0), np.ones(count))
    array = some_of(FACES, 250, 0.0)
    exact, _ = DirectSum().pressure(found, SNAPS, Reception(array, sonar, None, 0.0185, 1024))
    fast, _ = method.pressure(found, SNAPS, Reception(array, sonar, None, 0.0185, 1024))
    assert np.abs(fast - exact).max() < deposit_error(method) * np.abs(exact).max()


@pytest.mark.parametrize(("seed", "tolerance"), [(59, 1e-3), (35, 7e-4), (59, 3e-4)])
def test_paths_of_one_sign_at_few_hydrophones_keep_the_bound(seed: int, tolerance: float) -> None:
    """Errors of paths do not come at random there, and add up: of 60 such sets these err most."""
    rng = np.random.default_rng(seed)
    count, pitch, columns, rows = rng.integers(50, 900), rng.uniform(0.02, 0.08), rng.integers(3, 8), rng.integers(3, 6)
    place = pitch * (np.mgrid[0:columns, 0:rows].reshape(2, -1).T - 0.5 * (np.array([columns, rows]) - 1))
    array = elements(PositionTable(positions=tuple((0.0, *p) for p in place.tolist()), face=min(0.05, pitch)))
    ahead, size = rng.uniform(3, 12), rng.uniform(0.1, 0.5, 3)
    points = np.array([ahead, *(ahead * rng.uniform(-0.3, 0.3, 2))]) + rng.uniform(-0.5, 0.5, (count, 3)) * size
    source = np.array([rng.uniform(1, ahead), rng.uniform(-4, 4), -3.0])
    radius, out = np.linalg.norm(points, axis=1), np.linalg.norm(points - source, axis=1)
    delay = (radius + out) / C
    found = arrivals(delay, points, radius, 1.0 / (radius * out))
    found = replace(found, expansion=ArrayExpansion.none(count, array.aperture))
    start, samples = delay.min() - 0.4 / C, int((np.ptp(delay) + 0.8 / C) * 196e3) + 200
    method = GriddedSynthesis(width=8, tolerance=tolerance)
    exact, _ = DirectSum().pressure(found, SNAPS, Reception(array, SONAR, None, start, samples))
    fast, _ = method.pressure(found, SNAPS, Reception(array, SONAR, None, start, samples))
    assert np.abs(fast - exact).max() < deposit_error(method) * np.abs(exact).max()


@pytest.mark.parametrize(("low", "width", "transition"), [(1e3, 100.0, 5e3), (5e3, 200.0, 1e3), (60e3, 500.0, 5e3)])
@pytest.mark.parametrize("count", [1, 100])
def test_what_a_narrow_filter_leaks_is_heard(low: float, width: float, transition: float, count: int) -> None:
    """A thousandth of the sound is beyond the stop edge: the bound holds it, and many hydrophones hear it alike."""
    band, chosen = Band(low=low, high=low + width), BandPass(low=low, high=low + width, transition=transition)
    sonar, method = Sonar(band=band, filter=chosen), GriddedSynthesis(width=8, tolerance=2e-5)
    found = target_at(20.0, count, 3, direct=False)
    hears = hearing(found, sonar, FACES, absorption)
    exact, _ = DirectSum().pressure(found, SNAPS, hears._replace(elements=some_of(FACES, 127)))
    fast, _ = method.pressure(found, SNAPS, hears)
    assert error(fast[::127], exact) < deposit_error(method)


def test_echoes_in_a_narrow_band_err_by_what_plans_ask_for() -> None:
    """Paths of an echo cancel wherever it is heard, and errors do not: up to twice what was said."""
    sonar = Sonar(band=Band(low=78e3, high=80e3), filter=BandPass(low=78e3, high=80e3, transition=1e3))
    demand = Demand(1e-4, False, lambda method: 0.0, FACES, bandwidth=2e3)
    methods = [GriddedSynthesis(tolerance=2e-5).resolve(demand), AutoSynthesis().resolve(demand)]
    assert methods[1][1] <= 1e-4
    for seed in range(8):
        found = target_at(20.0, 300, seed, direct=False)
        hears = hearing(found, sonar, FACES, absorption)
        exact, _ = DirectSum().pressure(found, SNAPS, hears._replace(elements=some_of(FACES, 127)))
        for method, said in methods:
            assert error(method.signals(found, SNAPS, hears).pressure[::127], exact) < said


@pytest.mark.parametrize("distance", [12.0, 14.0, 16.0, 20.0])
@pytest.mark.parametrize("tolerance", [1e-3, 1.5e-4])
def test_a_pulse_by_itself_keeps_the_bound(distance: float, tolerance: float) -> None:
    """Its error at the nodes over the aperture is that of the signal: no other path averages it out."""
    method = GriddedSynthesis(tolerance=tolerance)
    places = [(0.0, 0.05 * y, 0.05 * z) for y in range(-4, 4) for z in range(-3, 3)]
    array = elements(PositionTable(positions=tuple(places), face=0.05))
    found = arrivals(np.array([0.02]), np.array([[0.88, 0.45, 0.15]]), np.array([distance]), np.ones(1))
    exact, _ = DirectSum().pressure(found, SNAPS, Reception(array, SONAR, None, 0.0185, 1024))
    fast, _ = method.pressure(found, SNAPS, Reception(array, SONAR, None, 0.0185, 1024))
    assert np.abs(fast - exact).max() < deposit_error(method) * np.abs(exact).max()


@pytest.mark.parametrize("distance", [20.0, 6.0, 2.5])
@pytest.mark.parametrize("refracted", [False, True])
def test_kernel_deposit_is_the_exact_sum(distance: float, refracted: bool) -> None:
    array = some_of(FACES, 32)
    of = target_at(distance, 40, 2, refracted=refracted, direct=False)
    hears = hearing(of, SONAR, array, absorption)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = GriddedSynthesis().signals(of, SNAPS, hears)
    assert error(got.pressure, exact) < 1e-4
    assert got.outside == 0
    assert got.pressure.dtype == np.float32


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize("refracted", [False, True])
def test_few_hydrophones_hear_as_exactly_as_many(count: int, refracted: bool) -> None:
    """Fewer than the terms that wavefronts and amplitudes are expanded in."""
    array = FACES.select(np.linspace(7, FACES.count - 1, count).astype(int))
    of = target_at(20.0, 40, 2, refracted=refracted, direct=False)
    hears = hearing(of, SONAR, FACES, absorption)
    exact, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=array))
    got = GriddedSynthesis().signals(of, SNAPS, hears._replace(elements=array))
    assert error(got.pressure, exact) < 1e-4


def test_nodes_over_the_aperture_serve_the_whole_array() -> None:
    """Enough paths that nodes pay: 508 hydrophones interpolated from some tens of points, the direct snap apart."""
    of = target_at(20.0, 500, 3)
    hears = hearing(of, SONAR, FACES, absorption)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure[::127]
    exact, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=some_of(FACES, 127)))
    late = int((of.delay[of.target == 0].min() - 2.3e-3 - hears.start) * SONAR.sampling_frequency)
    assert error(got[:, late:], exact[:, late:]) < 1e-4  # relative to the echo
    assert error(got, exact) < 1e-4


@pytest.mark.parametrize("families", [False, True])
def test_bodies_heard_one_after_the_other_are_each_where_they_belong(families: bool) -> None:
    """Pulses that overlap in a chain are one stretch of time, of which each direction has but a part; large families of
    paths have tiles of their own, whatever else comes from their direction."""
    body = target_at(20.0, 600 if families else 300, 5, direct=False)
    sides = np.array([[1, 1, 1], [1, -1, 1], [1, 1, -1], [1, -1, -1], [1, 3, 1], [1, -3, 1]])
    ways = np.repeat([0, 1, 2, 3, 0, 2] if families else [0] * 6, body.delay.size)
    of = arrivals(
        np.concatenate([body.delay + 1.5e-3 * n for n in range(len(sides))]),
        np.concatenate([body.direction * side for side in sides]),
        np.tile(body.radius, len(sides)),
        np.tile(body.amplitude, len(sides)),
        loss=np.tile(body.absorption, len(sides)),
    ).but(arrives_by=ways, lit_by=np.roll(ways, body.delay.size))
    hears = hearing(of, SONAR, FACES, absorption)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure[::127]
    exact, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=some_of(FACES, 127)))
    assert error(got, exact) < 1e-4


@pytest.mark.parametrize(
    ("sooner", "sounds"), [(0.03, False), (0.0199, True), (0.01, True), (0.0, True), (-0.01, False)]
)
def test_what_a_stretch_leaves_out_is_silence(sooner: float, sounds: bool) -> None:
    """Echoes in the middle of the window, cut by either end of it, and outside."""
    of, rate = target_at(20.0, 60, 3, direct=False), SONAR.sampling_frequency
    window = Reception(FACES, SONAR, absorption, float(of.delay.mean()) - sooner, round(0.02 * rate))
    whole, stretch = (GriddedSynthesis().signals(of, SNAPS, window._replace(whole=w)) for w in (True, False))
    first, heard = round((stretch.start - whole.start) * rate), stretch.pressure
    assert heard.shape[1] < 0.5 * window.samples and stretch.outside == whole.outside
    silence = np.zeros_like(whole.pressure)
    silence[:, first : first + heard.shape[1]] = heard
    np.testing.assert_array_equal(silence, whole.pressure)
    assert heard.any() == sounds


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_lobes_that_vary_over_the_aperture(size: float) -> None:
    """Amplitudes that are cubics of any size, each path its own: from broad lobes to those that miss half the array."""
    of = target_at(20.0, 400, 17, direct=False)
    terms = np.random.default_rng(18).uniform(-1, 1, (400, 20)) * size
    of = replace(of, expansion=replace(of.expansion, amplitude=terms))
    hears = hearing(of, SONAR, FACES, absorption)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    some = np.append(np.argsort(-np.linalg.norm(FACES.position, axis=1), kind="stable")[:4], 250)  # rim and middle
    exact, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=FACES.select(some)))
    assert error(got[some], exact) < 1e-4


def test_one_path_needs_no_deposit() -> None:
    """Alone in its stretch of time a path is exact but for its directivity between nodes and the ends of the band."""
    array = some_of(FACES, 20)
    of = target_at(15.0, 1, 19, refracted=True)
    hears = hearing(of, SONAR, array, absorption)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got, _ = GriddedSynthesis(tolerance=1e-6, precision="float64").pressure(of, SNAPS, hears)
    assert 1e-14 < error(got, exact) < 1e-6


@pytest.mark.parametrize("tolerance", [1e-2, 1.5e-4, 1e-6, 1e-11])
@pytest.mark.parametrize("phase", [0.0, 1e-6, 0.3, 2.0, 9.0, 30.0])
@pytest.mark.parametrize("degrees", [(1.0,), (1.1, 0.1, 1e-3, 1e-4), (0.5, 2.0, 1.0, 0.3)])
def test_waves_are_interpolated_to_the_tolerance(tolerance: float, phase: float, degrees: tuple[float, ...]) -> None:
    """Waves of every phase up to the largest, times the polynomials allowed, at points that are not nodes."""
    colours = (0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9)
    axis = nodes_for(phase, colours, tolerance, degrees)
    assert axis.nodes <= nodes_for(phase, colours, tolerance / 10, degrees).nodes
    x, at = np.linspace(-1, 1, 97), chebyshev(axis.nodes)
    onto = interpolation(x, axis)
    assert np.abs(onto).sum(axis=1).max() < 4.0  # no error of the nodes is blown up
    k = np.multiply.outer(colours, np.linspace(-1, 1, 41) * phase)
    errors = np.zeros(len(colours))
    for d, size in enumerate(degrees):
        here, there = (np.cos(d * np.arccos(y))[:, None, None] * np.exp(1j * np.multiply.outer(y, k)) for y in (x, at))
        errors += size * np.abs(here - np.tensordot(onto, there, 1)).max(axis=(0, 2))
    assert errors.mean() < 1.05 * tolerance


@pytest.mark.parametrize(
    ("method", "bound"),
    [
        (GriddedSynthesis(width=4, tolerance=1e-3), 3e-3),
        (GriddedSynthesis(), 1e-4),
        (GriddedSynthesis(width=8, tolerance=1e-5), 5e-6),
        (GriddedSynthesis(width=6, oversampling=3.0, tolerance=1e-5), 5e-6),
        (GriddedSynthesis(width=14, precision="float64", tolerance=1e-12), 1e-9),
    ],
)
def test_each_knob_buys_its_error(method: GriddedSynthesis, bound: float) -> None:
    array = some_of(FACES, 30)
    of = target_at(8.0, 20, 4, refracted=True, direct=False)
    hears = hearing(of, SHARP, array, absorption)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got, _ = method.pressure(of, SNAPS, hears)
    assert 1e-14 < error(got, exact) < bound


def test_hydrophones_anywhere_and_plane_waves() -> None:
    rng = np.random.default_rng(5)
    array = elements(PositionTable(positions=tuple(map(tuple, rng.uniform(-0.4, 0.4, (14, 3)).tolist())), face=0.02))
    n = 12
    of = arrivals(rng.uniform(0.01, 0.012, n), rng.standard_normal((n, 3)), np.full(n, np.inf), rng.standard_normal(n))
    hears = hearing(of, SONAR, array)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = GriddedSynthesis().signals(of, SNAPS, hears)
    assert error(got.pressure, exact) < 1e-4


def test_several_snaps_of_different_kinds_and_levels() -> None:
    rng = np.random.default_rng(6)
    other = LogarithmicBubble(q=-2.5e5)
    snaps = (*SNAPS, Emission(np.zeros(3), 0.0, MODEL, 180.0), Emission(np.zeros(3), 0.0, other, 190.0))
    of = target_at(15.0, 30, 7, direct=False)
    of = arrivals(of.delay, of.direction, of.radius, of.amplitude, snap=rng.integers(0, 3, 30))
    array = some_of(FACES, 60)
    hears = hearing(of, SONAR, array)
    exact, _ = DirectSum().pressure(of, snaps, hears)
    got = GriddedSynthesis().signals(of, snaps, hears)
    assert error(got.pressure, exact) < 1e-4
    parts = sum(DirectSum().pressure(of.select(of.snap == i), snaps, hears)[0] for i in range(3))
    np.testing.assert_allclose(parts, exact, atol=1e-12)


# ---- laws ------------------------------------------------------------------------------------------------------------

METHODS = (DirectSum(), GriddedSynthesis())
Run = Callable[[Arrivals, float, int], np.ndarray]


def run(method: DirectSum | GriddedSynthesis, array: Elements) -> Run:
    def go(of: Arrivals, start: float, samples: int) -> np.ndarray:
        return method.signals(of, SNAPS, Reception(array, SONAR, absorption, start, samples)).pressure.astype(float)

    return go


@pytest.mark.parametrize("method", METHODS)
def test_doubled_amplitude_doubles_the_pressure_and_sums_add(method: DirectSum | GriddedSynthesis) -> None:
    array = some_of(FACES, 60)
    of = target_at(15.0, 24, 9, direct=False)
    start, samples = hearing(of, SONAR, array)[3:5]
    go = run(method, array)
    whole = go(of, start, samples)
    half = go(of.select(np.arange(24) < 12), start, samples) + go(of.select(np.arange(24) >= 12), start, samples)
    assert error(half, whole) < 1e-4
    louder = arrivals(of.delay, of.direction, of.radius, 2 * of.amplitude, loss=of.absorption)
    assert error(go(louder, start, samples), 2 * whole) < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_a_delay_of_part_of_a_sample_is_a_ramp_of_phase(method: DirectSum | GriddedSynthesis) -> None:
    array = some_of(FACES, 60)
    of = target_at(15.0, 24, 10, direct=False)
    start, samples = hearing(of, SONAR, array)[3:5]
    shift = 3.37 / SONAR.sampling_frequency
    later = arrivals(of.delay + shift, of.direction, of.radius, of.amplitude, loss=of.absorption)
    go = run(method, array)
    a, b = (np.fft.rfft(go(x, start, samples + 20), 2 * samples) for x in (of, later))
    f = np.fft.rfftfreq(2 * samples, 1 / SONAR.sampling_frequency)
    inside = f < 90e3
    turned = a * np.exp(-2j * np.pi * f * shift)
    assert error(b[:, inside], turned[:, inside]) < 1e-4
    assert error(go(later, start + shift, samples), go(of, start, samples)) < 1e-4  # and time has no origin


@pytest.mark.parametrize("method", METHODS)
def test_windows_that_adjoin_hold_what_one_window_holds(method: DirectSum | GriddedSynthesis) -> None:
    array = some_of(FACES, 60)
    of = target_at(15.0, 24, 11)
    hears = hearing(of, SONAR, array, absorption)
    fs = SONAR.sampling_frequency
    cut = int((np.median(of.delay) - hears.start) * fs)
    whole = method.signals(of, SNAPS, hears)
    first = method.signals(of, SNAPS, Reception(array, SONAR, absorption, hears.start, cut))
    second = method.signals(of, SNAPS, Reception(array, SONAR, absorption, hears.start + cut / fs, hears.samples - cut))
    assert error(np.hstack([first.pressure, second.pressure]), whole.pressure) < 3e-6
    assert whole.outside == 0
    assert first.outside == 24  # every echo begins before the middle one has ended
    assert second.outside == 25


@pytest.mark.parametrize("method", METHODS)
def test_what_falls_outside_is_counted_and_never_wrapped(method: DirectSum | GriddedSynthesis) -> None:
    array = some_of(FACES, 100)
    of = target_at(15.0, 8, 12, direct=False)
    start, samples = hearing(of, SONAR, array)[3:5]
    for far in (-1.0, -(samples + 300) / SONAR.sampling_frequency, samples / SONAR.sampling_frequency, 5.0):
        got = method.signals(of, SNAPS, Reception(array, SONAR, absorption, start + far, samples))
        assert got.outside == 8
        assert not got.pressure.any()


def test_quiet_time_is_exactly_silent() -> None:
    array = some_of(FACES, 100)
    of = target_at(15.0, 8, 13)
    hears = hearing(of, SONAR, array, absorption)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    silent = (got == 0.0).all(axis=0)
    before, after = pulse_support(waveform(MODEL), SONAR.antialias)
    t = hears.start + np.arange(hears.samples) / SONAR.sampling_frequency
    near = ((t > of.delay[:, None] - before - 1e-3) & (t < of.delay[:, None] + after + 1e-3)).any(axis=0)
    assert (silent | near).mean() > 0.99
    assert silent.sum() > 0.1 * hears.samples


@pytest.mark.parametrize("method", METHODS)
def test_mirrored_paths_give_mirrored_signals(method: DirectSum | GriddedSynthesis) -> None:
    """Port and starboard: y -> -y swaps the columns of the array."""
    positions = ((0.0, 0.3, 0.1), (0.0, -0.3, 0.1), (0.0, 0.5, -0.2), (0.0, -0.5, -0.2))
    array = elements(PositionTable(positions=positions, face=0.05))
    of = target_at(15.0, 16, 14, direct=False)
    other = arrivals(of.delay, of.direction * [1, -1, 1], of.radius, of.amplitude, loss=of.absorption)
    start, samples = hearing(of, SONAR, array)[3:5]
    go = run(method, array)
    assert error(go(other, start, samples)[[1, 0, 3, 2]], go(of, start, samples)) < 1e-4


def test_dead_elements_give_nothing_and_change_no_other() -> None:
    of = target_at(20.0, 50, 15)
    hears = hearing(of, SONAR, FACES)
    some = elements(Romanis(dead=(0, 200, 507)))
    alive = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    got = GriddedSynthesis().signals(of, SNAPS, hears._replace(elements=some)).pressure
    assert not got[[0, 200, 507]].any()
    rest = some.gain > 0
    np.testing.assert_array_equal(got[rest], alive[rest])


def test_the_same_bits_every_time() -> None:
    of = target_at(20.0, 300, 16)
    hears = hearing(of, SONAR, FACES, absorption)
    a, b, late = (GriddedSynthesis().signals(of, SNAPS, hears) for _ in range(3))
    np.testing.assert_array_equal(a.pressure, b.pressure)
    whole, in_segments = (convert(some, Converter(bits=10, full_scale=0.5 * a.pressure.max())) for some in (a, late))
    assert whole.clipped == in_segments.clipped > 0
    np.testing.assert_array_equal(whole.pressure, in_segments.pressure)


def test_few_paths_that_differ_in_anything_are_heard_anew() -> None:
    array = some_of(FACES, 60)
    of, method = target_at(15.0, 3, 14, refracted=True), GriddedSynthesis()
    hears = hearing(of, SONAR, array, absorption)._replace(still=True)
    one = np.ones(len(of.delay))
    for change in (
        {"delay": of.delay + 1e-8},
        {"amplitude": of.amplitude * np.where(np.arange(len(one)) == 1, 1.001, 1.0)},
        {"radius": of.radius * 0.9},
        {"phase": 0.01 * one},
        {"doppler": 1e-4 * one},
        {"delay_std": 1e-6 * one},
        {"expansion": replace(of.expansion, delay=1.01 * of.expansion.delay)},
        {"occluded": np.repeat(np.arange(1 + array.count // 8)[None] == 0, len(one), axis=0).astype(np.uint8)},
    ):
        first = method.signals(of, SNAPS, hears).pressure
        other = method.signals(replace(of, **change), SNAPS, hears).pressure
        assert not np.array_equal(first, other)
        waves_of_few.cache_clear()
        np.testing.assert_array_equal(method.signals(replace(of, **change), SNAPS, hears).pressure, other)
        np.testing.assert_array_equal(method.signals(of, SNAPS, hears).pressure, first)
