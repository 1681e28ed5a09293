"""Polynomials through values at probes, and where probes are seen from facets that move, against plain NumPy."""

import numpy as np

from sonarsynth.equations.kernels.unit_vectors import moved, to_images, to_moved_images
from sonarsynth.geometry import rotation_matrix, unit
from sonarsynth.receiver import PlanarLattice, elements
from sonarsynth.tracing.expansion.probe_sensors import QUADRATIC_PROBES, SECOND_DEGREE, probes

PROBES = probes(elements(PlanarLattice(columns=9, rows=7, pitch=0.03)))
RNG = np.random.default_rng(8)


def test_polynomials_are_found_again_and_what_they_miss_is_the_largest_residual() -> None:
    inside = np.flatnonzero(PROBES.basis.any(axis=0))[1:]
    for count, terms in ((len(PROBES.sensor), inside), (QUADRATIC_PROBES, inside[inside < SECOND_DEGREE])):
        wanted = np.zeros((5, PROBES.basis.shape[1]))
        wanted[:, terms] = RNG.normal(size=(5, len(terms)))
        values = wanted @ PROBES.basis[:count].T
        found, missed = PROBES.expand(values)
        np.testing.assert_allclose(found, wanted, atol=1e-10)
        assert missed.max() < 1e-12
        rough = values + RNG.normal(size=values.shape)
        found, missed = PROBES.expand(rough)
        np.testing.assert_allclose(missed, np.abs(rough - found @ PROBES.basis[:count].T).max(axis=1), rtol=1e-12)


def test_a_probe_without_a_ray_is_left_out_and_said_to_be_missed() -> None:
    inside = np.flatnonzero(PROBES.basis.any(axis=0))[1:]
    wanted = np.zeros((2, PROBES.basis.shape[1]))
    wanted[:, inside] = RNG.normal(size=(2, len(inside)))
    values = wanted @ PROBES.basis.T
    values[1, 3] = np.nan
    found, missed = PROBES.expand(values)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert missed[0] < 1e-12
    assert np.isinf(missed[1])


def test_images_of_probes_are_seen_from_where_a_facet_has_moved_to() -> None:
    """To first order in what its body has turned by, which is small."""
    length, departure = RNG.uniform(5.0, 30.0, 6), unit(RNG.normal(size=(6, 3)))
    mirrored, offset = np.arange(6) % 2 == 1, RNG.normal(0.0, 0.3, (4, 3))
    apart, turn = RNG.normal(0.0, 0.1, (6, 3)), RNG.normal(0.0, 1e-3, (6, 3))
    axes = rotation_matrix(unit(RNG.normal(size=4)))
    image = np.where(mirrored[:, None, None], offset * [1.0, 1.0, -1.0], offset)
    towards = (length[:, None] * departure)[:, None] + image + apart[:, None]
    expected = unit(towards - np.cross(turn[:, None], towards)) @ axes
    ray = length, departure, mirrored, offset
    np.testing.assert_allclose(to_moved_images(*ray, apart, turn, axes), expected, atol=1e-14)
    still = np.zeros((6, 3))
    np.testing.assert_allclose(to_moved_images(*ray, still, still, np.eye(3)), to_images(*ray), atol=1e-15)
    centre = departure[:, None].copy()
    at_centre = to_moved_images(length, departure, mirrored, np.zeros((1, 3)), apart, turn, axes)
    np.testing.assert_allclose(moved(length, centre, apart, turn, axes), at_centre, atol=1e-14)
