"""Rays cast at meshes: what is hit first, and what is hidden.

Embree is float32. So a ray is cast in the frame of the mesh, from where it enters the bounding sphere, and the facet
that Embree proposes (with all facets that share a corner with it) is intersected again in float64, which decides; a
proposal that does not hold is passed over and the ray goes on. Distances are right to about 1e-15 of the ray's length;
rays that pass a silhouette closer than 1e-6 of the body's size may go either way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Lock
from typing import Any

import numpy as np

from sonarsynth.columns import alike
from sonarsynth.conventions import NO_TARGET, Bools, Floats, Int32s, Ints
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget

OFFSET = 1e-6
"""Of the body's size: how far off a facet, along its normal, a ray starts so as not to meet it."""
ROUNDS = 8
"""Proposals tried before the slow exact search."""
BYTES = 90
"""Of Embree's own tables for a facet."""
SLACK = 1e-3
"""Of the body's size: a hit this much beyond the proposed one is another hit, with others before it perhaps."""
_LOOKING_UP = Lock()
"""Held while horizons are written, so that threads read whole ones."""


class EmbreeCaster:
    """Embree by embreex: a float32 ray caster, in watertight mode."""

    def __init__(self, vertices: Floats, faces: np.ndarray) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene: Any = EmbreeScene(robust=True)
        TriangleMesh(self._scene, vertices.astype(np.float32), faces.astype(np.int32, copy=False))
        self.nbytes = BYTES * len(faces)

    def nearest(self, origin: Floats, direction: Floats, far: Floats) -> tuple[Ints, Floats]:
        """Proposed facet (ray,) of the nearest hit within `far`, -1 for none, and its distance."""
        limit = np.minimum(far, 1e30).astype(np.float32)
        out = self._scene.run(origin.astype(np.float32), direction.astype(np.float32), limit, output=1)
        return out["primID"].astype(np.int64), out["tfar"].astype(float)


@dataclass(frozen=True, eq=False)
class CastingMesh:
    """A mesh made ready for casting: centred on its box and of unit size."""

    centre: Floats  # (xyz) m, in the mesh's frame
    size: float  # m: radius of the bounding sphere about the centre
    vertices: Floats  # (vertex, xyz) centred, in units of size
    faces: Int32s  # (facet, 3)
    caster: EmbreeCaster

    @cached_property
    def around(self) -> tuple[Int32s, Int32s]:
        """Facets round each vertex: (vertex + 1,) where each list begins, and the lists."""
        from sonarsynth.casting import intersections

        return intersections.round_vertices(self.faces, len(self.vertices))

    @cached_property
    def tree(self) -> tuple[Floats, Int32s]:
        """Boxes (node, 6) round facets, and the facets in order of place; see `facet_tree`."""
        from sonarsynth.casting import facet_tree

        return facet_tree.tree(self.vertices, self.faces)

    @cached_property
    def horizons(self) -> Floats:
        """(facet, octant) how high the mesh stands over each facet, as far as anybody asked."""
        from sonarsynth.casting.horizons import UNKNOWN

        return np.full((len(self.faces), 8), UNKNOWN)

    def horizon(self, facet: Ints) -> Floats:
        """The same, known of some facets (row,) at least; -1: none of it. See `horizons.look_up`."""
        from sonarsynth.casting.horizons import look_up

        with _LOOKING_UP:
            look_up(facet, self.vertices, self.faces, *self.tree, self.horizons)
        return self.horizons

    def times(self, factor: float) -> CastingMesh:
        """That of a copy so many times as large: what is known of the mesh in units of its size serves both."""
        copy = replace(self, centre=self.centre * factor, size=self.size * factor)
        vars(copy).update(around=self.around, tree=self.tree, horizons=self.horizons)
        return copy

    def within(self, start: Floats, heading: Floats, limit: Floats, *, any_hit: bool = False) -> tuple[Ints, Floats]:
        """Facet (ray,) and distance of the nearest hit within `limit`, in the unit of this mesh, or with any_hit of
        another, of rays that start at its bounding sphere or within it; -1 and NaN for none."""
        from sonarsynth.casting import intersections

        facet, distance = np.full(len(start), NO_TARGET), np.full(len(start), np.nan)
        rays, passed, ahead = np.arange(len(start)), np.zeros(len(start)), start
        for _ in range(ROUNDS):
            proposed, at = self.caster.nearest(ahead, heading, limit - passed)
            candidate = np.flatnonzero((proposed >= 0) & (proposed < len(self.faces)))  # of most rays, nothing
            rays, start, heading, limit = rays[candidate], start[candidate], heading[candidate], limit[candidate]
            beyond = passed[candidate] + at[candidate]
            hit, along = np.empty(len(candidate), np.int64), np.empty(len(candidate))
            near, far = np.zeros(len(candidate)), np.fmin(limit, beyond + SLACK)
            mesh = self.vertices, self.faces, *self.around
            intersections.confirm(start, heading, near, far, proposed[candidate], *mesh, 1.0, hit, along, any_hit)
            facet[rays], distance[rays] = hit, along
            again = np.flatnonzero(hit < 0)
            if not len(again):
                return facet, distance
            rays, start, heading, limit = rays[again], start[again], heading[again], limit[again]
            passed = beyond[again] + 2 * OFFSET
            ahead = start + passed[:, None] * heading
        hit, along = np.empty(len(start), np.int64), np.empty(len(start))
        intersections.search(start, heading, np.zeros(len(start)), limit, self.vertices, self.faces, 1.0, hit, along)
        facet[rays], distance[rays] = hit, along
        return facet, distance


