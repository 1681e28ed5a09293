"""Polynomials through values at probes, and where probes are seen from facets that move, against plain NumPy."""

import numpy as np
import pytest

from sonarsynth.equations.kernels.row_products import put_cubics
from sonarsynth.equations.kernels.unit_vectors import moved, to_images, to_moved_images
from sonarsynth.geometry import rotation_matrix, unit
from sonarsynth.products import ArrayExpansion
from sonarsynth.products.array_expansion import aperture_terms
from sonarsynth.receiver import PlanarLattice, PositionTable, elements
from sonarsynth.tracing.expansion.probe_sensors import probes

PROBES = probes(elements(PlanarLattice(columns=9, rows=7, pitch=0.03)))
RNG = np.random.default_rng(8)


def test_polynomials_are_found_again_and_what_they_miss_is_the_largest_residual() -> None:
    wanted = np.concatenate([np.zeros((5, 1)), RNG.normal(size=(5, 9))], axis=1)  # of y and z, to the third degree
    values = wanted @ PROBES.basis.T
    found, missed = PROBES.expand(values)
    np.testing.assert_allclose(found, wanted, atol=1e-10)
    assert missed.max() < 1e-12
    rough = values + RNG.normal(size=values.shape)
    found, missed = PROBES.expand(rough)
    np.testing.assert_allclose(missed, np.abs(rough - found @ PROBES.basis.T).max(axis=1), rtol=1e-12)


@pytest.mark.parametrize("axes", [(1.0, 0.0, 0.0), (0.0, 1.0, 1.0), (1.0, 1.0, 1.0)], ids=["line", "plane", "box"])
def test_terms_are_those_that_some_hydrophone_has(axes: tuple[float, float, float]) -> None:
    array = elements(PositionTable(positions=(RNG.normal(0.0, 0.1, (60, 3)) * axes).tolist()))
    every = aperture_terms(array.position, array.aperture)
    assert probes(array).monomials == tuple(np.flatnonzero(every.any(axis=0)).tolist())


def test_terms_that_no_hydrophone_has_change_nothing_when_they_are_left_out() -> None:
    kept, points = list(PROBES.monomials), RNG.normal(0.0, 0.1, (7, 3)) * [0.0, 1.0, 1.0]
    terms = np.zeros((4, 20))
    terms[:, kept] = RNG.normal(size=(4, len(kept)))
    every = ArrayExpansion.none(4, PROBES.aperture).but(delay=terms, amplitude=terms)
    few = ArrayExpansion.none(4, PROBES.aperture, PROBES.monomials).but(delay=terms[:, kept], amplitude=terms[:, kept])
    for name in ("over", "largest"):
        own, others = (getattr(of, name)("delay", *([points] if name == "over" else [])) for of in (few, every))
        np.testing.assert_allclose(own, others, rtol=1e-12)
    np.testing.assert_allclose(few.mean_square(points), every.mean_square(points), rtol=1e-12)
    np.testing.assert_allclose(few.amplitude_degrees, every.amplitude_degrees, rtol=1e-12)
    bent, slope = few.first(2), few.gradient(points, "delay")
    assert kept[bent:] == [n for n in kept if n >= every.first(2)]
    np.testing.assert_allclose(slope @ few.delay.T, every.gradient(points, "delay") @ every.delay.T, atol=1e-9)


def test_paths_of_different_degrees_keep_what_they_have_when_they_are_joined() -> None:
    """None, squares and cubes: the terms that some lack are 0 of those, and not of the others."""
    nothing = ArrayExpansion.none(2, PROBES.aperture, PROBES.monomials)
    degrees = [ArrayExpansion.none(2), *(nothing.but(amplitude=RNG.normal(size=(2, terms))) for terms in (6, 10))]
    for parts in (degrees, degrees[::-1]):
        own = np.concatenate([part.over("amplitude", PROBES.position) for part in parts])
        np.testing.assert_allclose(ArrayExpansion.join(parts).over("amplitude", PROBES.position), own, atol=1e-14)


def test_a_probe_without_a_ray_is_left_out_and_said_to_be_missed() -> None:
    wanted = np.concatenate([np.zeros((2, 1)), RNG.normal(size=(2, PROBES.basis.shape[1] - 1))], axis=1)
    values = wanted @ PROBES.basis.T
    values[1, 3] = np.nan
    found, missed = PROBES.expand(values)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert missed[0] < 1e-12
    assert np.isinf(missed[1])


def test_cubics_are_written_to_their_rows_alone() -> None:
    point, middle, half = RNG.normal(size=(7, 3)), RNG.normal(size=3), np.array([0.5, 1.0, 2.0])
    coefficients, rows, out = RNG.normal(size=(20, 6)), np.array([1, 4, 6]), np.full((7, 6), np.nan)
    put_cubics(rows, point, middle, half, coefficients, out)
    wanted = aperture_terms((point[rows] - middle) / half, 1.0) @ coefficients
    np.testing.assert_allclose(out[rows], wanted, rtol=1e-12, atol=1e-12)
    assert np.isnan(np.delete(out, rows, axis=0)).all()


def test_images_of_probes_are_seen_from_where_a_facet_has_moved_to() -> None:
    """To first order in what its body has turned by, which is small."""
    length, departure = RNG.uniform(5.0, 30.0, 6), unit(RNG.normal(size=(6, 3)))
    mirrored, offset = np.arange(6) % 2 == 1, RNG.normal(0.0, 0.3, (4, 3))
    apart, late, spin = RNG.normal(0.0, 0.1, (6, 3)), RNG.normal(0.0, 1e-2, 6), RNG.normal(0.0, 0.1, (6, 3))
    axes = rotation_matrix(unit(RNG.normal(size=4)))
    image = np.where(mirrored[:, None, None], offset * [1.0, 1.0, -1.0], offset)
    towards = (length[:, None] * departure)[:, None] + image + apart[:, None]
    expected = unit(towards - np.cross((late[:, None] * spin)[:, None], towards)) @ axes
    ray, ends, every = (length, departure), (mirrored.astype(int), offset), (np.arange(6), np.arange(6))
    np.testing.assert_allclose(to_moved_images(*ray, *ends, *every, apart, late, spin, axes), expected, atol=1e-14)
    some = np.array([4, 1]), np.array([5, 0, 3, 3, 2])
    of_some = to_moved_images(*ray, *ends, *some, *(of[:5] for of in (apart, late, spin)), axes)
    legs = some[1][some[0]]
    alone = length[legs], departure[legs], ends[0][legs], offset, np.arange(2), np.arange(2)
    np.testing.assert_array_equal(of_some, to_moved_images(*alone, *(of[some[0]] for of in (apart, late, spin)), axes))
    still = np.zeros((6, 3))
    straight = to_moved_images(*ray, *ends, *every, still, late, still, np.eye(3))
    np.testing.assert_allclose(straight, to_images(*ray, mirrored, offset), atol=1e-15)
    centre = departure[:, None].copy()
    at_centre = to_moved_images(*ray, ends[0], np.zeros((1, 3)), *every, apart, late, spin, axes)
    np.testing.assert_allclose(moved(length, centre, apart, late, spin, axes), at_centre, atol=1e-14)


def test_paths_over_different_arrays_are_not_joined() -> None:
    """Their terms belong to other polynomials."""
    line = probes(elements(PlanarLattice(columns=9, rows=1, pitch=0.03)))
    parts = [ArrayExpansion.none(1, of.aperture, of.monomials).but(delay=np.ones((1, 4))) for of in (PROBES, line)]
    with pytest.raises(ValueError, match="different arrays"):
        ArrayExpansion.join(parts)
