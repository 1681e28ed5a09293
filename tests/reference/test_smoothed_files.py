"""Target strength of a mesh file that stands for a sphere, against the exact series."""

import warnings

import numpy as np
import pytest
import trimesh

import sonarsynth as ss
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.targets.mesh_resolution import CoarseMesh
from sonarsynth.targets.meshes import mesh_of

BAND = np.linspace(25e3, 110e3, 8)


def test_a_sphere_of_320_facets_echoes_like_one_where_it_is_smooth(tmp_path):
    """Off by up to 25 dB as it is, and by less than 0.15 dB smoothed; a file without shared vertices (STL) as well."""
    exact = 20 * np.log10(np.abs(sphere_amplitude(BAND, np.pi, radius=0.25)))
    incident = np.random.default_rng(1).normal(size=(2, 1, 3))
    incident /= np.linalg.norm(incident, axis=-1, keepdims=True)
    path = str(tmp_path / "ball.stl")
    trimesh.creation.icosphere(subdivisions=2, radius=0.25).export(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", CoarseMesh)
        smooth = ss.target_strength(ss.MeshFile(path=path, smooth=True), BAND, incident, -incident)
    with pytest.warns(CoarseMesh, match=r"too coarse for waves of 13\.6 mm: expect an error of 100 %"):
        rough = ss.target_strength(ss.MeshFile(path=path), BAND, incident, -incident)
    assert np.abs(smooth - exact).max() < 0.15
    assert np.abs(rough - exact).max() > 5.0


def test_an_edge_asked_for_is_kept_to_on_the_curve(tmp_path):
    path = str(tmp_path / "ball.ply")
    trimesh.creation.icosphere(subdivisions=2, radius=0.25).export(path)
    mesh = mesh_of(ss.MeshFile(path=path, smooth=True, edge=0.03))
    corners = mesh.corners
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= 0.03
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.25, rtol=1e-6)
    flat = mesh_of(ss.MeshFile(path=path, edge=0.03))
    assert np.linalg.norm(flat.vertices, axis=1).min() < 0.249
    sharp = mesh_of(ss.MeshFile(path=path, smooth=True, edge=0.03, crease=np.radians(5.0)))
    assert sharp.area.sum() == pytest.approx(flat.area.sum(), rel=1e-9)  # every edge is a crease
    assert len(mesh_of(ss.MeshFile(path=path, smooth=True)).faces) == 320