@dataclass(frozen=True)
class _ByContent:
    """A mesh as the key of a cache: two meshes of one content are one, and so are two copies of one original."""

    digest: str
    mesh: Mesh

    @staticmethod
    def of(mesh: Mesh) -> _ByContent:
        """The key of a mesh."""
        original = mesh.original
        return _ByContent(mesh.digest if original is None else f"{original[0].digest} {original[1]!r}", mesh)

    def __hash__(self) -> int:
        return hash(self.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByContent) and self.digest == other.digest


@byte_bounded_cache(32)
def _casting_mesh(key: _ByContent) -> CastingMesh:
    mesh = key.mesh
    if mesh.original is not None:
        original, factor = mesh.original
        return casting_mesh(original).times(factor)
    if not np.isfinite(mesh.vertices).all():
        raise ValueError("a mesh with vertices that are not finite cannot be cast at")
    if len(mesh.faces) and not (mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)):
        raise ValueError("a mesh with faces that name no vertex cannot be cast at")
    named = np.zeros(len(mesh.vertices), bool)
    named[mesh.faces] = True
    used = mesh.vertices if named.all() else mesh.vertices[named]
    centre = 0.5 * (used.min(axis=0) + used.max(axis=0))
    size = float(np.linalg.norm(used - centre, axis=1).max())
    if not size > 0:
        raise ValueError("a mesh without extent cannot be cast at")
    vertices = (mesh.vertices - centre) / size
    faces = np.ascontiguousarray(mesh.faces, np.int32)
    return CastingMesh(centre, size, np.ascontiguousarray(vertices), faces, EmbreeCaster(vertices, faces))


def casting_mesh(mesh: Mesh) -> CastingMesh:
    """The mesh made ready for casting, kept by content for the last 32. Raises ValueError for a corrupt mesh."""
    return _casting_mesh(_ByContent.of(mesh))


def enclosing(body: PlacedTarget) -> tuple[Floats, float]:
    """Centre (xyz) in the world and radius (m) of a sphere a little larger than the body."""
    ready = casting_mesh(body.mesh)
    return np.asarray(body.pose.to_world(ready.centre)), (1.0 + 1e-5) * ready.size


def first_hit(mesh: Mesh, origin: Floats, direction: Floats) -> tuple[Ints, Floats]:
    """Facet (ray,) that each ray meets first, and its distance (m); -1 and NaN where it meets none.

    origin, direction: (ray, xyz) in the frame of the mesh; directions of any length. The point hit is origin +
    distance * unit direction, its normal mesh.normal[facet]. Raises ValueError for rays that are not finite or have no
    direction.
    """
    o, d = np.asarray(origin, float), np.asarray(direction, float)
    length = np.linalg.norm(d, axis=1)
    if not (np.isfinite(o).all() and np.isfinite(length).all() and (length > 0).all()):
        raise ValueError("rays need a finite origin and a direction")
    facet, distance = np.full(len(o), NO_TARGET), np.full(len(o), np.nan)
    if not len(mesh.faces) or not len(o):
        return facet, distance
    from sonarsynth.casting import intersections

    ready, (start, heading) = casting_mesh(mesh), np.empty((2, *o.shape))
    far, ray = np.linalg.norm(o - ready.centre, axis=1) + 2.0 * ready.size, np.empty(len(o), np.int64)
    count = intersections.into_mesh(
        o, o + (far / length)[:, None] * d, np.zeros(len(o), bool), facet, mesh.normal, np.empty((0, 8)), np.eye(3),
        np.zeros(3), ready.centre, ready.size, start, heading, far, ray,
    )  # fmt: skip
    ray, start = ray[:count], start[:count]
    facet[ray], along = ready.within(start, heading[:count], far[:count])
    distance[ray] = along * ready.size + np.linalg.norm(start * ready.size + ready.centre - o[ray], axis=1)
    return facet, distance


