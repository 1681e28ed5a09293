"""How fine a mesh must be: by the exact Kirchhoff integral over a cylinder; of facets that echo from their middles."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Still
from sonarsynth.geometry.surfaces import longest_edge, volume
from sonarsynth.planning.notes.target_notes import off_origin
from sonarsynth.scattering import Isotropic, MirrorLobe
from sonarsynth.targets.mesh_resolution import MOST_CUT, expected_error
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, MeshFile
from sonarsynth.targets.target import Target, base_mesh
from sonarsynth.validation.bodies.body_cases import backscatter
from sonarsynth.validation.bodies.cylinder import lit_cylinder


@pytest.mark.parametrize("staggered", [True, False])
@pytest.mark.parametrize(("turns", "rows"), [(24, 40), (60, 40), (90, 16), (90, 2)])
def test_long_thin_facets_along_a_cylinder_are_judged_by_their_width(turns, rows, staggered):
    """Broadside, an eighth of a step off the symmetry of the mesh: the exact integral, facets of up to 0.2 m."""
    radius, length, wavelength = 0.0955, 0.4, 1500.0 / 85e3
    angle = 0.25 * np.pi / turns
    mesh = side_of_a_cylinder(radius, length, turns, rows, staggered)
    got = backscatter(mesh, np.array([0.0, np.cos(angle), np.sin(angle)]), np.array([85e3]))
    error = float(abs(got / lit_cylinder(0.5 * np.pi, 2 * np.pi / wavelength, radius, length) - 1)[0])
    assert (0.8 if staggered else 0.5) < error / expected_error(mesh, wavelength) < (1.1 if staggered else 1.5)


def side_of_a_cylinder(radius: float, length: float, turns: int, rows: int, staggered: bool) -> Mesh:
    """Rings of vertices, every other one turned by half a step where staggered; no ends."""
    ring, at = np.meshgrid(np.arange(rows + 1), np.arange(turns), indexing="ij")
    angle = 2 * np.pi / turns * (at + 0.5 * (ring % 2) * staggered)
    x = length * (ring / rows - 0.5)
    vertices = np.stack([x, radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 3)
    a, b = turns * ring[:-1] + at[:-1], turns * ring[:-1] + (at[:-1] + 1) % turns
    c, d = a + turns, b + turns
    even = (staggered & (ring[:-1] % 2 == 0))[..., None]
    first = np.where(even, np.stack([a, c, b], -1), np.stack([a, d, b], -1))
    second = np.where(even, np.stack([b, c, d], -1), np.stack([a, c, d], -1))
    mesh = Mesh(vertices, np.concatenate([first, second]).reshape(-1, 3).astype(np.int32))
    outward = np.einsum("fi,fi->f", mesh.normal, mesh.centroid * [0, 1, 1]) > 0
    return Mesh(vertices, np.where(outward[:, None], mesh.faces, mesh.faces[:, ::-1]))


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_coarse_shapes_are_cut_for_facets_that_echo_from_their_middles(scale):
    """No edge is over 10 cm at the scale of the body; surface, volume and closedness are those of the shape."""
    shape = Box(size=(2.0, 0.7, 0.4))
    coarse, cut = mesh_of(shape), base_mesh(shape, MirrorLobe(), 0.02, scale)
    assert longest_edge((cut.vertices, cut.faces)) * scale <= 0.1
    assert cut.area.sum() == pytest.approx(coarse.area.sum(), rel=1e-12)
    assert volume((cut.vertices, cut.faces)) == pytest.approx(2.0 * 0.7 * 0.4, rel=1e-12)
    assert any("12 facets up to 2.1 m long are cut" in note and "e+" not in note for note in cut.notes)


def test_meshes_stay_as_described_where_their_edge_is_given_or_the_number_of_facets_counts():
    described = Box(size=(2.0, 0.7, 0.4), edge=0.5)
    assert base_mesh(described, MirrorLobe(), 0.02).digest == mesh_of(described).digest
    plain = Box(size=(2.0, 0.7, 0.4))
    for law in (Isotropic(), MirrorLobe(phases="alike")):
        assert len(base_mesh(plain, law, 0.02).faces) == 12


def test_a_ship_is_cut_no_further_than_a_frame_can_bear():
    ship = base_mesh(Box(size=(200.0, 30.0, 20.0)), MirrorLobe(), 0.02)
    assert 0.3 * MOST_CUT < len(ship.faces) < 1.5 * MOST_CUT


def test_a_file_beside_its_origin_is_named_with_the_offset_that_centres_it(tmp_path):
    """Turned, moved and scaled by the recipe: with the offset that the note gives there is no note, and no distance."""
    corners = trimesh.creation.box((2.0, 0.5, 0.3))
    corners.apply_translation([5.0, 1.0, -2.0])
    corners.export(tmp_path / "hull.stl")
    shape = MeshFile(path=str(tmp_path / "hull.stl"), heading=0.7, pitch=-0.3, offset=(0.1, 0.2, 0.3))
    target = Target(name="hull", shape=shape, motion=Still(position=(10.0, 0.0, -5.0)), scale=2.0)
    (note,) = off_origin(target, mesh_of(shape).scaled(2.0))
    offset = tuple(json.loads(note.split("offset: ")[1].split("`")[0]))
    centred = replace(target, shape=replace(shape, offset=offset))
    mesh = mesh_of(centred.shape).scaled(2.0)
    np.testing.assert_allclose(mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0), 0.0, atol=4e-3)
    assert not list(off_origin(centred, mesh))
