"""Meshes for coherent facets in a frame: short edges, the asked error, flat parts cut in their planes, or a note."""

import numpy as np
import pytest
import trimesh

from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.surfaces import halve_longest_edges, longest_edge, sides, split_long_edges, volume
from sonarsynth.targets import mesh_resolution
from sonarsynth.targets.generated.generation import sphere
from sonarsynth.targets.mesh_resolution import ROWS, expected_error, fine_mesh, frame_mesh, mesh_report
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Cylinder, Knots, LShape, MeshFile, Myring, Remus100, School, Sphere

WAVELENGTH = 0.05
BLUNT = Myring(nose=0.2, middle=0.0, tail=0.5, diameter=0.2, exponent=10.0, tail_angle=0.5)
CURVED = [
    Sphere(radius=0.5),
    Cylinder(radius=0.1, length=0.8),
    Cylinder(radius=0.5, length=0.01),
    Remus100(),
    BLUNT,
    Myring(nose=0.2, middle=0.0, tail=0.5, diameter=0.2, exponent=0.5, tail_angle=0.0),
]
FLAT = [
    Box(size=(1.0, 0.02, 0.3)),
    Box(size=(0.3, 0.3, 0.3), edge=0.2),
    LShape(height=1.0, length=0.7, width=0.5, thickness=0.1),
    Knots(rows=3, radius=0.05),
    School(members=5),
]


def ids(shape) -> str:
    return f"{shape.kind}-{sum(repr(shape).encode()) % 1000}"


def surface(mesh: Mesh):
    return mesh.vertices, mesh.faces.astype(np.int64)


def written(path, vertices, faces) -> str:
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return str(path)


@pytest.mark.parametrize("error", [0.1, 0.02])
@pytest.mark.parametrize("shape", CURVED, ids=ids)
def test_curved_shapes_have_short_edges_and_the_asked_error(shape, error: float) -> None:
    mesh = frame_mesh(shape, WAVELENGTH, error)
    assert longest_edge(surface(mesh)) <= ROWS * WAVELENGTH * (1 + 1e-9)
    assert expected_error(mesh, WAVELENGTH) <= 1.1 * error
    assert np.all(np.bincount(sides(surface(mesh)[1])[1].ravel()) == 2)
    assert mesh.area.min() > 0
    assert len(mesh.notes) == 1  # how far it lies inside the true surface


@pytest.mark.parametrize("shape", FLAT, ids=ids)
def test_flat_shapes_are_cut_in_their_planes(shape) -> None:
    mesh, plain = frame_mesh(shape, WAVELENGTH), mesh_of(shape)
    assert longest_edge(surface(mesh)) <= ROWS * WAVELENGTH * (1 + 1e-9)
    assert np.all(np.bincount(sides(surface(mesh)[1])[1].ravel()) == 2)
    assert volume(surface(mesh)) == pytest.approx(volume(surface(plain)), rel=1e-12)
    assert mesh.area.sum() == pytest.approx(plain.area.sum(), rel=1e-12)
    np.testing.assert_allclose(mesh.box, plain.box, atol=1e-15)
    ends = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2)
    assert len(np.unique(ends, axis=0)) == len(ends)  # neighbours are wound alike
    assert mesh.notes == () and expected_error(mesh, WAVELENGTH) == 0.0


def test_long_thin_facets_save_facets_along_a_cylinder() -> None:
    """As many round the girth as facets of equal edges would be, but longer along the axis."""
    shape, wavelength, error = Cylinder(radius=0.4, length=1.0), 0.06, 0.005
    mesh = frame_mesh(shape, wavelength, error)
    edge = longest_edge(surface(mesh))
    even = mesh_of(Cylinder(radius=0.4, length=1.0, edge=0.0125))
    assert expected_error(mesh, wavelength) < 1.2 * expected_error(even, wavelength)
    assert edge > 0.03
    assert len(mesh.faces) < 0.3 * len(even.faces)


def test_it_is_kept_and_always_the_same(tmp_path) -> None:
    path = tmp_path / "body.ply"
    shape = MeshFile(path=written(path, *sphere(0.3, 0.2)), smooth=True)
    mesh = frame_mesh(shape, WAVELENGTH)
    assert frame_mesh(MeshFile(path=str(path), smooth=True), WAVELENGTH) is mesh
    written(path, *sphere(0.4, 0.2))
    other = frame_mesh(shape, WAVELENGTH)
    assert other.radius == pytest.approx(0.4, rel=1e-6)
    assert other.digest != mesh.digest
    assert frame_mesh(Remus100(), WAVELENGTH).digest == frame_mesh(Remus100(edge=0.014), WAVELENGTH, 0.05).digest