def faced_from(mesh: Mesh, rows: Ints, offset: float, place: Floats) -> tuple[Ints, Bools]:
    """Those of facets (row,) on whose outer side a place (xyz), in the frame of the mesh, is; and whether rays to it
    from their middles, moved off them by `offset` (m), meet the mesh again."""
    from sonarsynth.casting import intersections

    ready, count = casting_mesh(mesh), len(rows)
    (origin, heading), far, (facet, ray) = np.empty((2, count, 3)), np.empty(count), np.empty((2, count), np.int64)
    of_mesh = mesh.centroid, mesh.normal, ready.horizon(rows), offset, ready.centre, ready.size
    faced, count = intersections.off_facets(rows, place, *of_mesh, facet, origin, heading, far, ray)
    met = np.zeros(faced, bool)
    if count:
        met[ray[:count]] = ready.within(origin[:count], heading[:count], far[:count], any_hit=True)[0] >= 0
    return facet[:faced], met


def occluded(
    bodies: tuple[PlacedTarget, ...], start: Floats, end: Floats, owner: Ints | None = None, facet: Ints | None = None
) -> Bools:
    """Whether any body stands in each straight segment from start (segment, xyz) to end (segment, xyz) in the world.

    A segment that starts on a facet must be moved off it (`OFFSET`); where it does so in the middle, the number of its
    body, owner (segment,), and of the facet (segment,) spare rays that no part of that body can be in. Raises
    ValueError for ends that are not finite.
    """
    a, b = np.asarray(start, float), np.asarray(end, float)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ValueError("segments need finite ends")
    from sonarsynth.casting import intersections

    hidden = np.zeros(len(a), bool)
    origin, heading = np.empty((2, *a.shape))
    far, segment = np.empty(len(a)), np.empty(len(a), np.int64)
    for number, body in enumerate(bodies):
        if not len(body.mesh.faces):
            continue
        ready, pose = casting_mesh(body.mesh), body.pose
        own = np.full(len(a), NO_TARGET) if facet is None else np.where(owner == number, facet, NO_TARGET)
        horizon = np.empty((0, 8)) if facet is None else ready.horizon(own)
        count = intersections.into_mesh(
            a, b, hidden, own, body.mesh.normal, horizon, pose.rotation, pose.position, ready.centre, ready.size,
            origin, heading, far, segment,
        )  # fmt: skip
        if not count:
            continue
        hidden[segment[:count]] = ready.within(origin[:count], heading[:count], far[:count], any_hit=True)[0] >= 0
    return hidden


def facets_in_sight(body: PlacedTarget, bodies: tuple[PlacedTarget, ...], rows: Ints, to: Floats) -> tuple[Ints, Bools]:
    """Those of facets (row,) on whose outer side a place (xyz), world, is, and which of them no body hides from it."""
    mesh, pose, offset, others = body.mesh, body.pose, start_offset(body), _between(body, bodies, to)
    facet, hidden = faced_from(mesh, rows, offset, pose.to_body(to))
    if others:
        start = pose.to_world(mesh.centroid[facet] + offset * mesh.normal[facet])
        hidden |= occluded(others, start, alike(to, len(facet)))
    return facet, ~hidden


def _between(body: PlacedTarget, bodies: tuple[PlacedTarget, ...], to: Floats) -> tuple[PlacedTarget, ...]:
    """Those of other bodies that may hide one from a place (xyz), world: by spheres about their origins, with room
    for where rays start."""
    line, near = to - body.pose.position, []
    for other in bodies:
        away = other.pose.position - body.pose.position
        beside = away - min(max(float(away @ line) / max(float(line @ line), 1e-300), 0.0), 1.0) * line
        if other is not body and math.sqrt(beside @ beside) <= 1.001 * (body.mesh.radius + other.mesh.radius):
            near.append(other)
    return tuple(near)


def start_offset(body: PlacedTarget) -> float:
    """How far (m) off the facets of a body rays start: more than places in the world are rounded by."""
    farthest = float(np.abs(body.pose.position).max()) + body.mesh.radius
    return max(OFFSET * body.mesh.radius, 8.0 * np.finfo(float).eps * farthest)
