"""Tiles: groups of paths from nearly the same direction, chosen by their predicted cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.receiver import Elements
from sonarsynth.signals.array_paths import NEPER, Wavefronts, reference_of
from sonarsynth.signals.gridded.interpolation import Axes, box_nodes, columns
from sonarsynth.signals.gridded.low_rank import PLAIN, Term, terms_for
from sonarsynth.signals.gridded.nodes import MOST_NODES, SpectralQuantiles, nodes_for
from sonarsynth.signals.pulse_shapes import main_modes
from sonarsynth.signals.pulse_variation import PulseVariation, aperture_gradient, pulses, rest, slopes, steep
from sonarsynth.signals.segments import ends_of, steered_spread

MOST_TERMS = 24
"""A tile that needs more terms, of one mode of its pulses, is split."""

FEW = 4
"""So many paths are each steered to itself."""

LARGE_FAMILY = 500
"""Families of so many paths have tiles of their own: they are short, and have few modes."""

ALONE = 0.1
"""Share of the tolerance that nodes along each axis get of a path by itself: errors of many average out, not its."""


@dataclass(frozen=True, eq=False)
class TileSettings:
    """What the tiles are for: the array, its highest frequency, the spectral quantiles, and the error allowed."""

    elements: Elements
    highest: float  # Hz
    weights: SpectralQuantiles
    steepest: float  # largest change of absorption over the band, over that at the centre
    fading: float  # mean of it over the pulse
    tolerance: float
    changes: PulseVariation  # of pulses over the aperture
    bins: int
    circle: int  # samples of the deposit grid
    lasting: float  # samples of a pulse


@dataclass(frozen=True, eq=False)
class Tile:
    """Paths, the front that they are steered to, and the nodes and terms that represent them."""

    paths: Ints  # (path,)
    reference: Wavefronts  # one front, the middle of the tile; or the paths, each steered to itself
    axes: Axes | None  # nodes along x, y, z; None where the hydrophones themselves are the nodes
    terms: tuple[Term, ...]
    deviation: tuple[float, float, float]  # half range of direction y and z, and of absorption (dB)
    changes: Ints  # (some,) which of the changes of pulses over the aperture count, beside the reference
    modes: Floats  # (mode, mode) turn of the modes of all paths to those of the tile; (0, 0) where there are none
    spread: float  # s: no path meets a hydrophone sooner or later than its reference by more
    cost: float  # ns, predicted

    @property
    def alone(self) -> bool:
        """Whether each path is its own reference: nothing is deposited."""
        return self.reference.count == self.paths.size

    def nodes(self, elements: Elements) -> Floats:
        """Positions (node, xyz) where the field is synthesised, x slowest."""
        if self.axes is None:
            return elements.position
        x, y, z = self.axes
        return box_nodes(elements, (x.nodes, y.nodes, z.nodes))


class _Probes(NamedTuple):
    """Where directions are looked at: the corners of the array's box and its centre; near it, all hydrophones."""

    points: Floats  # (point, xyz)
    size: Floats  # (xyz) m: half of the box
    far: Floats  # (xyz) m: no hydrophone is farther from the array centre


@lru_cache(maxsize=16)
def _probes(elements: Elements, near: bool) -> _Probes:
    low, high = elements.position.min(axis=0), elements.position.max(axis=0)
    axes = [np.unique([a, b]) for a, b in zip(low, high, strict=True)]
    corners = np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    points = elements.position if near else np.concatenate([corners, 0.5 * (low + high)[None]])
    return _Probes(points, 0.5 * (high - low), np.maximum(np.abs(low), np.abs(high)))


@dataclass(frozen=True, eq=False)
class _Views:
    """What every tile that is tried looks at, computed once."""

    front: Wavefronts
    amplitude: Floats  # (degree, path) Pa: terms of each degree that it has over the aperture
    probes: _Probes
    gradient: Floats  # (xyz, point, term) of the aperture terms; empty where there are none
    bend: Floats  # (xyz, path) rad/m: how fast pulses change over the aperture (`pulse_variation.slopes`)
    own: bool  # no nodes can stand for the hydrophones: a source is within or about that box, or paths miss some


def _views(front: Wavefronts, aim: TileSettings) -> _Views:
    far = float(np.linalg.norm(_probes(aim.elements, False).far))
    probes = _probes(aim.elements, near := bool(front.curvature.max() * far > 0.8))
    gradient = aperture_gradient(front, probes.points)
    bend = slopes(front, gradient, aim.weights[0] * aim.highest, aim.highest)
    amplitude = np.multiply(np.abs(front.amplitude), front.expansion.amplitude_degrees.T, order="C")
    return _Views(front, amplitude, probes, gradient, bend, near)


