"""Legs from points in the water to the array: the half of every path that does not depend on the snap."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, enclosing
from sonarsynth.columns import Columns, alike, picked, rows_of
from sonarsynth.conventions import Bools, Bytes, Floats, Ints, depth
from sonarsynth.description import FieldError
from sonarsynth.equations.kernels.placing import in_front, placed
from sonarsynth.equations.rays.ray_solutions import COINCIDENT, TOLERANCE
from sonarsynth.equations.scattering.lobes import dot
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Paths
from sonarsynth.propagation.images import family, with_own_images
from sonarsynth.propagation.reflections import Reflections, reflections
from sonarsynth.scattering import Scatterers
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.occlusion.ray_cones import layer_curvatures

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation


SEEN, DOUBTFUL = 1, 2
"""Legs of which it is not known which hydrophones bodies hide them from: by some they are seen, or maybe by none."""


@dataclass(frozen=True, eq=False)
class ReceivePaths(Columns):
    """Rays from points in the water to the array centre."""

    point: Floats  # (leg, xyz) m, world: where it starts
    row: Ints  # (leg,) which of the points asked for
    departure: Floats  # (leg, xyz) world
    arrival: Floats  # (leg, xyz) world
    direction: Floats  # (leg, xyz) sonar frame, from the array centre to where it seems to come from
    radius: Floats  # (leg,) m: of the reference sphere: the length of the ray
    travel_time: Floats  # (leg,) s
    length: Floats  # (leg,) m
    spreading: Floats  # (leg,) 1/m
    surface: Ints  # (leg,)
    bottom: Ints  # (leg,)
    turning: Ints  # (leg,)
    caustics: Ints  # (leg,)
    boundary: Floats  # (leg,) product of the moduli of reflection
    phase: Floats  # (leg,) rad of reflections and caustics
    delay_std: Floats  # (leg,) s
    occluded: Bytes  # (leg, byte) as of `Arrivals`
    open: Ints  # (leg,) not 0: bodies hide it from hydrophones, not known yet which (`sensor_occlusion.Occlusion`)

    @cached_property
    def bounces(self) -> Ints:
        """(leg,) reflections from surface and bottom."""
        return np.asarray(self.surface + self.bottom)

    @property
    def family(self) -> Ints:
        """(leg,) as `images.family`."""
        return family(self.surface, self.bottom, self.departure[:, 2] < 0.0)

    def by(self, families: Iterable[int] | None) -> ReceivePaths:
        """The legs by some families (None: all)."""
        return self if families is None else self.select(np.flatnonzero(np.isin(self.family, list(families))))


@dataclass(frozen=True, eq=False)
class Facets(Columns):
    """All surface elements of a frame, placed in the world."""

    owner: Ints  # (facet,) index into `FrameContext.scattering`: of the body, where it has one
    facet: Ints  # (facet,) index among those of its owner
    point: Floats  # (facet, xyz) m: centroid
    clear: Floats  # (facet, xyz) m: the centroid moved off its facet
    normal: Floats  # (facet, xyz)

    def starts(self, row: Ints, departure: Floats) -> Starts:
        """Where legs (leg, xyz) that depart so start, of facets (row of each): one without a normal has their
        departure."""
        normal = rows_of(self.normal, row)
        sideless = self.sideless
        normal = np.where(sideless[row, None], departure, normal) if sideless.any() else normal
        return Starts(rows_of(self.clear, row), normal, rows_of(self.owner, row), rows_of(self.facet, row))

    def lit(self, row: Ints, arrival: Floats) -> Bools:
        """Whether paths that arrive along (path, xyz) light facets (row of each): from their side, if they have one."""
        return np.asarray((dot(rows_of(self.normal, row), arrival) < 0) | self.sideless[row])

    @cached_property
    def sideless(self) -> Bools:
        """(facet,) which scatter all round: they have no normal."""
        x, y, z = self.normal.T
        return np.asarray((x == 0.0) & (y == 0.0) & (z == 0.0))


@dataclass(frozen=True, eq=False)
class Starts(Columns):
    """Where legs start; without normals: anywhere in the water."""

    point: Floats  # (leg, xyz) m, world: clear of the facet that it is on
    normal: Floats | None = None  # (leg, xyz) of the side of it that the leg leaves on
    owner: Ints | None = None  # (leg,) of that facet, in whose middle it starts
    facet: Ints | None = None  # (leg,)


T = TypeVar("T", ReceivePaths, Facets)


def concatenate(blocks: list[T]) -> T:
    """All rows of some blocks, in order; the list is emptied, so that no more than a column is there twice."""
    if len(blocks) == 1:
        return blocks.pop()
    kind, columns = type(blocks[0]), [dict(vars(block)) for block in blocks]
    blocks.clear()
    return kind(**{name: np.concatenate([block.pop(name) for block in columns]) for name in kind.__dataclass_fields__})


def usable(paths: Paths) -> Bools:
    """Paths with a direction and a finite amplitude: not between coincident ends, nor exactly on a caustic."""
    return np.asarray((paths.flag != COINCIDENT) & np.isfinite(paths.spreading))


def rays_to_centre(
    point: Floats, medium: Medium, receiver: Receiver, propagation: Propagation,
    chosen: Callable[[Paths], Bools] = usable, own_images: bool = False,
) -> ReceivePaths:  # fmt: skip
    """Rays from points (point, xyz) in the world to the array centre, sorted by point: all, or those that are chosen
    (path,) of the usable ones; own_images: the points are one source, heard as of `with_own_images`. Raises FieldError
    for an array that has moved out of the water."""
    if receiver.track is not None and not receiver.track.still:
        down = depth(receiver.pose.to_world(receiver.elements.position))
        ends, path = (float(down.min()), float(down.max())), ("scene", "trajectory", "sonar")
        _require_between(path, "the array, where it hears sound,", *ends, medium.depth)
    end = alike(receiver.pose.position, len(point))
    paths = propagation.checked_paths(medium.profile, medium.depth, point, end)
    paths = paths.select(picked(usable(paths) & chosen(paths)))
    if own_images:
        paths, _ = with_own_images(paths, float(depth(point[0])), medium.depth)
    start = rows_of(point, paths.pair)
    bounced: Reflections = reflections(medium.environment, medium.profile, paths, receiver.centre)
    return ReceivePaths(
        point=start,
        row=paths.pair,
        departure=paths.departure,
        arrival=paths.arrival,
        direction=-receiver.pose.turn_to_body(paths.arrival),
        radius=paths.length,
        travel_time=paths.travel_time,
        length=paths.length,
        spreading=paths.spreading,
        surface=paths.surface,
        bottom=paths.bottom,
        turning=paths.turning,
        caustics=paths.caustics,
        boundary=bounced.modulus,
        phase=bounced.phase,
        delay_std=bounced.delay_std,
        occluded=np.zeros((len(start), 0), np.uint8),
        open=alike(0, len(start)),
    )


def require_in_water(bodies: tuple[PlacedTarget, ...], bottom: float) -> None:
    """Raises FieldError for a body that reaches out of water of that depth (m)."""
    for number, body in enumerate(bodies):
        middle, radius = enclosing(body)
        if radius <= -middle[2] <= bottom - radius:
            continue
        highest, deepest = bottom, 0.0
        for rows in in_blocks(len(body.mesh.vertices)):
            down = depth(body.pose.to_world(body.mesh.vertices[rows]))
            highest, deepest = float(down.min(initial=highest)), float(down.max(initial=deepest))
        path = ("scene", "world", "targets", number, "motion")
        _require_between(path, f"target '{body.name}'", highest, deepest, bottom)


def _require_between(path: tuple[str | int, ...], what: str, highest: float, deepest: float, bottom: float) -> None:
    if highest < -TOLERANCE or deepest > bottom + TOLERANCE:
        where = "above the surface" if highest < -TOLERANCE else "below the bottom"
        raise FieldError(path, f"{what} reaches {where} ({highest:g} to {deepest:g} m in {bottom:g} m)")


def facets_of(
    scattering: tuple[Scatterers, ...], block: slice, chosen: Callable[[int, Ints], Ints] = lambda _, rows: rows
) -> Facets:
    """Some of the surface elements of all, one owner after the other; chosen: of an owner's, by its number."""
    last = np.cumsum([0, *map(len, scattering)])
    of = [np.arange(max(block.start - n, 0), min(block.stop, m) - n) for n, m in pairwise(last.tolist())]
    of = [chosen(number, rows) for number, rows in enumerate(of)]
    owner, none = np.repeat(np.arange(len(scattering)), [len(rows) for rows in of]), np.empty((0, 3))
    places = [(none, none, none)] + [
        placed(rows, s.position, s.normal, s.pose.rotation, s.pose.position, OFFSET * s.offset)
        for s, rows in zip(scattering, of, strict=True)
    ]
    point, normal, clear = (np.concatenate(column) for column in zip(*places, strict=True))
    return Facets(owner, np.concatenate([np.empty(0, np.int64), *of]), point, clear, normal)


