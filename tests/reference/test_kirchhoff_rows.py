"""The compiled integral over rows of frequencies, equally spaced or not, against facets one by one in plain numpy."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.scattering.kirchhoff_integral import facet_amplitude
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude, spacing
from sonarsynth.geometry import unit


@pytest.mark.parametrize("count", [1, 3, 4, 5, 40])
@pytest.mark.parametrize("first", [0.0, 1.0, 100.0])
@pytest.mark.parametrize("power", [1.0, 1.02])
def test_rows_are_as_exact_as_single_frequencies(count: int, first: float, power: float) -> None:
    """Phases across a facet from 1e-6 to 60 rad: by the series that a row shares, beyond it, and across its end."""
    rng = np.random.default_rng(count)
    k = np.linspace(first, 460.0, count) ** power
    assert np.isfinite(spacing(k)) == (count > 2 and power == 1.0)
    corners = rng.normal(size=(200, 1, 3)) * 0.5 + rng.normal(size=(200, 3, 3)) * 10.0 ** rng.uniform(
        -8, -1.5, (200, 1, 1)
    )
    a, b = unit(rng.normal(size=(2, 3)))
    slow = facet_amplitude(corners[:, None], a, b, k)
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    each = np.array([mesh_amplitude(facet[None], a, b, k) for facet in corners])
    assert (abs(each - slow) <= 1e-12 * (size[:, None] * k + 1e-300)).all()


def test_wavenumbers_of_equally_spaced_frequencies_are_seen_as_such() -> None:
    for band in (np.arange(25e3, 110.1e3, 5e3), np.linspace(25e3, 110e3, 18), np.fft.rfftfreq(4096, 1 / 400e3)):
        k = 2 * np.pi * band / 1497.3
        assert spacing(k) == pytest.approx(k[1] - k[0], rel=1e-12)
    assert np.isnan(spacing(np.array([1.0, 2.0, 3.0 + 1e-9])))
