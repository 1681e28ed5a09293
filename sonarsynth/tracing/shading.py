"""What bodies hide from some hydrophones and not from others: seen from each, not from the array centre alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry import Pose
from sonarsynth.sonar import Elements
from sonarsynth.tracing.legs import Legs
from sonarsynth.tracing.shadows import hidden
from sonarsynth.world.environment import Environment, Profile
from sonarsynth.world.moment import Body

_Hides = Callable[[Floats, Floats, Floats, Floats, Ints, Ints], Bools]
"""Which rays (ray,) bodies stand in: start, end, departure (ray, xyz), length, bounces, turning points (ray,)."""


RAYS = 30_000
"""Rays that are looked at together."""


@lru_cache(maxsize=16)
def rim(elements: Elements) -> Ints:
    """The hydrophones that are farthest out in 26 directions, ascending: where visibility is looked at first."""
    towards = np.array([v for v in product((-1.0, 0.0, 1.0), repeat=3) if any(v)])
    return np.unique((elements.position @ towards.T).argmax(axis=0))


def visible(
    legs: Legs,
    start: Floats,
    normal: Floats | None,
    bodies: tuple[Body, ...],
    environment: Environment,
    bending: Profile,
    sonar_pose: Pose,
    elements: Elements | None,
) -> Legs:
    """The legs that no body hides from the array centre; or, with elements, from every hydrophone, each leg with those
    that bodies hide it from, or as one that is open for `settled`.

    start (leg, xyz): of the legs, moved off their facets; normal (leg, xyz): of these, which legs leave on their outer
    side; None where they have none.
    """
    if elements is None or elements.count == 1 or not bodies:
        end = np.broadcast_to(sonar_pose.position, start.shape)
        ray = start, end, legs.departure, legs.length, legs.bounces, legs.turning
        return legs.select(~hidden(bodies, environment, bending, *ray))

    def hides(*ray: Any) -> Bools:
        return hidden(bodies, environment, bending, *ray)

    return _seen_at_all(legs, start, normal, sonar_pose, elements, hides)


def _seen_at_all(
    legs: Legs, start: Floats, normal: Floats | None, sonar_pose: Pose, elements: Elements, hides: _Hides
) -> Legs:
    """As `visible`. Where the centre and the rim of the array do not all see the same, legs are open; what only those
    within the rim see otherwise, through a gap say, is not found."""
    first = np.concatenate([np.zeros((1, 3)), elements.position[rim(elements)]])
    kept, mixed = np.zeros(len(legs.row), bool), np.zeros(len(legs.row), bool)
    for rows in _parts(np.arange(len(legs.row)), len(first)):
        unseen = _unseen(legs, start, normal, rows, sonar_pose, first, hides)
        kept[rows], mixed[rows] = ~unseen.all(axis=1), unseen.any(axis=1)
    none = np.zeros((np.count_nonzero(kept), 1 + elements.count // 8), np.uint8)
    return legs.select(np.flatnonzero(kept)).seen(none, mixed[kept])


def settled(
    legs: Legs,
    start: Floats,
    normal: Floats | None,
    bodies: tuple[Body, ...],
    environment: Environment,
    bending: Profile,
    sonar_pose: Pose,
    elements: Elements | None,
) -> Legs:
    """The same legs, none of them open: those that are, looked at from each hydrophone; arguments as of `visible`.

    That is left until it is known which of them count: of facets that are neither lit nor loud, none.
    """
    rows = np.flatnonzero(legs.open)
    if elements is None or not len(rows):
        return legs

    def hides(*ray: Any) -> Bools:
        return hidden(bodies, environment, bending, *ray)

    out, hidden_from = np.concatenate([np.zeros((1, 3)), elements.position]), legs.hidden_from.copy()
    for some in _parts(rows, len(out)):
        hidden_from[some] = np.packbits(_unseen(legs, start, normal, some, sonar_pose, out, hides), axis=1)
    return legs.seen(hidden_from, np.zeros(len(legs.row), bool))


def _parts(rows: Ints, points: int) -> list[Ints]:
    """Rows in parts, so that few rays to so many points are held at a time."""
    return np.array_split(rows, max(1, len(rows) * points // RAYS))


def _unseen(
    legs: Legs, start: Floats, normal: Floats | None, rows: Ints, sonar_pose: Pose, points: Floats, hides: _Hides
) -> Bools:
    """(row, point) which legs leave the back of their facets, or meet a body, on the way to points (point, xyz) of the
    sonar frame.

    To each point a ray leaves for where it is beside the image of the array centre: exact for straight rays, and for
    bent ones to the second order in the size of the array.
    """
    legs, offset = legs.select(rows), sonar_pose.turn_to_world(points)
    ahead = (legs.length[:, None] * legs.departure)[:, None] + offset
    odd = np.asarray(legs.bounces % 2 == 1)
    ahead[odd, :, 2] -= 2.0 * offset[:, 2]  # of the mirrored array
    length = np.linalg.norm(ahead, axis=2)
    ahead /= np.maximum(length, 1e-300)[:, :, None]
    unseen = np.zeros(length.shape, bool)
    if normal is not None:
        unseen = np.einsum("rpx,rx->rp", ahead, normal[rows]) <= 0.0
    leg, point = np.nonzero(~unseen)
    end = sonar_pose.position + offset[point]
    times, turns = legs.bounces[leg], legs.turning[leg]
    unseen[leg, point] = hides(start[rows[leg]], end, ahead[leg, point], length[leg, point], times, turns)
    return unseen
