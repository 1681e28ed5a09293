"""Tiles: groups of paths from nearly the same direction, chosen by their predicted cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.acoustics.arrays import aperture_terms
from sonarsynth.conventions import Floats, Ints
from sonarsynth.sonar import Elements
from sonarsynth.synthesis.expansion import MOST_NODES, Colour, Term, chebyshev, nodes_for, terms_for
from sonarsynth.synthesis.wavefront import Fronts

MOST_TERMS = 24
"""A tile that needs more terms is split."""


@dataclass(frozen=True, eq=False)
class Aim:
    """What the tiles are for: the array, its highest frequency, the pulse's colour, and the error allowed."""

    elements: Elements
    highest: float  # Hz
    weights: Colour
    steepest: float  # largest change of absorption over the band, over that at the centre
    tolerance: float
    bins: int
    circle: int  # samples of the deposit grid


@dataclass(frozen=True, eq=False)
class Tile:
    """Paths, the front that they are steered to, and the nodes and terms that represent them."""

    paths: Ints  # (path,)
    reference: Fronts  # one front: the middle of the tile
    shape: tuple[int, int, int]  # nodes along x, y, z; zeros where the hydrophones themselves are the nodes
    terms: tuple[Term, ...]
    deviation: tuple[float, float, float]  # half range of direction y and z, and of absorption (dB)
    cost: float  # ns, predicted

    def nodes(self, elements: Elements) -> Floats:
        """Positions (node, xyz) where the field is synthesised, x slowest."""
        if not self.shape[0]:
            return elements.position
        low, high = elements.position.min(axis=0), elements.position.max(axis=0)
        axes = [0.5 * (a + b) + 0.5 * (b - a) * chebyshev(n) for a, b, n in zip(low, high, self.shape, strict=True)]
        return np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)


def _probes(elements: Elements, near: bool) -> Floats:
    """Where directions differ most (point, xyz): corners and centre of the array's box; near it, all hydrophones."""
    if near:
        return elements.position
    low, high = elements.position.min(axis=0), elements.position.max(axis=0)
    axes = [np.unique([a, b]) for a, b in zip(low, high, strict=True)]
    corners = np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    return np.concatenate([corners, 0.5 * (low + high)[None]])


@dataclass(frozen=True, eq=False)
class _Views:
    """What every tile that is tried looks at, computed once: a tile is the smallest and the largest of each column."""

    front: Fronts
    columns: Floats  # (column, path): direction, curvature, absorption, terms; directions, slownesses at the probes
    probes: Floats  # (point, xyz)
    gradient: Floats  # (xyz, point, term) of the aperture terms; empty where there are none
    size: Floats  # (xyz) m: half of the box round the hydrophones
    near: bool  # a source is within or about that box, where no nodes can stand for the hydrophones


def _views(front: Fronts, elements: Elements) -> _Views:
    near = bool(front.curvature.max() * np.linalg.norm(np.abs(elements.position).max(axis=0)) > 0.8)
    probes, gradient = _probes(elements, near), np.zeros((3, 0, 0))
    if front.delay_terms.shape[1]:
        steps = 1e-4 * front.aperture * np.eye(3)
        sides = [[aperture_terms(probes + way * step, front.aperture) for way in (1, -1)] for step in steps]
        gradient = np.array([(ahead - behind) / (2e-4 * front.aperture) for ahead, behind in sides])
    size = 0.5 * np.ptp(elements.position, axis=0)
    return _Views(front, _columns(front, probes, gradient), probes, gradient, size, near)


def _columns(front: Fronts, probes: Floats, gradient: Floats) -> Floats:
    """Columns of `_Views` of fronts; slownesses (-c times the gradient of delay) only where they are not the
    directions."""
    v = front.direction.T - front.curvature * probes[:, :, None]  # (point, xyz, path)
    u = v / np.sqrt(v[:, 0] ** 2 + v[:, 1] ** 2 + v[:, 2] ** 2)[:, None]
    columns = [front.direction.T, front.curvature[None], front.loss[None], front.delay_terms.T, front.gain_terms.T]
    columns.append(u.reshape(-1, front.count))
    if front.delay_terms.shape[1]:
        slope = u - front.sound_speed * np.einsum("et,ipt->pie", front.delay_terms, gradient)
        columns.append(slope.reshape(-1, front.count))
    return np.ascontiguousarray(np.concatenate(columns))


def _reference(middle: Floats, one: bool, front: Fronts) -> Fronts:
    """The front in the middle of a tile, from its middle row."""
    norm = np.linalg.norm(middle[:3])
    direction = middle[:3] if one or norm < 0.1 else middle[:3] / norm
    terms = front.delay_terms.shape[1]
    return Fronts(
        delay=np.zeros(1),
        direction=direction[None] if norm >= 0.1 else np.array([[1.0, 0.0, 0.0]]),
        curvature=middle[3:4],
        amplitude=np.ones(1),
        loss=middle[4:5],
        delay_terms=middle[None, 5 : 5 + terms],
        gain_terms=np.zeros((1, front.gain_terms.shape[1])),
        sound_speed=front.sound_speed,
        aperture=front.aperture,
    )