def receive_paths(
    facets: Facets, medium: Medium, receiver: Receiver, propagation: Propagation, slack: float = 0.0,
    lit: Ints | None = None,
) -> ReceivePaths:  # fmt: skip
    """Facet to array: rays that leave a facet on its outer side, whether or not a body stands in them; rows are facets.

    Or that may on their way to a point within `slack` (m) of the array centre. lit (row,): facets that have direct
    light; of others no rays with all reflections are wanted. None: of all.
    """
    direct = np.full(len(facets.facet), lit is None)
    direct[[] if lit is None else lit] = True

    def chosen(paths: Paths) -> Bools:
        ahead = dot(rows_of(facets.normal, paths.pair), paths.departure) * paths.length
        seen = np.asarray((ahead > -slack) | facets.sideless[paths.pair])
        return seen & (direct[paths.pair] | (paths.surface + paths.bottom < propagation.bounces))

    return rays_to_centre(facets.point, medium, receiver, propagation, chosen)


def may_face_receiver(facets: Facets, position: Floats, bounces: int, medium: Medium, slack: float = 0.0) -> Ints:
    """Those (facet,) that may have a ray on their outer side to a point (xyz), or within `slack` (m) of it; exactly so
    in uniform water, unreflected.

    A curve of curvature k leaves its chord of r m by an angle of sine k r/2 at most (Schur's theorem: for k r < 0.6 no
    ray without reflections is longer than half a circle). Others rise and fall by (bounces + 2) bottom depths at most
    over their distance, so somewhere they have that slope or less, and by Snell's law their cosine is nowhere less than
    there times the ratio of the extreme sound speeds.
    """
    bend = 0.0 if bounces or medium.profile.uniform else float(layer_curvatures(medium.profile)[1].max())
    farthest = np.sqrt(((facets.point - position) ** 2).sum(axis=1).max(initial=0.0)) if bend else 0.0
    if not bounces and bend * farthest < 0.6:
        every, bow = np.arange(len(facets.facet)), 0.5 * bend * farthest**2
        return np.asarray(in_front(every, facets.point, facets.normal, position, slack + bow, np.empty((0, 3))))
    level = position[:2] - facets.point[:, :2]
    distance = np.sqrt(level[:, 0] ** 2 + level[:, 1] ** 2)
    flattest = distance / np.sqrt(distance**2 + ((bounces + 2) * medium.depth) ** 2)
    cosine = flattest * medium.profile.speed.min() / medium.profile.speed.max()
    ahead = np.einsum("ij,ij->i", facets.normal[:, :2], level) / np.maximum(distance, 1e-300)
    steepest = np.abs(facets.normal[:, 2]) * np.sqrt((1.0 - cosine) * (1.0 + cosine))
    margin = 1e-9 + slack / np.maximum(distance, 1e-300)
    return np.flatnonzero((ahead >= -margin) | (ahead * cosine + steepest > -margin))
