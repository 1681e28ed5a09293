"""Whatever is done to the numbering and winding of a closed mesh, it comes back."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.geometry.surfaces import join, longest_edge, sides, split_long_edges, volume, weld
from sonarsynth.targets.generated.generation import generate
from sonarsynth.targets.mesh_readers.mesh_repair import orient, repair
from sonarsynth.targets.shapes import Box, LShape, Sphere

PARTS = [
    generate(Sphere(radius=0.3, edge=0.2))[0],
    generate(LShape(height=1.0, length=2.0, width=0.5, thickness=0.1))[0],
    generate(Box(size=(0.3, 0.2, 0.1)))[0],
]
seeds = st.integers(0, 2**32 - 1)


def scene(rng):
    """All parts, far apart."""
    return join(*((v + [5 * i, 0, 0], f) for i, (v, f) in enumerate(PARTS)))


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_any_winding_comes_back(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = scene(rng)
    wound = np.where(rng.random(len(faces))[:, None] < rng.random(), faces[:, ::-1], faces)
    back, notes = orient(vertices, wound)
    turned = np.any(back != faces, axis=1)
    np.testing.assert_array_equal(np.sort(back, axis=1), np.sort(faces, axis=1))
    assert abs(volume((vertices, back)) / volume((vertices, faces)) - 1) < 1e-12
    for i in np.flatnonzero(turned):  # the same facet, begun at another corner
        assert tuple(np.roll(back[i], 1)) == tuple(faces[i]) or tuple(np.roll(back[i], 2)) == tuple(faces[i])
    assert not any("not closed" in note for note in notes)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_a_soup_of_facets_becomes_the_body_again(seed):
    """Each facet with three vertices of its own, in any order, as an STL has them."""
    rng = np.random.default_rng(seed)
    vertices, faces = scene(rng)
    order = rng.permutation(len(faces))
    soup = vertices[faces[order]].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    (points, joined), notes = repair(soup, "soup", shares_vertices=False)
    assert notes == ()
    assert len(points) == len(vertices)
    np.testing.assert_array_equal(points[joined], vertices[faces[order]])


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_repair_is_done_once(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = scene(rng)
    faces = rng.permutation(np.where(rng.random(len(faces))[:, None] < 0.3, faces[:, ::-1], faces))
    first, _ = repair((vertices, faces), "mesh", shares_vertices=True)
    again, notes = repair(first, "mesh", shares_vertices=True)
    assert notes == ()
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])


@settings(max_examples=30, deadline=None)
@given(st.floats(0.05, 3.0), st.tuples(*[st.floats(0.05, 2.0)] * 3))
def test_splitting_keeps_volume_area_and_closure(edge, size):
    surface = generate(Box(size=size))[0]
    vertices, faces = split_long_edges(surface, edge)
    assert longest_edge((vertices, faces)) <= edge
    np.testing.assert_allclose(volume((vertices, faces)), np.prod(size), rtol=1e-12)
    assert np.all(np.bincount(sides(faces)[1].ravel()) == 2)
    assert len(weld((vertices, faces))[0]) == len(vertices)


@settings(max_examples=60, deadline=None)
@given(seeds, st.floats(0.03, 0.5), st.floats(0.3, 12.0), st.floats(0.5, 10.0), st.floats(0.0, 1.0))
def test_any_hull_is_closed_and_keeps_to_its_edge(seed, diameter, slenderness, exponent, blunt):
    from sonarsynth.targets.shapes import Myring

    rng = np.random.default_rng(seed)
    nose, middle, tail = diameter * slenderness * rng.dirichlet([1, 1, 1]) + [1e-3, 0, 1e-3]
    angle = np.arctan(1.5 * diameter / tail) * rng.random() * 0.999
    hull = Myring(
        nose=nose,
        middle=middle,
        tail=tail,
        diameter=diameter,
        exponent=exponent,
        tail_angle=min(angle, 1.5),
        nose_offset=0.9 * blunt * nose,
        tail_offset=0.9 * blunt * tail,
        edge=diameter / rng.uniform(1, 12),
    )
    vertices, faces = generate(hull)[0]
    ends, edge = sides(faces)
    assert np.all(np.bincount(edge.ravel()) == 2)
    assert len(vertices) - len(ends) + len(faces) == 2
    assert volume((vertices, faces)) > 0
    assert longest_edge((vertices, faces)) <= hull.edge