def test_a_file_is_cut_flat_and_its_coarseness_said_or_smoothed(tmp_path) -> None:
    ball = sphere(0.3, 0.15)
    path = written(tmp_path / "ball.ply", *ball)
    flat, smooth = (frame_mesh(MeshFile(path=path, smooth=s), WAVELENGTH) for s in (False, True))
    for mesh in (flat, smooth):
        assert longest_edge(surface(mesh)) <= ROWS * WAVELENGTH
        assert np.all(np.bincount(sides(surface(mesh)[1])[1].ravel()) == 2)
    assert volume(surface(flat)) == pytest.approx(volume(ball), rel=1e-6)
    assert "too coarse for waves of 50 mm" in flat.notes[-1]
    np.testing.assert_allclose(np.linalg.norm(smooth.vertices, axis=1), 0.3, rtol=1e-6)
    assert expected_error(smooth, WAVELENGTH) < 0.055 < expected_error(flat, WAVELENGTH)
    assert smooth.notes == ()


@pytest.mark.parametrize("cut", [split_long_edges, halve_longest_edges])
def test_cutting_flat_facets_changes_no_error(cut) -> None:
    """Cut facets of one plane count as one piece, so nothing is gained by an edge of the file."""
    whole = Mesh(*as_mesh(sphere(0.3, 0.15)))
    pieces = Mesh(*as_mesh(cut(sphere(0.3, 0.15), 0.04)))
    assert len(pieces.faces) > 10 * len(whole.faces)
    assert expected_error(pieces, WAVELENGTH) == pytest.approx(expected_error(whole, WAVELENGTH), rel=1e-9)
    assert longest_edge(surface(pieces)) <= 0.04
    assert volume(surface(pieces)) == pytest.approx(volume(surface(whole)), rel=1e-12)


def as_mesh(parts):
    return parts[0], parts[1].astype(np.int32)


def test_the_longest_edges_first_makes_fewer_and_no_thinner_facets() -> None:
    rough = mesh_of(Remus100(coarse=True))
    thinness = []
    for cut in (split_long_edges, halve_longest_edges):
        vertices, faces = cut(surface(rough), 0.02)
        corners = vertices[faces]
        length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        double = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        thinness.append((len(faces), np.median(double / length**2)))
    assert thinness[1][0] < 0.85 * thinness[0][0]
    assert thinness[1][1] >= thinness[0][1]


def test_beyond_the_most_facets_it_is_coarser_and_says_so(monkeypatch) -> None:
    monkeypatch.setattr(mesh_resolution, "MOST_FACETS", 3000)
    ball = frame_mesh(Sphere(radius=3.0), 0.0501)
    assert 500 < len(ball.faces) < 6000
    assert "facets are too few for waves of 50.1 mm: their rows" in ball.notes[1]
    assert "too coarse" in ball.notes[2]
    block = frame_mesh(Box(size=(3.0, 3.0, 3.0)), 0.0501)
    assert 500 < len(block.faces) < 6000
    assert "each has one direction to all hydrophones" in block.notes[0]
    assert len(block.notes) == 1


def test_the_report_names_what_would_do() -> None:
    """The edge that it names has, on the true surface, the error that it promises."""
    ball = mesh_of(Sphere(radius=0.3, edge=0.1))
    line = mesh_report(ball, WAVELENGTH)
    assert line is not None and "\n" not in line
    edge = float(line.split("5 % takes facets of ")[1].split()[0]) * 1e-3
    fine = mesh_of(Sphere(radius=0.3, edge=1.15 * edge))  # its longest is 1.15 of its mean
    assert expected_error(fine, WAVELENGTH) == pytest.approx(0.05, rel=0.2)
    assert mesh_report(fine, WAVELENGTH, allowed=0.07) is None
    assert mesh_report(mesh_of(Box(size=(1.0, 1.0, 1.0))), 1e-3) is None
    assert expected_error(ball, 1e-9) == 1.0


def test_a_mesh_for_target_strength_leaves_flat_facets_whole() -> None:
    assert fine_mesh(Box(size=(1.0, 1.0, 1.0)), WAVELENGTH).faces.shape == (12, 3)
    assert len(frame_mesh(Box(size=(1.0, 1.0, 1.0)), WAVELENGTH).faces) > 1000
