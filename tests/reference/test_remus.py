"""The REMUS-100 against the figures of Prestero (2001)."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from sonarsynth.geometry.surfaces import longest_edge, sides, volume
from sonarsynth.targets.generated.myring import hull_length
from sonarsynth.targets.generated.remus import FIN_FOOT, FIN_STATION, HULL, ROOT_CHORD, naca0012
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Remus100
from tests.hulls import hull_radius

BOUNDS = [0.0, 0.1745, 0.8285, hull_length(HULL)]


def over_the_hull(function):
    return sum(quad(function, a, b)[0] for a, b in itertools.pairwise(BOUNDS))


def test_the_hull_has_the_published_size():
    """Tables 2.1 and 2.7: forward length 0.828 m, length 1.33 m, areas 285 cm2, 0.226 and 0.709 m2, volume 31.5 l."""
    assert BOUNDS[2] == pytest.approx(0.828, abs=1e-3)
    assert BOUNDS[3] == pytest.approx(1.33, abs=5e-3)
    assert np.pi * 0.25 * HULL.diameter**2 == pytest.approx(2.85e-2, rel=0.006)
    assert over_the_hull(lambda s: 2 * hull_radius(HULL, s)) == pytest.approx(2.26e-1, rel=0.003)
    assert over_the_hull(lambda s: 2 * np.pi * hull_radius(HULL, s)) == pytest.approx(7.09e-1, rel=0.004)
    assert over_the_hull(lambda s: np.pi * hull_radius(HULL, s) ** 2) == pytest.approx(3.15e-2, rel=0.005)


def test_the_mesh_of_the_hull_has_the_published_volume_and_length():
    mesh = mesh_of(Remus100(fins=False))
    assert volume((mesh.vertices, mesh.faces)) == pytest.approx(3.15e-2, rel=0.005)
    np.testing.assert_allclose(mesh.box[:, 0], [-0.5 * hull_length(HULL), 0.5 * hull_length(HULL)], atol=1e-12)
    radius = np.hypot(mesh.vertices[:, 1], mesh.vertices[:, 2])
    side = np.abs(mesh.vertices[:, 0]) < 0.5 * hull_length(HULL) - 1e-9
    np.testing.assert_allclose(
        radius[side], hull_radius(HULL, 0.5 * hull_length(HULL) - mesh.vertices[side, 0]), atol=1e-12
    )


def test_the_default_mesh_is_fine_and_closed():
    mesh = mesh_of(Remus100())
    assert 6000 < len(mesh.faces) < 14000
    assert longest_edge((mesh.vertices, mesh.faces)) <= 0.014
    ends, edge = sides(mesh.faces)
    assert np.all(np.bincount(edge.ravel()) == 2)
    assert len(mesh.vertices) - len(ends) + len(mesh.faces) == 2 * 5  # a hull and four fins, each closed


def upper_fin(edge):
    """The mesh, and its facets of the upper fin: the first after the hull's."""
    mesh = mesh_of(Remus100(edge=edge))
    hull = len(mesh_of(Remus100(edge=edge, fins=False)).faces)
    number = np.arange(len(mesh.faces)) - hull
    return mesh, (number >= 0) & (number < (len(mesh.faces) - hull) // 4)


def test_the_fins_have_the_published_height_and_area():
    """Figure 2-3: 13.1 cm above the centreline; table 2.2: planform 66.5 cm2 beyond a root 8.57 cm below the tip."""
    mesh, fin = upper_fin(0.004)
    np.testing.assert_allclose(mesh.box[:, 1:], [[-0.131, -0.131], [0.131, 0.131]], atol=1e-12)
    x, y, z = mesh.centroid.T
    shadow = 0.5 * mesh.area * np.abs(mesh.normal[:, 1])
    beyond = fin & (z > 0.131 - 0.0857)
    assert shadow[beyond].sum() == pytest.approx(6.65e-3, rel=2e-3)
    assert 0.5 * hull_length(HULL) - np.average(x[beyond], weights=shadow[beyond]) == pytest.approx(1.259, abs=1e-4)
    wet = fin & (np.hypot(y, z) > hull_radius(HULL, 0.5 * hull_length(HULL) - x))
    assert shadow[wet].sum() == pytest.approx(6.65e-3, rel=0.05)


def test_the_four_fins_are_turned_copies():
    mesh = mesh_of(Remus100(edge=0.01))
    hull = len(mesh_of(Remus100(edge=0.01, fins=False)).vertices)
    up, starboard, down, port = np.split(mesh.vertices[hull:], 4)
    assert up[:, 2].min() == FIN_FOOT and up[:, 2].max() == pytest.approx(0.131)
    np.testing.assert_array_equal(starboard, up[:, [0, 2, 1]] * [1, -1, 1])
    np.testing.assert_array_equal(down, up * [1, -1, -1])
    np.testing.assert_array_equal(port, up[:, [0, 2, 1]] * [1, 1, -1])


def test_the_foot_of_a_fin_is_inside_the_hull():
    ends = FIN_STATION + 0.5 * ROOT_CHORD * np.array([-1, 1])
    assert np.hypot(FIN_FOOT, 0.06 * ROOT_CHORD) < hull_radius(HULL, ends).min()


def test_the_section_is_naca_0012():
    """Abbott and von Doenhoff (1959), ordinates of NACA 0012 in per cent of the chord."""
    x = np.array([1.25, 5, 10, 30, 50, 80, 95])
    half = np.array([1.894, 3.555, 4.683, 6.002, 5.294, 2.623, 0.807])
    np.testing.assert_allclose(100 * naca0012(x / 100), half, atol=0.13)
    np.testing.assert_allclose(100 * naca0012(x[:5] / 100), half[:5], atol=0.016)
    np.testing.assert_allclose(naca0012(np.array([0.0, 1.0])), 0.0, atol=1e-15)


def test_the_coarse_vehicle_has_the_facets_of_the_thesis():
    mesh = mesh_of(Remus100(coarse=True))
    assert len(mesh.faces) == 286
    assert len(mesh_of(Remus100(coarse=True, fins=False)).faces) == 238
    fine = mesh_of(Remus100())
    np.testing.assert_allclose(mesh.box, fine.box, atol=1e-3)
    assert volume((mesh.vertices, mesh.faces)) == pytest.approx(volume((fine.vertices, fine.faces)), rel=0.06)
