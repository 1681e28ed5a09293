"""Generated surfaces: closed, outward, on the true surface, and converging to it at second order."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import quad

from sonarsynth.geometry.surfaces import longest_edge, volume
from sonarsynth.targets.generated.generation import generate
from sonarsynth.targets.generated.myring import hull_length, hull_meridian
from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import Box, Cylinder, LShape, Myring, Remus100, Sphere
from tests.hulls import hull_radius

TORPEDO = {"nose": 0.2, "middle": 0.6, "tail": 0.5, "diameter": 0.2}
SHAPES = [
    Sphere(radius=0.25),
    Sphere(radius=3.0, edge=0.5),
    Sphere(radius=1.0, edge=9.0),
    Cylinder(radius=0.1, length=0.4),
    Cylinder(radius=0.5, length=0.01, edge=0.1),
    Cylinder(radius=0.02, length=2.0, edge=1.0),
    Box(size=(1.0, 2.0, 3.0)),
    Box(size=(1.0, 0.02, 0.3), edge=0.05),
    LShape(height=1.0, length=2.0, width=0.5, thickness=0.1),
    LShape(height=1.0, length=0.7, width=0.5, thickness=0.1, edge=0.15),
    Myring(**TORPEDO),
    Myring(**TORPEDO, nose_offset=0.05, tail_offset=0.1, edge=0.03),
    Myring(nose=0.2, middle=0.0, tail=0.5, diameter=0.2, exponent=10.0, tail_angle=0.5),  # blunt
    Myring(nose=0.2, middle=0.0, tail=0.5, diameter=0.2, exponent=0.5, tail_angle=0.0),  # two cusps
    Myring(nose=0.01, middle=1.0, tail=0.01, diameter=0.2, edge=0.05),
    Remus100(fins=False),
    Remus100(fins=False, coarse=True),
]


def ids(shape):
    return f"{shape.kind}-{sum(repr(shape).encode()) % 1000}"  # not hash(): every process must name a test alike


def edges(mesh):
    """Directed edges, and how often each undirected edge occurs."""
    ends = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2)
    return ends, np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)[1]


@pytest.mark.parametrize("shape", SHAPES, ids=ids)
def test_a_generated_surface_is_a_closed_outward_sphere_of_good_facets(shape):
    mesh = mesh_of(shape)
    ends, counts = edges(mesh)
    assert np.all(counts == 2)
    assert len(np.unique(ends, axis=0)) == len(ends)  # neighbours are wound alike
    assert len(mesh.vertices) - len(counts) + len(mesh.faces) == 2  # Euler
    assert np.all(np.unique(mesh.faces) == np.arange(len(mesh.vertices)))
    assert volume((mesh.vertices, mesh.faces)) > 0
    np.testing.assert_allclose(mesh.area @ mesh.normal, 0.0, atol=1e-12 * mesh.area.sum())
    assert mesh.area.min() > 0
    edge = getattr(shape, "edge", None)
    if edge and not getattr(shape, "coarse", False):
        assert longest_edge((mesh.vertices, mesh.faces)) <= edge


@pytest.mark.parametrize(
    ("shape", "true_volume", "true_area"),
    [
        (Sphere(radius=0.5, edge=0.2), np.pi / 6, np.pi),
        (Cylinder(radius=0.1, length=0.5, edge=0.06), np.pi * 0.005, np.pi * 0.12),
    ],
    ids=["sphere", "cylinder"],
)
def test_volume_and_area_converge_from_below_at_second_order(shape, true_volume, true_area):
    errors = []
    for finer in (1, 2, 4, 8):
        mesh = mesh_of(type(shape)(**{**vars(shape), "edge": shape.edge / finer}))
        errors.append([1 - volume((mesh.vertices, mesh.faces)) / true_volume, 1 - mesh.area.sum() / true_area])
    ratio = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.min(errors) > 0
    assert ratio[-1].min() > 3.0 and ratio[-1].max() < 5.2
    assert np.max(errors[-1]) < 1e-3


def test_a_myring_hull_converges_to_its_integrals():
    hull = Myring(**TORPEDO, nose_offset=0.02, tail_offset=0.05)
    length = hull_length(hull)
    joints = [hull.nose - hull.nose_offset, hull.nose - hull.nose_offset + hull.middle]
    exact = quad(lambda s: np.pi * hull_radius(hull, s) ** 2, 0, length, points=joints, epsabs=1e-13)[0]
    error = []
    for edge in (0.04, 0.02, 0.01):
        mesh = mesh_of(Myring(**{**vars(hull), "edge": edge}))
        error.append(1 - volume((mesh.vertices, mesh.faces)) / exact)
        sagitta = float(mesh.notes[0].split()[4]) * 1e-3
        assert sagitta == pytest.approx(error[-1] * exact / mesh.area.sum(), rel=0.05)  # two figures are said
    assert 3.0 < error[1] / error[2] < 5.2
    assert 0 < error[2] < 3e-3


@pytest.mark.parametrize("shape", [s for s in SHAPES if s.kind == "myring"], ids=ids)
def test_vertices_of_a_hull_lie_on_its_true_surface(shape):
    mesh = mesh_of(shape)
    x, r = mesh.vertices[:, 0], np.hypot(mesh.vertices[:, 1], mesh.vertices[:, 2])
    half = 0.5 * hull_length(shape)
    assert mesh.box[0, 0] == pytest.approx(-half, abs=1e-12)
    assert mesh.box[1, 0] == pytest.approx(half, abs=1e-12)
    side = np.abs(x) < half - 1e-6  # not on the flat ends
    about = np.stack([hull_radius(shape, half - x[side] + shift) for shift in (-1e-9, 0.0, 1e-9)])
    assert np.all(r[side] > about.min(axis=0) - 1e-8)  # vertices are rounded
    assert np.all(r[side] < about.max(axis=0) + 1e-8)


@pytest.mark.parametrize("shape", [Sphere(radius=0.25), Sphere(radius=7.0, edge=1.0)], ids=ids)
def test_vertices_of_a_sphere_lie_on_it(shape):
    np.testing.assert_allclose(np.linalg.norm(mesh_of(shape).vertices, axis=1), shape.radius, atol=1e-9)


def test_the_profile_of_the_hull():
    """Myring (1976) as in Prestero (2001), eq. 2.1 and 2.2, by hand; smooth at both joints, tail at its angle."""
    hull = Myring(nose=0.191, middle=0.654, tail=0.541, diameter=0.191, tail_angle=0.436)
    assert hull_length(hull) == pytest.approx(1.386)
    radius = hull_radius(hull, [0.0, 0.191 / 2, 0.191, 0.5, 0.845, 0.845 + 0.541 / 2, 1.386])
    middle_of_tail = 0.5 * 0.0955 + 0.541 * np.tan(0.436) / 8
    np.testing.assert_allclose(
        radius, [0.0, 0.0955 * np.sqrt(0.75), 0.0955, 0.0955, 0.0955, middle_of_tail, 0.0], atol=1e-12
    )
    slope = (hull_radius(hull, 1.386) - hull_radius(hull, 1.386 - 1e-6)) / 1e-6
    assert slope == pytest.approx(-np.tan(0.436), rel=1e-5)
    for joint in (0.191, 0.845):
        assert abs(hull_radius(hull, joint + 1e-5) - hull_radius(hull, joint - 1e-5)) < 1e-8
    for arc in hull_meridian(hull):
        x, radius = arc.point(np.linspace(0.1, 0.9, 50))
        np.testing.assert_allclose(radius, hull_radius(hull, 0.5 * 1.386 - x), rtol=1e-13)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tail_angle": 0.6}, "thicker than the diameter; use 0.54 rad at most"),
        ({"nose_offset": 0.2}, "leaves nothing of the 0.2 m of the nose"),
        ({"tail_offset": 0.5}, "leaves nothing of the 0.5 m of the tail"),
        ({"exponent": 0.2}, "greater than or equal to 0.5"),
    ],
)
def test_a_hull_that_cannot_be_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Myring(**TORPEDO, **changes)


def test_the_corner_of_an_l_is_at_the_origin():
    mesh = mesh_of(LShape(height=1.0, length=2.0, width=0.5, thickness=0.1, edge=0.2))
    np.testing.assert_allclose(mesh.box, [[-0.1, -0.25, -0.1], [2.0, 0.25, 1.0]], atol=1e-15)
    assert volume((mesh.vertices, mesh.faces)) == pytest.approx(0.5 * 0.1 * (2.1 + 1.0))
    upright = (np.abs(mesh.centroid[:, 0]) < 1e-12) & (mesh.normal[:, 0] > 0.99)
    lying = (np.abs(mesh.centroid[:, 2]) < 1e-12) & (mesh.normal[:, 2] > 0.99)
    assert mesh.area[upright].sum() == pytest.approx(0.5)
    assert mesh.area[lying].sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "shape",
    [Sphere(radius=1.0, edge=1e-5), Cylinder(radius=1.0, length=1.0, edge=1e-5), Box(size=(1.0, 1.0, 1.0), edge=1e-5)],
)
def test_a_mesh_beyond_all_measure_is_refused_at_once(shape):
    with pytest.raises(MeshError, match="would take more than 20000000 facets; use a longer edge"):
        mesh_of(shape)


def test_a_mesh_is_always_the_same_and_cannot_be_changed():
    shape = Remus100(edge=0.05)
    mesh = mesh_of(shape)
    assert mesh_of(Remus100(edge=0.05)) is mesh
    (vertices, faces), _ = generate(shape)
    np.testing.assert_allclose(vertices, mesh.vertices, rtol=0, atol=0.51e-9)
    np.testing.assert_array_equal(faces, mesh.faces)
    for array in (mesh.vertices, mesh.faces, mesh.normal, mesh.area, mesh.centroid, mesh.corners, mesh.box):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_shape_is_the_same_mesh_on_every_processor():
    """NumPy computes sines and powers by the widest instructions that there are: their last bits differ."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    code = (
        "from sonarsynth.targets.meshes import mesh_of; from sonarsynth.targets.shapes import Remus100, Sphere;"
        "print([mesh_of(shape).digest for shape in (Remus100(), Sphere(radius=0.3))])"
    )
    wide = " ".join(name for name in __cpu_dispatch__ if __cpu_features__[name])
    plain = {"NPY_DISABLE_CPU_FEATURES": wide} if wide else {}
    digests = [
        subprocess.run([sys.executable, "-c", code], env=os.environ | more, capture_output=True, check=True).stdout
        for more in ({}, plain)
    ]
    assert digests[0] == digests[1]
    assert len(digests[0]) > 128
