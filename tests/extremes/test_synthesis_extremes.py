"""Synthesis where it is stiff: very near, very far, plane, late, crowded, empty, and wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.products import Arrivals, Kind
from sonarsynth.receiver import Elements, LowPass, PositionTable, Sonar, elements
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.segments import Reception
from tests.hearing import hearing
from tests.laws.test_synthesis import MODEL, SNAPS, SONAR, arrivals

GRID = np.linspace(-0.6, 0.6, 4)
ARRAY = elements(PositionTable(positions=tuple((0.0, float(y), float(z)) for y in GRID for z in GRID), face=49.53e-3))
METHODS = (DirectSum(), GriddedSynthesis())


def error_of(method: GriddedSynthesis, of: Arrivals, array: Elements) -> float:
    hears = hearing(of, SONAR, array)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = method.signals(of, SNAPS, hears).pressure
    return float(np.abs(got - exact).max() / np.abs(exact).max())


@pytest.mark.parametrize("radius", [0.87, 1.0, 3.0, 1e3, 1e8, 1e300, np.inf])
def test_any_curvature(radius: float) -> None:
    rng = np.random.default_rng(1)
    direction = np.array([1.0, 0.2, 0.1]) + 0.05 * rng.standard_normal((20, 3))
    of = arrivals(rng.uniform(0.01, 0.011, 20), direction, np.full(20, radius), rng.standard_normal(20))
    assert error_of(GriddedSynthesis(), of, ARRAY) < 1e-4


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_along_the_edges_and_from_behind(direction: tuple[float, float, float]) -> None:
    of = arrivals([0.01], [direction], [5.0], [1.0])
    assert error_of(GriddedSynthesis(), of, ARRAY) < 1e-4


def test_from_all_sides_at_once() -> None:
    rng = np.random.default_rng(2)
    of = arrivals(rng.uniform(0, 2e-3, 40), rng.standard_normal((40, 3)), rng.uniform(2, 50, 40), rng.uniform(1, 2, 40))
    assert error_of(GriddedSynthesis(), of, ARRAY) < 1e-4


def test_opposite_paths_of_one_tile() -> None:
    of = arrivals([0.01, 0.01], [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], [np.inf, np.inf], [1.0, 1.0])
    assert error_of(GriddedSynthesis(), of, ARRAY) < 1e-4


def test_paths_that_are_all_alike() -> None:
    of = arrivals(np.full(300, 0.01), np.tile([1.0, 0.2, 0.1], (300, 1)), np.full(300, 20.0), np.full(300, 1 / 300))
    one = arrivals([0.01], [[1.0, 0.2, 0.1]], [20.0], [1.0])
    hears = hearing(of, SONAR, ARRAY)
    many, single = (GriddedSynthesis().signals(x, SNAPS, hears).pressure for x in (of, one))
    np.testing.assert_allclose(many, single, atol=1e-4 * np.abs(single).max())  # one path alone needs no deposit


def test_an_echo_120_db_below_the_direct_snap_keeps_its_accuracy() -> None:
    of = arrivals([0.01, 0.02], [[1.0, 0.1, 0.1], [1.0, -0.2, 0.0]], [20.0, 25.0], [1.0, 1e-6])
    of = replace(of, target=np.array([-1, 0]), kind=np.array([Kind.DIRECT, Kind.ECHO], np.int8))
    hears = hearing(of, SONAR, ARRAY)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    alone, _ = DirectSum().pressure(of.select(of.target == 0), SNAPS, hears)
    late = int((0.018 - hears.start) * SONAR.sampling_frequency)
    assert np.abs(got - alone)[:, late:].max() < 1e-4 * np.abs(alone).max()
    assert np.abs(got - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"amplitude": np.array([1.0, np.nan])}, "arrival 1 has amplitude that is not a finite number"),
        ({"amplitude": np.array([0.0, 1.0])}, "arrival 0 has no amplitude"),
        ({"delay": np.array([0.0, np.inf])}, "arrival 1 has delay"),
        ({"radius": np.array([1.0, 0.0])}, "arrival 1 has a radius that is not positive"),
        ({"radius": np.array([np.nan, 2.0])}, "arrival 0 has a radius that is not positive"),
        ({"snap": np.array([0, 1])}, r"snap outside 0\.\.0"),
        ({"phase": np.array([0.0, np.nan])}, "arrival 1 has phase that is not a finite number"),
        ({"delay_std": np.array([np.inf, 0.0])}, "arrival 0 has delay_std that is not a finite number"),
        ({"delay_std": np.array([0.0, -1e-9])}, "arrival 1 has a negative delay_std"),
        ({"doppler": np.array([np.nan, 0.0])}, "arrival 0 has doppler that is not a finite number"),
        ({"doppler": np.array([0.0, -0.1])}, r"arrival 1 has a Doppler factor that is not within \+-0\.1"),
        (
            {"radius": np.array([0.2, 2.0]), "direction": np.array([[0.0, 0.0, 1.0]] * 2)},
            "arrival 0 comes from a hydrophone",
        ),
    ],
)
def test_what_cannot_be_synthesised_is_refused(
    method: DirectSum | GriddedSynthesis, change: dict[str, np.ndarray], message: str
) -> None:
    array = elements(PositionTable(positions=((0.0, 0.0, 0.2), (0.0, 0.0, -0.2))))
    of = replace(arrivals([0.0, 1e-4], [[1.0, 0.0, 0.0]] * 2, [2.0, 2.0], [1.0, 1.0]), **change)
    with pytest.raises(ValueError, match=message):
        method.signals(of, SNAPS, Reception(array, SONAR, None, -0.01, 4000))


def shaped(of: Arrivals, phase: object, delay_std: object, doppler: object) -> Arrivals:
    some = (np.broadcast_to(np.asarray(x, float), of.delay.shape).copy() for x in (phase, delay_std, doppler))
    return replace(of, **dict(zip(("phase", "delay_std", "doppler"), some, strict=True)))


FEW = arrivals(
    [0.01, 0.0101, 0.0103], [[1.0, 0.1, 0.0], [1.0, 0.15, 0.1], [1.0, -0.1, 0.0]], [20.0] * 3, [1.0, 0.5, -2.0]
)


@pytest.mark.parametrize(
    ("phase", "delay_std", "doppler"),
    [
        (1e6, 0.0, 0.0),
        ([0.0, 1e300, -1e6], 0.0, 0.0),
        ([0.5 * np.pi, -0.5 * np.pi, 0.5 * np.pi - 1e-9], 0.0, 0.0),  # half turns apart
        ([1e-300, 1e-12, 1e-5], 0.0, 0.0),
        (0.0, [0.0, 1e-300, 1e-9], 0.0),
        (0.0, [2e-6, 1e-3, 1e300], 0.0),  # the last ones are silent
        (0.0, [14e-6, 15e-6, 16e-6], 0.0),  # what is left is 40 dB down, and as exact
        (0.0, 0.0, [1e-300, -1e-13, 1e-9]),
        (0.0, 0.0, [0.0999, -0.0999, 0.0]),
        ([2.0, 1.0, 0.0], [0.0, 4e-6, 15e-6], [1e-3, 1e-3, -0.05]),
    ],
)
def test_any_shape_of_pulse(phase: object, delay_std: object, doppler: object) -> None:
    of = shaped(FEW, phase, delay_std, doppler)
    assert error_of(GriddedSynthesis(), of, ARRAY) < 1e-4
    assert error_of(GriddedSynthesis(), of.select(np.array([0])), ARRAY) < 1e-4


@pytest.mark.parametrize("loss", [(1e-9, 0.0, 0.0), (10.0, 11.0, 14.0), (0.0, 20.0, 40.0)])
def test_pulses_of_any_shape_and_any_absorption(loss: tuple[float, float, float]) -> None:
    """Absorption among the modes, and, where it differs by 2 Np over the band, in terms of its own."""
    of = replace(shaped(FEW, [0.0, 1.0, 2.0], [0.0, 3e-6, 5e-6], 1e-3), absorption=np.array(loss))
    of = replace(of, amplitude=of.amplitude * 10.0 ** (-of.absorption / 40.0))
    hears = hearing(of, SONAR, ARRAY, lambda f: 1e-06 * f)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    assert np.abs(got - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("method", METHODS)
def test_a_huge_blur_is_silence_and_nothing_is_outside(method: DirectSum | GriddedSynthesis) -> None:
    got = method.signals(shaped(FEW, 1.0, [1e300, 1.0, 0.1], 0.05), SNAPS, Reception(ARRAY, SONAR, None, 0.0, 4000))
    assert not got.pressure.any()
    assert got.outside == 0


def test_a_low_pass_hears_what_a_wide_range_of_blurs_leaves() -> None:
    sonar = Sonar(filter=LowPass(cutoff=60e3), sampling_frequency=196e3)
    of = arrivals(0.05 + 1e-4 * np.arange(12), [[1.0, 0.1, 0.1]] * 12, [20.0] * 12, [1.0] * 12)
    of = shaped(of, np.arange(12.0), np.append(0.0, np.geomspace(1e-7, 1e-2, 11)), 0.0)
    exact, _ = DirectSum().pressure(of, SNAPS, Reception(ARRAY, sonar, None, 0.0, 18000))
    got = GriddedSynthesis().signals(of, SNAPS, Reception(ARRAY, sonar, None, 0.0, 18000)).pressure
    assert np.abs(got - exact).max() < 1e-4 * np.abs(exact).max()


def test_an_empty_window_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one sample"):
        GriddedSynthesis().signals(
            arrivals([0.0], [[1.0, 0, 0]], [1.0], [1.0]), SNAPS, Reception(ARRAY, SONAR, None, 0.0, 0)
        )


def test_a_snap_of_other_scales() -> None:
    """A bubble ten times slower and one ten times faster: peak, support and spectrum follow."""
    for factor in (0.1, 10.0):
        scaled = snap_pressure.Bubble(MODEL.a, MODEL.k * factor, MODEL.m / factor, MODEL.q * factor, MODEL.density)
        same = snap_pressure.Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)
        assert snap_pressure.peak(scaled)[0] == pytest.approx(snap_pressure.peak(same)[0] / factor, rel=1e-5)
        assert snap_pressure.peak(scaled)[1] == pytest.approx(snap_pressure.peak(same)[1] * factor**2, rel=1e-9)
        S = snap_pressure.spectrum(np.array([1e3, 5e4]) * factor, scaled)
        np.testing.assert_allclose(S, factor * snap_pressure.spectrum(np.array([1e3, 5e4]), same), rtol=1e-9)
