"""Any lattice, mask, beam grid and band: the fast kernel is the direct sum."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.arrays.gates import gate_samples, gate_taper
from sonarsynth.receiver import BeamGrid, PlanarLattice, elements
from tests.axial import axial_energies
from tests.dense import dense_energies


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
def test_kernel_is_the_direct_sum(array, azimuths, elevations, bins, focus, speed, seed):
    parts, grid = elements(array), BeamGrid(azimuths=azimuths, elevations=elevations)
    random = np.random.default_rng(seed)
    spectra = (random.normal(size=(parts.count, bins)) + 1j * random.normal(size=(parts.count, bins))).astype(
        np.complex64
    )
    frequencies = 20e3 + 300.0 * np.arange(bins)
    fast = axial_energies(spectra, parts, parts.gain, frequencies, grid, speed, focus)
    beams = direction(grid.azimuth, grid.elevation[:, None]).reshape(-1, 3)
    on_axis = focus_delay(parts.position, np.array([1.0, 0.0, 0.0]), focus, speed)
    delay = on_axis + focus_delay(parts.position, beams, None, speed)
    exact = dense_energies(spectra, delay, parts.gain, frequencies).reshape(fast.shape)
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
