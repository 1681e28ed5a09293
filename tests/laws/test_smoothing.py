"""Curves through the corners of a mesh: exact on spheres, closed, with creases kept, flat where the body is flat."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sonarsynth.geometry.surfaces import longest_edge, sides, volume
from sonarsynth.targets.generated.generation import generate, sphere
from sonarsynth.targets.generated.myring import hull_length
from sonarsynth.targets.generated.remus import HULL
from sonarsynth.targets.generated.smoothing import corner_normals, curved
from sonarsynth.targets.shapes import Box, LShape, Remus100
from tests.hulls import hull_radius

CREASE = np.radians(40.0)


def prism(corners: int, radius: float, length: float, slant: np.ndarray | None = None):
    """A drum of flat sides along z; slant (corner,) says by which diagonal each side is halved."""
    angle = 2 * np.pi * np.arange(corners) / corners
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(corners)], axis=1)
    up = np.array([0.0, 0.0, 0.5 * length])
    vertices = np.concatenate([ring - up, ring + up, [-up, up]])
    i, j = np.arange(corners), (np.arange(corners) + 1) % corners
    slant = np.zeros(corners, bool) if slant is None else slant
    last = np.where(slant, i + corners, j + corners)
    first = np.where(slant, j, i)
    sides_ = [np.stack([i, j, last], 1), np.stack([first, j + corners, i + corners], 1)]
    ends = [np.stack([j, i, i * 0 + 2 * corners], 1), np.stack([i + corners, j + corners, i * 0 + 2 * corners + 1], 1)]
    return vertices, np.concatenate([*sides_, *ends])


def hull_of(points: np.ndarray):
    """The convex hull, outward."""
    faces = ConvexHull(points).simplices.astype(np.int64)
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("fi,fi->f", normal, corners.mean(axis=1)) < 0
    return points, np.where(inward[:, None], faces[:, ::-1], faces)


def closed(surface) -> bool:
    return bool(np.all(np.bincount(sides(surface[1])[1].ravel()) == 2))


@pytest.mark.parametrize("edge", [0.1, 0.03, 0.01])
def test_a_geodesic_sphere_becomes_round(edge: float) -> None:
    """80 facets of 0.16 m on a radius of 0.25 m, 10 mm inside it in their middles."""
    rough = sphere(0.25, 0.165)
    assert len(rough[1]) == 80
    smooth = curved(rough, edge, np.inf, CREASE)
    assert longest_edge(smooth) <= edge
    assert closed(smooth)
    np.testing.assert_allclose(np.linalg.norm(smooth[0], axis=1), 0.25, rtol=1e-12)


def test_normals_are_exact_on_a_sphere_of_uneven_facets() -> None:
    points = sphere(1.0, 0.4)[0]
    points = points + np.random.default_rng(3).uniform(-0.08, 0.08, points.shape)
    vertices, faces = hull_of(points / np.linalg.norm(points, axis=1)[:, None])
    length = np.linalg.norm(vertices[faces] - np.roll(vertices[faces], 1, axis=1), axis=2)
    assert length.max() > 2.0 * length.min()
    corner = vertices[faces]
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.abs(flat / np.linalg.norm(flat, axis=1)[:, None] - corner[:, 0]).max() > 0.1
    np.testing.assert_allclose(corner_normals((vertices, faces), CREASE), corner, atol=2e-4)


@pytest.mark.parametrize("turns", [12, 24, 48])
def test_the_side_of_a_drum_becomes_round_and_its_rims_stay_sharp(turns: int) -> None:
    """The middle of a slanted edge is off the cylinder by the fourth power of its turn, the rims by nothing."""
    slant = np.random.default_rng(1).random(turns) < 0.5
    rough = prism(turns, 0.1, 1.0, slant)
    smooth = curved(rough, 0.02, np.inf, CREASE)
    vertices = smooth[0]
    assert closed(smooth)
    radius, z = np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]
    end = np.abs(np.abs(z) - 0.5) < 1e-12
    assert np.abs(z).max() <= 0.5 + 1e-12
    sagitta = 0.1 * (1 - np.cos(np.pi / turns))
    assert np.abs(radius[~end] - 0.1).max() < 0.3 * (np.pi / turns) * sagitta
    rim = end & (radius > 0.1 - 0.5 * sagitta)
    np.testing.assert_allclose(radius[rim], 0.1, rtol=1e-10)
    assert rim.sum() >= 2 * np.ceil(2 * np.pi * 0.1 / 0.02)
    assert radius[end].max() <= 0.1 + 1e-12


@pytest.mark.parametrize("shape", [Box(size=(1.0, 2.0, 3.0)), LShape(height=1, length=0.7, width=0.5, thickness=0.1)])
def test_a_body_of_creases_stays_as_it_is(shape: Box | LShape) -> None:
    rough = generate(shape)[0]
    smooth = curved(rough, 0.2, 1e-6, CREASE)
    assert closed(smooth)
    assert volume(smooth) == pytest.approx(volume(rough), rel=1e-12)
    np.testing.assert_allclose(smooth[0].max(axis=0), rough[0].max(axis=0), atol=1e-12)


def test_a_coarse_hull_comes_nearer_to_the_true_one() -> None:
    """238 facets, 1.4 mm inside the hull on average; twelve corners round the girth, 0.65 m of straight middle."""
    rough = generate(Remus100(coarse=True, fins=False))[0]
    smooth = curved(rough, 0.02, np.inf, CREASE)
    half = 0.5 * hull_length(HULL)

    def off(vertices: np.ndarray) -> np.ndarray:
        inside = np.abs(vertices[:, 0]) < half - 1e-6
        x, y, z = vertices[inside].T
        return np.hypot(y, z) - hull_radius(HULL, half - x)

    corners = rough[0][rough[1]]
    middles = np.concatenate([corners.mean(axis=1), 0.5 * (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3)])
    assert np.sqrt(np.mean(off(middles) ** 2)) > 1.5e-3
    assert np.sqrt(np.mean(off(smooth[0]) ** 2)) < 0.25e-3
    assert closed(smooth)


def test_flat_faces_between_rounded_edges_stay_flat() -> None:
    """A cube of 1 m with edges of radius 5 cm in four facets a quarter turn: its faces bulge by less than 0.1 mm."""
    a, r, turn = 0.5, 0.05, np.linspace(0, 0.5 * np.pi, 5)
    p, q = (x.ravel() for x in np.meshgrid(turn, turn, indexing="ij"))
    corner = a - r + r * np.stack([np.cos(p) * np.cos(q), np.cos(p) * np.sin(q), np.sin(p)], axis=1)
    signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.unique(np.round((signs[:, None] * corner).reshape(-1, 3), 12), axis=0)
    smooth = curved(hull_of(points), 0.06, np.inf, CREASE)
    assert np.abs(smooth[0]).max() < a + 1e-4
    assert closed(smooth)


def test_only_edges_off_their_curve_are_cut() -> None:
    rough = prism(24, 0.1, 1.0)
    vertices, faces = curved(rough, np.inf, 1e-5, CREASE)
    assert 4 * len(rough[1]) < len(faces) < 200 * len(rough[1])
    inside = (np.abs(vertices[:, 2]) < 0.5 - 1e-9) & (np.hypot(vertices[:, 0], vertices[:, 1]) < 0.09)
    assert not inside.any()  # the flat ends keep their one middle
    again = curved(rough, np.inf, 1e-5, CREASE)
    np.testing.assert_array_equal(again[0], vertices)
    np.testing.assert_array_equal(again[1], faces)


def test_open_and_branching_surfaces_are_cut_without_gaps() -> None:
    """A strip of a cylinder without ends; three leaves on one edge."""
    vertices, faces = prism(24, 0.1, 1.0)
    strip = vertices, faces[:20]
    _, of_facet = sides(curved(strip, 0.05, np.inf, CREASE)[1])
    assert set(np.bincount(of_facet.ravel())) == {1, 2}
    leaves = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0.0]])
    fine = curved((leaves, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])), 0.3, np.inf, CREASE)
    assert np.isfinite(fine[0]).all()
    assert 3 in np.bincount(sides(fine[1])[1].ravel())
    on_edge = np.hypot(fine[0][:, 0], fine[0][:, 1]) < 1e-12
    assert on_edge.sum() == 5