class _Extent(NamedTuple):
    """What decides how a tile is represented, and what that costs."""

    paths: float  # how many
    phase: tuple[float, ...]  # (xyz) rad: half range at the highest frequency, over half of the box
    drift: tuple[float, ...]  # (xyz) rad, on top of it: the directivity of the reference varies too
    degrees: tuple[tuple[float, ...], ...]  # (xyz, degree) of the amplitude
    turn: tuple[float, float]  # half range of the face's argument in y and z at the highest frequency
    decay: float  # Np: half range of absorption, at the frequency where it differs most from that at the centre
    modes: tuple[float, ...]  # sizes of the modes of the pulses' shapes

    def half(self) -> _Extent:
        """The best that halving can give; in one direction it seldom gives as much."""
        y, z = self.turn
        phase, modes = tuple(0.5 * p for p in self.phase), (1.0, *(0.5 * m for m in self.modes[1:]))
        return _Extent(0.5 * self.paths, phase, self.drift, self.degrees, (0.5 * y, 0.5 * z), 0.5 * self.decay, modes)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A tile, and why it is as it is."""

    tile: Tile
    extent: _Extent | None  # None for a path alone
    ends: Floats  # (2, column) of its paths, with slownesses at the probes


def _try(paths: Ints, views: _Views, aim: TileSettings) -> _Trial:
    probes = views.probes
    low, high = ends = ends_of(views.front, paths, probes.points, views.gradient)
    if paths.size == 1:
        return _Trial(_alone(paths, views.front, aim), None, ends)
    over = rest(views.front, paths, aim.changes, 0.1 * aim.tolerance)
    reference = reference_of(views.front, 0.5 * (low + high), over.phase, over.delay_variance)
    own, _ = ends_of(reference, np.zeros(1, int), probes.points, views.gradient)
    far = np.maximum(high - own, own - low)
    slope = far[-3 * len(probes.points) :].reshape(-1, 3).max(axis=0)
    _, dy, dz = slope.tolist()
    wave = aim.highest / reference.sound_speed  # 1/m
    turn, loss = (aim.elements.face * wave * dy, aim.elements.face * wave * dz), float(far[4])
    bend = np.take(views.bend, paths, axis=1).max(axis=1)
    phase = np.full(3, np.inf) if views.own else (2.0 * np.pi * wave * slope + bend) * probes.size
    modes, sizes = np.zeros((0, 0)), PLAIN
    if views.front.modes.shape[1]:
        modes, sizes = main_modes(*pulses(views.front, paths, over, aim.changes))
    farther = views.front.attenuation * float(slope @ probes.far)  # dB
    degrees = np.take(views.amplitude, paths, axis=1).sum(axis=1)
    shares = tuple((degrees / max(float(degrees.sum()), 1e-300)).tolist())
    extent = _Extent(
        paths=paths.size,
        phase=tuple(phase.tolist()),
        drift=tuple(_drift(reference, aim).tolist()),
        degrees=tuple(shares if wide > 0.0 else (1.0,) for wide in probes.size.tolist()),
        turn=turn,
        decay=NEPER * (loss * aim.steepest + farther * aim.fading),
        modes=sizes,
    )
    axes, terms, cost = _cheapest(extent, aim)
    spread = steered_spread(views.front, ends)
    tile = Tile(paths, reference, axes, terms, (dy, dz, loss + farther), over.which, modes, spread, cost)
    return _Trial(tile, extent, ends)


def _drift(front: Wavefronts, aim: TileSettings) -> Floats:
    """Half range (xyz, rad) of the phase that is left over a face, along each axis of the box, the largest of fronts:
    du_j/dq_i is -(e_i - u_i u)_j k/n; and of what absorption varies by (Np). inf about the source."""
    _, size, far = _probes(aim.elements, False)
    k = front.curvature
    nearest = 1.0 - k * float(np.linalg.norm(far))
    if not nearest.min() > 0.2:
        return np.full(3, np.inf)
    scale = np.pi * aim.highest * aim.elements.face / front.sound_speed * k / nearest
    x, y, z = np.abs(front.direction.T)
    slack = 3.0 * (1.0 - nearest) / nearest  # u itself turns by a third of it
    change = np.array([x * (y + z), 1.0 - y * y + y * z, 1.0 - z * z + y * z])
    faded = NEPER * front.attenuation * aim.steepest
    faded = faded + np.sqrt(faded * k)  # a wave that bends as much as what a curved front loses
    return np.asarray((scale * np.minimum(change + slack, 1.21) + faded).max(axis=1) * size)


def _cheapest(extent: _Extent, aim: TileSettings) -> tuple[Axes | None, tuple[Term, ...], float]:
    """Nodes or the hydrophones themselves, terms, and the predicted time (ns) on one core at 3 GHz."""
    sensors, circle = aim.elements.count, aim.circle
    terms = terms_for(extent.turn, extent.decay, aim.weights, aim.tolerance, extent.modes)
    x, y, z = (
        nodes_for(p + d, aim.weights, aim.tolerance, a)
        for p, d, a in zip(extent.phase, extent.drift, extent.degrees, strict=True)
    )

    def work(nodes: int) -> float:
        per_node = extent.paths * (8.0 + 0.6 * len(terms)) + len(terms) * (1.4 * circle + 2.5 * aim.bins)
        return nodes * (per_node + 2.0 * circle) + 0.5 * sensors * circle + 4e5

    own, nodes = work(sensors), x.nodes * y.nodes * z.nodes
    few = max(x.nodes, y.nodes, z.nodes) <= MOST_NODES
    onto = 0.07 * nodes * columns(aim.elements)[0].size + 0.08 * z.nodes * sensors
    by_nodes = work(nodes) + onto * circle if few else np.inf
    crowded = np.inf if sum(not term[3] for term in terms) > MOST_TERMS else 1.0
    return ((x, y, z), terms, by_nodes * crowded) if by_nodes < own else (None, terms, own * crowded)


def _halves(trial: _Trial, views: _Views, aim: TileSettings) -> tuple[Ints, Ints] | None:
    """Two halves of a tile, cut across its widest extent in phase; None where all paths are alike."""
    size = np.append(views.probes.size + aim.elements.face, 0.5 * views.front.aperture**2)
    weight = np.append(2.0 * np.pi * aim.highest / views.front.sound_speed * size, NEPER * aim.steepest)
    paths, (low, high) = trial.tile.paths, trial.ends
    axis = int(np.argmax((high - low)[: weight.size] * weight))
    column = (*views.front.direction.T, views.front.curvature, views.front.loss)[axis]
    right = column[paths] > 0.5 * (low[axis] + high[axis])
    return (paths[~right], paths[right]) if right.any() else None


def tiles(front: Wavefronts, aim: TileSettings) -> list[Tile]:
    """The tiles of predicted least cost: each is halved while that pays; the first halving may pay only with the
    second. Paths that miss some hydrophones are apart: each of these is a node of their tiles."""
    apart = steep(front, aim.highest)
    chosen = [_alone(np.flatnonzero(apart), front, aim)] if apart.any() else []
    large = np.bincount(front.family) >= LARGE_FAMILY
    kind = front.family * large[front.family]
    kind[front.occluded.any(axis=1)] = -1
    groups = [(np.flatnonzero(~apart & (kind == of)), of < 0) for of in (0, *np.flatnonzero(large).tolist(), -1)]
    chosen += [_alone(paths, front, aim) for paths, _ in groups if 0 < paths.size <= FEW]
    if many := [group for group in groups if group[0].size > FEW]:
        views = _views(front, aim)
        chosen += [tile for paths, misses in many for tile in _tiles(paths, views, aim, misses)]
    return chosen


def _tiles(paths: Ints, views: _Views, aim: TileSettings, missed: bool) -> list[Tile]:
    """The tiles of paths of one kind."""
    front, views = views.front, replace(views, own=views.own or missed)
    trial = _try(paths, views, aim)
    if not missed:
        return _best(trial, views, aim, patient=True)
    best = [trial.tile] if _alone_pays(trial.tile, front, aim) else _best(trial, views, aim, patient=True)
    # halving seldom leads to single paths
    return [_alone(tile.paths, front, aim) if _alone_pays(tile, front, aim) else tile for tile in best]


def _alone_pays(tile: Tile, front: Wavefronts, aim: TileSettings) -> bool:
    """Whether the paths of a tile cost less one by one, each steered to the hydrophones that it does not miss."""
    missed = int(np.bitwise_count(front.occluded[tile.paths]).sum())
    return _cost_alone(tile.paths.size, missed, aim) < tile.cost


def _cost_alone(paths: int, missed: int, aim: TileSettings) -> float:
    """Predicted time (ns) of paths each steered to itself; missed: hydrophones that they do not reach, all together."""
    return 2e5 + 3e4 * paths + 1.2 * aim.lasting * (paths * aim.elements.count - missed)


def _alone(paths: Ints, front: Wavefronts, aim: TileSettings) -> Tile:
    """Paths that are each their own reference: nothing is deposited, and their directivity is all that varies."""
    reference, size = front.select(paths), _probes(aim.elements, False).size
    gradient = aperture_gradient(reference, _probes(aim.elements, True).points)
    bend = slopes(reference, gradient, aim.weights[0] * aim.highest, aim.highest).max(axis=1) * size
    x, y, z = (nodes_for(p, aim.weights, ALONE * aim.tolerance) for p in (_drift(reference, aim) + bend).tolist())
    axes = (x, y, z) if 2 * x.nodes * y.nodes * z.nodes < aim.elements.count else None
    cost, modes = _cost_alone(paths.size, 0, aim), np.eye(reference.modes.shape[1])
    return Tile(paths, reference, axes, ((0, 0, 0, 0),), (0.0, 0.0, 0.0), np.zeros(0, int), modes, 0.0, cost)


def _best(trial: _Trial, views: _Views, aim: TileSettings, patient: bool) -> list[Tile]:
    tile = trial.tile
    if trial.extent is None:
        return [tile]
    possible = tile.cost == np.inf or 2.0 * _cheapest(trial.extent.half(), aim)[2] < 0.9 * tile.cost
    halves = _halves(trial, views, aim) if possible else None
    if halves is None:
        return [tile]
    children = [_try(half, views, aim) for half in halves]
    best = [child.tile for child in children]
    if sum(t.cost for t in best) < tile.cost or patient or tile.cost == np.inf:
        best = [t for child in children for t in _best(child, views, aim, patient=tile.cost == np.inf)]
    return best if sum(t.cost for t in best) < tile.cost else [tile]
