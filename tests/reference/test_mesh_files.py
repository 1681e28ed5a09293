"""Meshes from files: the same body from every format, in its unit and pose; what is repaired, and said."""

import numpy as np
import pytest
import trimesh

from sonarsynth.geometry import surfaces
from sonarsynth.geometry.surfaces import longest_edge, split_long_edges, volume
from sonarsynth.targets.generated.generation import generate
from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import Box, LShape, MeshFile, Sphere

BODY = LShape(height=1.0, length=2.0, width=0.5, thickness=0.1)


def written(path, vertices, faces, **how):
    trimesh.Trimesh(vertices, faces, process=False).export(path, **how)
    return str(path)


def off(path, vertices, faces):
    """An OFF file with every vertex and facet as given."""
    rows = [*(" ".join(map(repr, map(float, v))) for v in vertices), *(f"3 {a} {b} {c}" for a, b, c in faces)]
    path.write_text("\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *rows, ""]))
    return str(path)


def solid(mesh):
    return volume((mesh.vertices, mesh.faces))


@pytest.mark.parametrize("ending", ["stl", "STL", "obj", "ply", "off", "glb"])
def test_every_format_gives_the_same_body(tmp_path, ending):
    body = mesh_of(BODY)
    path = tmp_path / f"body.{ending}"
    trimesh.Trimesh(body.vertices, body.faces, process=False).export(path, file_type=ending.lower())
    mesh = mesh_of(MeshFile(path=str(path)))
    assert mesh.notes == ()
    assert mesh.vertices.shape == (12, 3) and mesh.faces.shape == (20, 3)
    assert mesh.faces.dtype == np.int32 and not mesh.vertices.flags.writeable and not mesh.faces.flags.writeable
    np.testing.assert_allclose(mesh.box, body.box, atol=1e-6)
    assert solid(mesh) == pytest.approx(solid(body), rel=1e-6)
    assert mesh_of(MeshFile(path=str(path))) is mesh


def test_unit_turn_and_offset(tmp_path):
    """Roll about x first, then pitch about y, then heading about z, counter-clockwise; then the offset, in metres."""
    path = off(
        tmp_path / "arrow.off",
        [[2000, 0, 0], [0, 300, 0], [0, 0, 100], [0, 0, 0]],
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )

    def corners(**pose):
        return mesh_of(MeshFile(path=path, unit="mm", **pose)).vertices[:3]

    quarter = np.pi / 2
    np.testing.assert_allclose(corners(), [[2, 0, 0], [0, 0.3, 0], [0, 0, 0.1]], atol=1e-15)
    np.testing.assert_allclose(corners(heading=quarter), [[0, 2, 0], [-0.3, 0, 0], [0, 0, 0.1]], atol=1e-15)
    np.testing.assert_allclose(corners(pitch=quarter), [[0, 0, -2], [0, 0.3, 0], [0.1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(corners(roll=quarter), [[2, 0, 0], [0, 0, 0.3], [0, -0.1, 0]], atol=1e-15)
    np.testing.assert_allclose(
        corners(roll=quarter, heading=quarter, offset=(1, 0, 0)), [[1, 2, 0], [1, 0, 0.3], [1.1, 0, 0]], atol=1e-15
    )


def test_edges_are_split_to_size(tmp_path):
    body = mesh_of(BODY)
    path = written(tmp_path / "body.stl", body.vertices, body.faces)
    mesh = mesh_of(MeshFile(path=path, edge=0.1))
    assert longest_edge((mesh.vertices, mesh.faces)) <= 0.1
    assert mesh.area.sum() == pytest.approx(body.area.sum(), rel=1e-6)
    with pytest.raises(MeshError, match=r"body\.stl: edges of 1e-06 m would take more than \d+ facets"):
        mesh_of(MeshFile(path=path, edge=1e-6))


def test_a_file_that_changes_is_read_again(tmp_path):
    path = tmp_path / "box.off"
    small, large = mesh_of(Box(size=(1, 1, 1))), mesh_of(Box(size=(10, 1, 1)))
    first = mesh_of(MeshFile(path=off(path, small.vertices, small.faces)))
    second = mesh_of(MeshFile(path=off(path, large.vertices, large.faces)))
    assert first.digest != second.digest
    assert solid(second) == pytest.approx(10.0)


def test_one_part_of_two_inside_out(tmp_path):
    body, ball = mesh_of(BODY), mesh_of(Sphere(radius=0.1, edge=0.05))
    vertices = np.concatenate([body.vertices, ball.vertices + 5])
    faces = np.concatenate([body.faces, ball.faces[:, ::-1] + len(body.vertices)])
    mesh = mesh_of(MeshFile(path=off(tmp_path / "two.off", vertices, faces)))
    assert mesh.notes == ("1 of 2 closed parts inside out, turned",)
    assert solid(mesh) == pytest.approx(solid(body) + solid(ball))


def test_repeated_vertices_facets_and_facets_without_area(tmp_path):
    body = mesh_of(BODY)
    vertices = np.concatenate([body.vertices, body.vertices[:3], [[1.0, 0.0, 5.0]]])  # three again, one unused
    faces = body.faces.copy()
    faces[:9][faces[:9] == 1] = 13  # the second vertex by its other number, here and there
    empty = [[0, 0, 3], [4, 5, 4], [0, 12, 7]]
    mesh = mesh_of(MeshFile(path=off(tmp_path / "body.off", vertices, [*faces, *empty, faces[4][[1, 2, 0]]])))
    assert mesh.notes == ("2 duplicate vertices merged", "3 facets without area dropped", "1 facet repeated, dropped")
    assert (len(mesh.vertices), len(mesh.faces)) == (12, 20)
    assert solid(mesh) == pytest.approx(solid(body))


def test_corners_on_a_line_make_no_facet(tmp_path):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1 / 3, 1 / 3, 1 / 3], [2 / 3, 2 / 3, 2 / 3], [1, 1, 1]]
    mesh = mesh_of(MeshFile(path=off(tmp_path / "sliver.off", vertices, [[0, 1, 2], [3, 4, 5]])))
    assert "1 facet without area dropped" in mesh.notes
    assert len(mesh.faces) == 1
    with pytest.raises(MeshError, match=r"lines\.off: no facet has an area"):
        mesh_of(MeshFile(path=off(tmp_path / "lines.off", vertices, [[3, 4, 5]])))


def test_an_open_surface_is_used_and_said(tmp_path):
    box = mesh_of(Box(size=(1, 1, 1)))
    open_box = mesh_of(MeshFile(path=off(tmp_path / "open.off", box.vertices, box.faces[:-2])))
    note = "not closed: 1 of 1 parts open, 4 edges with one facet only; facets scatter from their front alone"
    assert open_box.notes == (note,)
    inside_out = mesh_of(MeshFile(path=off(tmp_path / "inside.off", box.vertices, box.faces[:-2, ::-1])))
    assert inside_out.notes == ("1 nearly closed part inside out, turned", note)
    assert np.einsum("fi,fi->f", inside_out.normal, inside_out.centroid).min() > 0
    sheet = mesh_of(MeshFile(path=off(tmp_path / "sheet.off", box.vertices, box.faces[:2, ::-1])))
    np.testing.assert_array_equal(sheet.normal, -box.normal[:2])  # nobody can say which side is out


def test_a_moebius_band_is_said_to_have_one_side(tmp_path):
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    edge = [
        [np.cos(t) * (1 + s * np.cos(t / 2)), np.sin(t) * (1 + s * np.cos(t / 2)), s * np.sin(t / 2)]
        for t in turn
        for s in (-0.3, 0.3)
    ]
    faces = []
    for i in range(12):
        a, b, c, d = (2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3) if i < 11 else (22, 23, 1, 0)
        faces += [[a, c, b], [b, c, d]]
    mesh = mesh_of(MeshFile(path=off(tmp_path / "band.off", edge, faces)))
    assert "1 part one-sided: winding cannot be made consistent" in mesh.notes


def test_a_splitting_that_would_take_too_many_is_refused_before_it_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """A long plate: its area alone does not tell, for facets with one short edge are cut in three."""
    plate = generate(Box(size=(1.0, 30.0, 0.3)))[0]
    assert len(split_long_edges(plate, 0.3)[1]) == 24352  # 3.4 times what its area would need
    monkeypatch.setattr(surfaces, "cut", None)  # nothing is cut
    monkeypatch.setattr(surfaces, "max_facets", lambda: 19_000)
    with pytest.raises(MeshError, match=r"edges of 0\.3 m would take more than 19000 facets"):
        split_long_edges(plate, 0.3)
