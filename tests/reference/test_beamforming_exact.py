"""The fast kernels against slow, exact computations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf, sqrt

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.arrays.beams import beam_spectra
from sonarsynth.equations.arrays.gates import (
    fast_length,
    frequency_spacing,
    gate_of,
    gate_samples,
    gate_taper,
    gated_energy,
)
from sonarsynth.imaging.delay_and_sum.lattice_beams import LatticeBeams
from sonarsynth.products import Snapshots
from sonarsynth.receiver import BeamGrid, PlanarLattice, Romanis, elements
from tests.lattice import lattice_energies, stated_energies

SPEED = 1540.0


def random_spectra(sensors, bins, seed=0):
    random = np.random.default_rng(seed)
    return (random.normal(size=(sensors, bins)) + 1j * random.normal(size=(sensors, bins))).astype(np.complex64)


def energies(array, grid, spectra, focus, low=25e3, spacing=250.0, weight=None, speed=SPEED):
    """Energies (elevation, azimuth) from the kernel and from the delays that it states, summed in float64."""
    parts = elements(array)
    weight = parts.gain if weight is None else weight
    frequencies = low + spacing * np.arange(spectra.shape[1])
    fast = lattice_energies(spectra, parts, weight, frequencies, grid, speed, focus)
    return fast, stated_energies(spectra, parts, weight, frequencies, grid, speed, focus)


def both(array, grid, bins, focus, **more):
    """The same, of any spectra."""
    return energies(array, grid, random_spectra(elements(array).count, bins), focus, **more)


NINE = BeamGrid(azimuths=9, elevations=9)
WIDE = BeamGrid(azimuth_span=3.14, azimuths=9, elevation_span=3.14, elevations=8)
MASK = ("#..##.#", ".##.#..", "##.....", "...####", "#.#.#.#")
KERNELS = {
    "the 508 elements": (Romanis(dead=(0, 77, 507)), BeamGrid(azimuths=11, elevations=10), 241, 20.0, 1e-6),
    "beams almost along the array": (Romanis(), WIDE, 20, None, 1e-6),
    # 150 terms of the recurrence each way, phases at and near whole half turns included
    "a long row": (PlanarLattice(columns=300, rows=1, pitch=0.01), NINE, 20, None, 2e-5),
    "a long column": (PlanarLattice(columns=1, rows=301, pitch=0.01), NINE, 20, None, 2e-5),
    "a pitch of many wavelengths": (PlanarLattice(columns=6, rows=5, pitch=0.5), NINE, 20, None, 2e-6),
}


@pytest.mark.parametrize(("array", "grid", "bins", "focus", "allowed"), KERNELS.values(), ids=KERNELS)
def test_kernel_equals_direct_sums(array, grid, bins, focus, allowed):
    fast, exact = both(array, grid, bins, focus)
    np.testing.assert_allclose(fast, exact, atol=allowed * exact.max())


def test_kernel_takes_masks_without_symmetry_dead_elements_and_weights():
    array = PlanarLattice(columns=7, rows=5, pitch=0.03, mask=MASK, dead=(3,))
    weight = elements(array).gain * np.random.default_rng(3).uniform(0.2, 1.0, elements(array).count)
    fast, exact = both(array, BeamGrid(azimuths=8, elevations=5), 50, 2.0, weight=weight)
    np.testing.assert_allclose(fast, exact, atol=1e-6 * exact.max())


def test_a_band_far_above_its_bins():
    """Phases are reduced in float64: 1 GHz loses no more than 25 kHz does."""
    fast, exact = both(PlanarLattice(columns=5, rows=4, pitch=0.02), NINE, 20, None, low=1e9)
    np.testing.assert_allclose(fast, exact, atol=1e-6 * exact.max())


def test_same_bits_whoever_asks():
    """Bins are summed in fixed chunks: a run is repeated exactly, and zeros after the band change nothing."""
    array, grid = elements(Romanis()), BeamGrid(azimuths=6, elevations=5)
    spectra = random_spectra(508, 100)
    frequencies = 25e3 + 250.0 * np.arange(100)
    first, again = (lattice_energies(spectra, array, array.gain, frequencies, grid, SPEED, 20.0) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    part = lattice_energies(spectra[:, :64], array, array.gain, frequencies[:64], grid, SPEED, 20.0)
    rest = lattice_energies(spectra[:, 64:], array, array.gain, frequencies[64:], grid, SPEED, 20.0)
    np.testing.assert_array_equal(part + rest, first)


@pytest.mark.parametrize(("radius", "loss"), [(50.0, 0.02), (20.0, 0.16), (10.0, 0.62), (5.0, 2.23)])
def test_loss_of_the_focus_of_the_axis_in_the_corner(radius, loss):
    """Flat spectrum from 25 to 85 kHz, source at (25, 25) deg at the focus: dB lost in its own beam."""
    array, corner, frequencies = elements(Romanis()), direction(*np.deg2rad([25.0, 25.0])), 25e3 + 1e3 * np.arange(61)
    arrival = focus_delay(array.position, corner, radius, SPEED)
    spectra = np.exp(-2j * np.pi * frequencies * arrival[:, None]).astype(np.complex64)
    beam = LatticeBeams(lambda: spectra, frequencies, array, array.gain / 508, SPEED, radius)(corner[None])
    assert -10 * np.log10(np.sum(np.abs(beam) ** 2) / 61) == pytest.approx(loss, abs=0.02)


def test_beam_spectra_equal_direct_sums_for_any_array():
    random = np.random.default_rng(5)
    position = random.uniform(-0.6, 0.6, (40, 3))
    gain = random.uniform(0.0, 1.0, 40)
    gain[[3, 9]] = 0.0
    u = direction(random.uniform(-1, 1, 9), random.uniform(-1, 1, 9))
    for bins in (1, 16, 100):
        spectra = random_spectra(40, bins)
        spectra[3] = np.nan  # dead: not listened to
        frequencies = 25e3 + 250.0 * np.arange(bins)
        live = np.flatnonzero(gain)
        for focus in (None, 4.0):
            delay = focus_delay(position, u, focus, SPEED)
            exact = np.einsum(
                "q,qf,bqf->bf",
                gain[live] / gain.sum(),
                spectra[live],
                np.exp(2j * np.pi * frequencies * delay[:, live, None]),
            )
            beams = beam_spectra(spectra, frequencies, position, gain, u, SPEED, focus)
            assert beams.shape == (9, bins)
            np.testing.assert_allclose(beams, exact, atol=2e-6 * np.abs(exact).max())


@pytest.mark.parametrize("focus", [0.7, 20.0, 1e7])
def test_focus_delay_to_the_last_digits(focus):
    """sqrt(R^2 - 2 R u.q + q^2) - R in 50 digits, from the near field to 10 000 km."""
    mp.dps = 50
    q, u = np.array([0.1, -0.55, 0.31]), direction(0.3, -0.2)
    along = sum(mpf(float(a)) * mpf(float(b)) for a, b in zip(q, u, strict=True))
    square = sum(mpf(float(a)) ** 2 for a in q)
    exact = (sqrt(mpf(focus) ** 2 - 2 * mpf(focus) * along + square) - mpf(focus)) / mpf(SPEED)
    assert focus_delay(q[None], u, focus, SPEED)[0] == pytest.approx(float(exact), rel=4e-16 * 10)


def test_spectra_are_those_of_numpy_and_obey_parseval():
    random = np.random.default_rng(1)
    pressure = random.normal(size=(3, 1300)).astype(np.float32)
    rate, first, count = 196e3, 57, 1131
    gate = gate_of(pressure, rate, first, count, (1e-3, rate))
    frequencies, spectra = gate.frequency, gate(gate.bins)
    cut = pressure[:, first : first + count] * gate_taper(count, rate)
    length = fast_length(count)
    every = np.fft.rfft(cut.astype(float), length, axis=1)
    inside = slice(1, (length + 1) // 2)
    np.testing.assert_allclose(spectra, every[:, inside], atol=1e-6 * np.abs(every).max())
    np.testing.assert_allclose(frequencies, np.fft.rfftfreq(length, 1 / rate)[inside], rtol=1e-14)
    for some, begin in ((gate.bins[1::2], 0), (gate.bins[2::3], 40), (gate.bins[6::12], 700.25)):
        turned = every[:, some] * np.exp(2j * np.pi * np.array(some) * begin / length)
        np.testing.assert_allclose(gate(some, begin), turned, atol=1e-6 * np.abs(every).max())
    # All of the energy but the mean's (and that at half the sampling frequency, where there is such a bin).
    lost = np.abs(every[:, 0]) ** 2 + (np.abs(every[:, -1]) ** 2 if length % 2 == 0 else 0.0)
    expected = (np.sum(cut.astype(float) ** 2, axis=1) - lost / length) / rate
    energy = 2 * frequency_spacing(count, rate) / rate**2 * np.sum(np.abs(spectra.astype(complex)) ** 2, axis=-1)
    np.testing.assert_allclose(energy, expected, rtol=1e-5)


@pytest.mark.parametrize("count", [731, 900])
@pytest.mark.parametrize(("begin", "stop"), [(60, 90), (300, 301), (0, 900), (50, 58), (0, 57), (420, 420)])
def test_energy_of_short_sounds_is_that_of_their_spectra(count, begin, stop):
    """In the middle of a gate, where it begins, all over it and out of it; of lengths odd and even."""
    pressure = np.zeros((3, 1000), np.float32)
    pressure[:, begin:stop] = np.random.default_rng(1).normal(size=(3, stop - begin))
    gate = pressure, 196e3, 57, count, (25e3, 85e3)
    made = gate_of(*gate)
    spectra = made(made.bins)
    assert gated_energy(*gate) == pytest.approx(np.sum(np.abs(spectra.astype(complex)) ** 2), rel=1e-6)


def test_band_edges_belong_to_the_band():
    pressure = np.ones((1, 960), np.float32)
    gate = gate_of(pressure, 200e3, 0, 960, (25e3, 85e3))
    assert gate.frequency[0] == pytest.approx(25e3)
    assert gate.frequency[-1] == pytest.approx(85e3)
    assert gate(gate.bins).shape == (1, 289)


@st.composite
def lattices(draw):
    columns, rows = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    cells = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
    cells[draw(st.integers(0, rows * columns - 1))] = True
    mask = tuple("".join("#" if c else "." for c in cells[r * columns : (r + 1) * columns]) for r in range(rows))
    return PlanarLattice(columns=columns, rows=rows, pitch=draw(st.floats(0.005, 0.1)), mask=mask)


@settings(max_examples=60, deadline=None)
@given(
    array=lattices(),
    azimuths=st.integers(1, 6),
    elevations=st.integers(1, 6),
    bins=st.integers(1, 70),
    focus=st.none() | st.floats(1.0, 1e6),
    speed=st.floats(1300.0, 1700.0),
    seed=st.integers(0, 99),
)
def test_kernel_is_the_direct_sum_of_any_lattice(array, azimuths, elevations, bins, focus, speed, seed):
    grid = BeamGrid(azimuths=azimuths, elevations=elevations)
    spectra = random_spectra(elements(array).count, bins, seed)
    fast, exact = energies(array, grid, spectra, focus, low=20e3, spacing=300.0, speed=speed)
    np.testing.assert_allclose(fast, exact, atol=3e-6 * np.sum(np.abs(spectra) ** 2))


@given(
    start=st.floats(-1.0, 1.0),
    length=st.floats(1e-3, 0.1),
    origin=st.floats(-2.0, -1.5),
    rate=st.floats(1e4, 1e6),
)
def test_a_gate_takes_the_samples_inside_it(start, length, origin, rate):
    first, count = gate_samples(start, start + length, origin, rate, 10**9)
    assert origin + first / rate >= start - 1e-5 / rate
    assert origin + first / rate < start + 1.001 / rate
    assert count <= length * rate + 1e-3
    assert count > length * rate - 1.001
    again = gate_samples(start + 0.37 / rate, start + 0.37 / rate + length, origin, rate, 10**9)
    assert abs(again[1] - count) <= (abs(length * rate - round(length * rate)) < 1e-3)  # the same, but for rounding


@given(count=st.integers(1, 3000), rate=st.floats(1e3, 1e6))
def test_a_taper_is_symmetric_and_flat_in_the_middle(count, rate):
    weights = gate_taper(count, rate)
    assert len(weights) == count
    np.testing.assert_array_equal(weights, weights[::-1])
    assert weights[count // 2] == 1.0
    assert (weights > 0).all()
    assert np.sum(weights < 1.0) <= min(2e-4 * rate + 2, count)


@pytest.mark.parametrize("samples", [731, 1131])
@pytest.mark.parametrize(("step", "first", "begin"), [(2, 1, 0.0), (3, 0, 40.0), (4, 3, 17.25), (7, 2, 5.0)])
def test_every_so_manieth_bin_is_one_of_all(samples, step, first, begin):
    """Of windows whose length is a multiple of the step, as of others."""
    pressure = np.random.default_rng(2).normal(size=(3, samples)).astype(np.float32)
    gate = gate_of(pressure, 196e3, 0, samples, (25e3, 85e3))
    window = Snapshots(
        gate.frequency, frequency_spacing(samples, 196e3), gate.bins, gate, 0.0, samples, 196e3, gate.power
    )
    part = window.every(step, first, begin)
    turn = np.exp(2j * np.pi * part.frequency * begin / 196e3)
    np.testing.assert_array_equal(part.frequency, gate.frequency[first::step])
    expected = gate(gate.bins)[:, first::step] * turn
    np.testing.assert_allclose(part.spectra, expected, atol=3e-6 * np.abs(expected).max())
    assert part.start == pytest.approx(begin / 196e3)
