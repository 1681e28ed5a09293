"""Bistatic range against worked check values, mpmath and differences (Willis 2005; one sound speed)."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from sonarsynth.equations.arrays.bistatic_range import bistatic_range, excess_path, path_by_beam
from sonarsynth.geometry import unit


def test_the_worked_example():
    source, beam = np.array([3.0, -8.0, 15.0]), np.array([0.0, 0.0, 1.0])
    b = np.linalg.norm(source)
    assert b == pytest.approx(17.26267650163, abs=1e-11)
    x = excess_path(beam, 20.0, source)
    assert x + b == pytest.approx(29.89949493661, abs=1e-11)
    assert np.degrees(np.arccos(beam @ source / b)) == pytest.approx(29.665849859, abs=1e-9)
    found = bistatic_range(x, beam, source)
    assert found.range == pytest.approx(20.0, rel=1e-14)
    assert found.by_path == pytest.approx(0.664418155, abs=1e-9)
    assert found.by_angle == pytest.approx(-11.46885016, abs=1e-8)


def exact_range(excess, beam, source):
    """The textbook form with 60 digits."""
    with mpmath.workdps(60):
        u, s = ([mpmath.mpf(float(v)) for v in vector] for vector in (beam, source))
        length = mpmath.sqrt(mpmath.fsum(v * v for v in u))
        b = mpmath.sqrt(mpmath.fsum(v * v for v in s))
        along = mpmath.fsum(p * q for p, q in zip(u, s, strict=True)) / length  # b cos psi
        total = mpmath.mpf(float(excess)) + b
        return (total**2 - b**2) / (2 * (total - along))


def test_no_digit_is_lost_where_the_textbook_form_loses_half():
    source, x = np.array([20.0, 0.0, 0.0]), 2.5e-10
    off = 1e-4 / 10  # 0.1 mm beside the middle of a 20 m baseline
    beam = np.array([np.cos(off), np.sin(off), 0.0])
    exact = exact_range(x, beam, source)
    ours = bistatic_range(x, beam, source).range
    total = x + 20.0
    printed = (total**2 - 400.0) / (2 * (total - 20.0 * np.cos(off)))
    assert abs(float(ours / exact - 1)) < 1e-11  # the rest is the rounding of the unit vector itself
    assert abs(float(printed / exact - 1)) > 1e-7


def random_geometry(count, seed=1, nearest=-1, farthest=3):
    random = np.random.default_rng(seed)
    beam = unit(random.standard_normal((count, 3)))
    source = unit(random.standard_normal((count, 3))) * 10 ** random.uniform(nearest, farthest, (count, 1))
    return beam, 10 ** random.uniform(nearest, farthest, count), source


@pytest.mark.parametrize(("nearest", "farthest"), [(-1, 3), (-3, 4)])
def test_random_targets_are_found_again(nearest, farthest):
    beam, r, source = random_geometry(20_000, nearest=nearest, farthest=farthest)
    x = np.linalg.norm(r[:, None] * beam - source, axis=1) + r - np.linalg.norm(source, axis=1)
    found = bistatic_range(x, beam, source)
    sane = ~found.ill_conditioned
    size = np.maximum(r, np.linalg.norm(source, axis=1))
    assert sane.mean() > 0.9
    assert np.max(np.abs(found.range - r)[sane] / size[sane]) < 2e-13
    assert np.allclose(excess_path(beam, r, source), x, rtol=1e-9, atol=1e-12 * size.max())
    assert (excess_path(beam, r, source) >= -1e-12 * size).all()
    assert ((found.by_path >= 0.5 - 1e-9) & (found.by_path <= 10.0 + 1e-9))[sane].all()


@pytest.mark.parametrize("seed", range(3))
def test_sensitivities_are_derivatives(seed):
    beam, r, source = random_geometry(200, seed)
    keep = np.abs(np.sum(beam * unit(source), axis=1)) < 0.9
    beam, r, source = beam[keep], r[keep], source[keep]
    b = np.linalg.norm(source, axis=1)
    s = source / b[:, None]
    x = excess_path(beam, r, source)
    found = bistatic_range(x, beam, source)
    h = 1e-6

    def slope(change):
        return (change(h) - change(-h)) / (2 * h)

    away = unit(np.sum(s * beam, axis=1)[:, None] * beam - s)  # turning this way increases psi
    by_path = slope(lambda e: bistatic_range(x * (1 + e), beam, source).range) / x
    by_angle = slope(lambda e: bistatic_range(x, np.cos(e) * beam + np.sin(e) * away, source).range)
    assert np.allclose(found.by_path, by_path, rtol=1e-6)
    assert np.allclose(found.by_angle, by_angle, rtol=1e-5, atol=1e-6 * b.max())
    turned = slope(lambda e: excess_path(np.cos(e) * beam + np.sin(e) * away, r, source))
    assert np.allclose(np.sum(path_by_beam(beam, r, source) * away, axis=1), turned, rtol=1e-5, atol=1e-6 * b.max())
    for axis in np.eye(3):
        by_axis = slope(lambda e, axis=axis: bistatic_range(x, beam, source + e * b[:, None] * axis).range) / b
        assert np.allclose(found.by_source @ axis, by_axis, rtol=1e-5, atol=1e-5)
    target = r[:, None] * beam
    cosine = np.sum(unit(-target) * unit(source - target), axis=1)
    assert np.allclose(found.one_plus_cos, 1 + cosine, rtol=1e-9)
