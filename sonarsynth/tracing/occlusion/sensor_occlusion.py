"""What bodies hide from some hydrophones and not from others: seen from each, not from the array centre alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sonarsynth.casting.cones import CLOSED, UNKNOWN
from sonarsynth.casting.shadows import hide
from sonarsynth.columns import alike, picked
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.scattering.lobes import dot
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.receiver import Elements
from sonarsynth.state import Medium, Receiver, Tolerances
from sonarsynth.tracing.occlusion.ray_cones import NO_CONE, classify_rays, hidden
from sonarsynth.tracing.receive_paths import DOUBTFUL, SEEN, ReceivePaths, Starts

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

RAYS, STRAIGHT_RAYS = 30_000, 500_000
"""Rays that are looked at together; of straight ones little is held."""
PARTS = 32
"""Parts of the array that are looked at as one where the whole does not see alike."""


@lru_cache(maxsize=16)
def rim(elements: Elements) -> Ints:
    """The hydrophones that are farthest out in 26 directions, ascending: where occlusion is looked at first."""
    towards = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if any(v)])
    return np.unique((elements.position @ towards.T).argmax(axis=0))


@dataclass(frozen=True, eq=False)
class Occlusion:
    """What stands between points in the water and those who look at them."""

    bodies: tuple[PlacedTarget, ...]
    bending: Medium  # what bends rays
    receiver: Receiver
    propagation: Propagation
    tolerances: Tolerances

    @property
    def elements(self) -> Elements | None:
        """Those who look; None: the array centre looks for all."""
        return self.receiver.elements if self.tolerances.occlusion == "sensors" else None

    def visible(self, legs: ReceivePaths, starts: Starts) -> ReceivePaths:
        """The legs that no body hides from the array centre; or, with elements, from every hydrophone, some of them
        open for `settled`, which finds those that are hidden from every one after all.

        starts (leg,): of the legs.
        """
        if self.elements is None or self.elements.count == 1 or not self.bodies:
            end = alike(self.receiver.pose.position, len(starts.point))
            ray = starts.point, end, legs.departure, legs.length
            of = starts.owner, starts.facet
            hides = hidden(self.bodies, self.bending, *ray, bounces=legs.bounces, turning=legs.turning, facets=of)
            return legs.select(picked(~hides))
        verdict = self._certain(legs, starts)
        in_sight, mixed = verdict != CLOSED, verdict == UNKNOWN
        centre = np.zeros(1, int)  # of those that stay open
        for kind, first in ((UNKNOWN, centre), (NO_CONE, np.append(centre, 1 + rim(self.elements)))):
            for rows in self._parts(legs, np.flatnonzero(verdict == kind), len(first)):
                unseen = self._unseen(legs, starts, rows, first)
                in_sight[rows] = ~unseen.all(axis=1)
                mixed[rows] |= unseen.any(axis=1)
        pending = np.where(mixed & ~in_sight & (verdict == UNKNOWN), DOUBTFUL, np.where(mixed, SEEN, 0))
        rows = np.flatnonzero(in_sight | (pending == DOUBTFUL))
        none = np.zeros((len(rows), 1 + self.elements.count // 8), np.uint8)
        return legs.select(rows).but(occluded=none, open=pending[rows])

    def settled(self, legs: ReceivePaths, starts: Starts) -> ReceivePaths:
        """The same legs, none of them open: those that are, looked at from each hydrophone, and left out where none
        sees them; arguments as above.

        That is left until it is known which of them count: of facets that are neither lit nor loud, none.
        """
        rows = np.flatnonzero(legs.open)
        if not len(rows):
            return legs
        occluded, in_sight = legs.occluded.copy(), np.ones(len(legs.row), bool)
        for block in self._parts(legs, rows, len(self._points)):
            dark = self._dark(legs, starts, block)
            occluded[block], in_sight[block] = np.packbits(dark, axis=1), ~dark.all(axis=1)
        return legs.but(occluded=occluded, open=np.zeros_like(legs.open)).select(picked(in_sight))

    @property
    def _points(self) -> Floats:
        """(1 + sensor, xyz) the array centre, and the hydrophones."""
        return np.concatenate([np.zeros((1, 3)), self.elements.position if self.elements else np.empty((0, 3))])

    def _certain(self, legs: ReceivePaths, starts: Starts) -> Ints:
        """(leg,) EMPTY where all hydrophones see it, CLOSED where none does; elsewhere UNKNOWN or NO_CONE."""
        return self._cones(legs, starts, np.full(len(legs.row), 1.001 * np.linalg.norm(self._points, axis=1).max()))

    def _cones(self, legs: ReceivePaths, starts: Starts, spread: Floats, offset: Floats | None = None) -> Ints:
        """(leg,) as `_certain`, of the hydrophones within `spread` (leg,) of the centre or of places beside it (leg,
        xyz)."""
        away, length, end = legs.departure, legs.length, alike(self.receiver.pose.position, len(spread))
        if offset is not None:
            (away, length), end = _towards(length, away, legs.bounces, offset), end + offset
        verdict, rows = np.full(len(away), UNKNOWN), np.arange(len(away))
        if starts.normal is not None:
            ahead = dot(starts.normal, away) * length  # m on the outer side of the facet
            verdict[ahead < -spread] = CLOSED
            rows = np.flatnonzero(ahead > spread)
        leaving = starts.select(rows)
        verdict[rows] = classify_rays(
            self.bodies, self.bending, leaving.point, *(of.take(rows, axis=0) for of in (end, away, length, spread)),
            bounces=legs.bounces[rows], turning=legs.turning[rows], facets=(leaving.owner, leaving.facet),
        )  # fmt: skip
        return verdict

    def _dark(self, legs: ReceivePaths, starts: Starts, rows: Ints) -> Bools:
        """(row, 1 + sensor) from where some legs are hidden: the array centre, each hydrophone. Parts of the array that
        see alike are looked at together."""
        every, parts = np.arange(len(self._points)), cells(self.elements)
        row, part = np.repeat(rows, len(parts.radius)), np.tile(np.arange(len(parts.radius)), len(rows))
        offset = self.receiver.pose.turn_to_world(parts.centre).take(part, axis=0)
        verdict = self._cones(legs.select(row), starts.select(row), parts.radius[part], offset)
        verdict = verdict.reshape(len(rows), len(parts.radius))[:, parts.cell]
        return np.asarray((verdict == CLOSED) | self._unseen(legs, starts, rows, every, verdict >= UNKNOWN))

    def _straight(self, legs: ReceivePaths) -> bool:
        """Whether legs are straight lines from end to end."""
        return self.bending.profile.uniform and not legs.bounces.any()

    def _parts(self, legs: ReceivePaths, rows: Ints, points: int) -> list[Ints]:
        """Rows in parts, so that few rays to so many points are held at a time."""
        most = STRAIGHT_RAYS if self._straight(legs) else RAYS
        return np.array_split(rows, max(1, len(rows) * points // most))

    def _unseen(self, legs: ReceivePaths, starts: Starts, rows: Ints, point: Ints, look: Bools | None = None) -> Bools:
        """(row, point) which of some legs leave the back of their facets, or meet a body, on the way to some points:
        the centre, or the hydrophones from 1. Of those to look at, if not all.

        To each point a ray leaves for where it is beside the image of the array centre, which is exact for straight
        rays. Bent ones leave off that by the size of the array over the distance, times what their spreading differs
        from that of straight ones: by 3e-4 rad in gradients of 3 per second, far less than diffraction blurs shadows.
        """
        look = np.ones((len(rows), len(point)), bool) if look is None else look
        normal = starts.normal
        if self._straight(legs):
            points, seen = self.receiver.pose.to_world(self._points[point]), look.copy()
            if normal is not None:
                seen &= normal[rows] @ points.T > dot(normal[rows], legs.point[rows])[:, None]
            hide(self.bodies, starts.point[rows], points, seen)
            return look & ~seen
        row, column = np.nonzero(look)
        leg, offset = rows[row], self.receiver.pose.turn_to_world(self._points[point]).take(column, axis=0)
        bounces, unseen = legs.bounces[leg], np.zeros(len(leg), bool)
        ahead, length = _towards(legs.length[leg], legs.departure.take(leg, axis=0), bounces, offset)
        if normal is not None:
            unseen = dot(ahead, normal.take(leg, axis=0)) <= 0.0
        ray = np.flatnonzero(~unseen)
        leaving, turning = starts.select(leg[ray]), legs.turning[leg[ray]]
        offset, ahead = offset.take(ray, axis=0), ahead.take(ray, axis=0)
        away = leaving.point, self.receiver.pose.position + offset, ahead, length[ray]
        own = leaving.owner, leaving.facet
        unseen[ray] = hidden(self.bodies, self.bending, *away, bounces=bounces[ray], turning=turning, facets=own)
        look[row, column] = unseen
        return look


def _towards(length: Floats, departure: Floats, bounces: Ints, offset: Floats) -> tuple[Floats, Floats]:
    """Unit vectors (leg, xyz) and distances (leg,) from the starts of legs of some length and departure to the images
    of places beside the centre (leg, xyz)."""
    ahead = length[:, None] * departure + offset
    odd = np.asarray(bounces % 2 == 1)
    ahead[odd, 2] -= 2.0 * offset[odd, 2]  # of the mirrored array
    length = np.sqrt(dot(ahead, ahead))
    return ahead / np.maximum(length, 1e-300)[:, None], length


class Cells(NamedTuple):
    """Parts of an array, its centre among them."""

    cell: Ints  # (1 + sensor,) which part it is in
    centre: Floats  # (cell, xyz) m
    radius: Floats  # (cell,) m, of all of it about the centre


@lru_cache(maxsize=16)
def cells(elements: Elements) -> Cells:
    """An array cut into parts by halves along their longer sides."""
    points = np.concatenate([np.zeros((1, 3)), elements.position])
    groups = [np.arange(len(points))]
    while len(groups) < min(PARTS, len(points) // 2):
        halves = []
        for group in groups:
            along = points[group, np.ptp(points[group], axis=0).argmax()]
            halves += np.array_split(group[np.argsort(along, kind="stable")], 2)
        groups = halves
    centre = np.array([0.5 * (points[group].min(axis=0) + points[group].max(axis=0)) for group in groups])
    away = zip(groups, centre, strict=True)
    radius = np.array([1e-6 + 1.001 * np.linalg.norm(points[group] - c, axis=1).max() for group, c in away])
    cell = np.empty(len(points), int)
    for number, group in enumerate(groups):
        cell[group] = number
    return Cells(cell, centre, radius)