def _tile(paths: Ints, views: _Views, aim: Aim) -> Tile:
    columns = np.take(views.columns, paths, axis=1)
    low, high = columns.min(axis=1), columns.max(axis=1)
    reference = _reference(0.5 * (low + high), paths.size == 1, views.front)
    own = _columns(reference, views.probes, views.gradient)[:, 0]
    far = np.maximum(high - own, own - low)
    probed = 3 * len(views.probes)
    at = 5 + views.front.delay_terms.shape[1] + views.front.gain_terms.shape[1]
    du = far[at : at + probed].reshape(-1, 3).max(axis=0)
    slope = far[-probed:].reshape(-1, 3).max(axis=0)
    c, face, loss = reference.sound_speed, aim.elements.face, float(far[4])
    # the directivity of the reference varies over the aperture too
    drift = np.pi * aim.highest * face / c * 0.5 * np.ptp(own[at : at + probed].reshape(-1, 3), axis=0)[1:].sum()
    phase = 2.0 * np.pi * aim.highest / c * slope * views.size + np.where(views.size > 0, drift, 0.0)
    turn = (face * aim.highest / c * float(du[1]), face * aim.highest / c * float(du[2]))
    terms = terms_for(turn, loss * np.log(10.0) / 20.0 * aim.steepest, aim.weights, aim.tolerance)
    if views.near:
        phase = np.full(3, np.inf)
    cubic = 2 if views.front.gain_terms.shape[1] else 0  # the amplitude is a cubic on top of the wave
    x, y, z = (
        nodes_for(float(p), aim.weights, aim.tolerance) + cubic * (s > 0)
        for p, s in zip(phase, views.size, strict=True)
    )
    shape, cost = _cheapest(paths.size, (x, y, z), len(terms), aim)
    return Tile(paths, reference, shape, terms, (float(du[1]), float(du[2]), loss), cost)


def _cheapest(paths: int, shape: tuple[int, int, int], terms: int, aim: Aim) -> tuple[tuple[int, int, int], float]:
    """Nodes or the hydrophones themselves, and the predicted time (ns) on one core at 3 GHz."""
    sensors, bins = aim.elements.count, aim.bins

    def work(nodes: int) -> float:
        per_deposit = 4.0 + 0.8 * terms
        return nodes * (paths * per_deposit + terms * (1.2 * aim.circle + 1.0 * bins)) + 2.0 * sensors * bins + 2e5

    own = work(sensors)
    nodes = int(np.prod(shape))
    by_nodes = work(nodes) + 0.04 * nodes * sensors * bins if max(shape) <= MOST_NODES else np.inf
    crowded = np.inf if terms > MOST_TERMS else 1.0
    return (shape, by_nodes * crowded) if by_nodes < own else ((0, 0, 0), own * crowded)


def _halves(paths: Ints, views: _Views, aim: Aim) -> tuple[Ints, Ints] | None:
    """Two halves of a tile, cut across its widest extent in phase; None where all paths are alike."""
    front = views.front
    size = np.append(views.size + aim.elements.face, 0.5 * front.aperture**2)
    weight = np.append(2.0 * np.pi * aim.highest / front.sound_speed * size, np.log(10.0) / 20.0 * aim.steepest)
    where = np.take(views.columns[:5], paths, axis=1)
    low, high = where.min(axis=1), where.max(axis=1)
    axis = int(np.argmax((high - low) * weight))
    right = where[axis] > 0.5 * (low[axis] + high[axis])
    if not right.any():
        return None
    return paths[~right], paths[right]


def tiles(front: Fronts, aim: Aim) -> list[Tile]:
    """The tiles of predicted least cost: each is halved while that pays; the first halving may pay only with the
    second."""
    views = _views(front, aim.elements)
    return _best(_tile(np.arange(front.count), views, aim), views, aim, patient=True)


def _best(tile: Tile, views: _Views, aim: Aim, patient: bool) -> list[Tile]:
    least = 4e5 + 4.0 * aim.elements.count * aim.bins  # two tiles cost this at least
    halves = None if tile.cost <= least else _halves(tile.paths, views, aim)
    if halves is None:
        return [tile]
    children = [_tile(half, views, aim) for half in halves]
    better = sum(t.cost for t in children) < tile.cost
    if better or patient or tile.cost == np.inf:
        children = [t for child in children for t in _best(child, views, aim, patient=tile.cost == np.inf)]
    return children if sum(t.cost for t in children) < tile.cost else [tile]
