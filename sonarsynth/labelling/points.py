"""Whose echo each point of a cloud is: the paths of the frame, as its beam hears them at its delay.

A path brings a beam its spectrum times the pattern of the array, with its focus and grating lobes, between the two
directions; paths of one snap, target and family are summed with their phases over a band of frequencies that is matched
to the pulse as ranging does it, at the delay of the point. The group that gives most power there made the point.

Against signals of each group alone, beamformed as the sonar does: the same group in all points whose two loudest are
3 dB apart (`tests/laws/test_labels_of_points.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sonarsynth.acoustics.arrays import live_gain
from sonarsynth.acoustics.facet_pulses import facet_response
from sonarsynth.conventions import NO_TARGET, Bools, Floats, Ints, direction
from sonarsynth.geometry import Pose
from sonarsynth.labelling import points_kernels as kernels
from sonarsynth.labelling.band import Band
from sonarsynth.products import FAMILIES, ORIGINS, Arrivals, PointCloud, PointLabels
from sonarsynth.sonar import Elements
from sonarsynth.sonar.mirrors import mirror_normal
from sonarsynth.world.casting import casting_mesh
from sonarsynth.world.moment import Body, Moment

GATE = 2.5
"""Of 1/bandwidth: how far in time from a point a path still adds to it. A raised cosine in frequency is heard for 2."""
MOST_BINS = 48
"""Frequencies that paths are summed at: enough for echoes that cross the largest array through its side lobes."""
OVERSAMPLING = 8
"""Of the pattern of a lattice: 16 values for each of its columns. Bilinear between them: 0.5 % of the main lobe."""
WIDEST_DEFOCUS = 40
"""Tables either side of the focus: what is further out of focus is taken for as far."""
WHITENING = 0.03
"""Share of the pulse's largest power density below which ranging flattens it no more (`ranging.echoes`)."""
FIRST_NULL = 1.9
"""rad of phase, root mean square over the aperture, at the first null of a beam: 1.915 of a disc, 1.81 of a line."""
FAINT = 1e-3
"""Of the power of all paths of a snap, target and way that the faintest may bring together, and are left out: 30 dB
under echoes of which ranging takes the loudest 12 dB."""
EXPLAINED = 0.01
"""Of the energy of its beam that the paths of a frame must bring a point, or noise made it: one resolution in a hundred
of the echo window. A peak of noise that is ranged has 0.03 of all noise in the window of shipped scenes."""


@dataclass(frozen=True, eq=False)
class Listening:
    """How the sonar listens and what it knows of the frame's clock."""

    elements: Elements
    sound_speed: float  # m/s that beams are steered by
    focus: float | None  # m
    clock: float  # s: arrival of the direct pulse that delays are counted from
    pose: Pose
    velocity: Floats  # (xyz) m/s of the array, world


@lru_cache(maxsize=16)
def _table(elements: Elements, level: int) -> np.ndarray:
    """Pattern (row step, column step) of a lattice over two periods of its grating lobes, so far out of focus."""
    size = OVERSAMPLING * 2 * max(elements.rows, elements.columns)
    weights = np.zeros((size, size), complex)
    live = np.flatnonzero(elements.gain)
    bulge = level * kernels.RIM_STEP * np.sum((elements.position[live] / elements.aperture) ** 2, axis=1)
    y = (elements.columns - 1 - 2 * elements.column[live]) % size
    z = (elements.rows - 1 - 2 * elements.row[live]) % size
    weights[z, y] = live_gain(elements.gain)[live] * np.exp(-1j * bulge)
    return (np.fft.ifft2(weights) * size**2).astype(np.complex64)


@lru_cache(maxsize=16)
def _tables(elements: Elements, low: int, high: int) -> np.ndarray:
    return np.stack([_table(elements, level) for level in range(low, high + 1)])


def pattern_of(elements: Elements, speed: float, curvature: Floats, focus: float, top: float) -> kernels.Pattern:
    """Pattern of an array for waves of curvature (path,) 1/m where beams are focused at `focus` (1/m), up to `top`
    (Hz): tables for a lattice, its sensors elsewhere."""
    live = np.flatnonzero(elements.gain)
    sensors = elements.position[live] / speed, live_gain(elements.gain)[live]
    if not (elements.on_lattice and elements.aperture > 0.0):
        return kernels.Pattern(np.zeros((0, 0, 0), np.complex64), 0, 1.0, 0.0, *sensors)
    step = kernels.RIM_STEP * speed / (np.pi * elements.aperture**2)
    ends = np.clip(np.rint(top * (curvature - focus) / step), -WIDEST_DEFOCUS, WIDEST_DEFOCUS)
    low, high = int(min(ends.min(initial=0.0), 0.0)), int(max(ends.max(initial=0.0), 0.0))
    return kernels.Pattern(_tables(elements, low, high), low, step, elements.pitch / speed, *sensors)


@dataclass(frozen=True, eq=False)
class Attribution:
    """Whose energy beams hold at delays: groups of paths of one target, snap and way to the array."""

    paths: Arrivals  # that may be heard, ascending in delay
    first: Ints  # (point,) the first path that may be heard then
    target: Ints  # (group,) -1: the snap itself
    snap: Ints  # (group,)
    family: Ints  # (group,) index into FAMILIES
    power: Floats  # (point, group) at the delay, in any unit
    energy: Floats  # (point, group) Pa2 s about it
    owner: Ints  # (point,) the loudest group, -1 without any
    share: Floats  # (point, path from first on) of the power of the loudest group


def attribution(
    arrivals: Arrivals, band: Band, listening: Listening, beam: Floats, late: Floats, most: Floats
) -> Attribution:
    """Whose energy beams (point, xyz) hold at delays (point,) s after the clock; most: (point,) Pa2 s in each beam.

    The snap itself, not by a target, is taken to bring no more than echoes leave of that: the sonar may have taken it
    out (`ranging.WavefrontCancelling`).
    """
    elements, width = listening.elements, band.high - band.low
    gate, reach = GATE / width, elements.aperture / listening.sound_speed
    moment = _clock(arrivals, listening.clock, gate) + late
    longer = float(np.abs(arrivals.corners).max(initial=0.0))
    slowness = listening.sound_speed / arrivals.sound_speed
    across = gate + reach * _apart(slowness * arrivals.direction, beam)
    window = np.array([[-1.0], [1.0]]) * (across + longer)
    ends = np.searchsorted(np.sort(moment), arrivals.delay + window)
    some = np.flatnonzero(_loud(arrivals, len(band.energy)) & (ends[1] > ends[0]))
    paths = arrivals.select(some[np.argsort(arrivals.delay[some], kind="stable")])
    first, last = np.searchsorted(paths.delay, moment + window)
    _, example, group = np.unique(_code(paths, len(band.energy)), return_index=True, return_inverse=True)
    groups = paths.target[example], paths.snap[example], paths.arrives_by[example]
    if not len(some):
        return Attribution(paths, first, *groups, *_silence(len(beam)))
    across = gate + reach * _apart(slowness * paths.direction, beam)
    fine = band.sliced(min(2.0 * width * across, MOST_BINS))
    focus = 0.0 if listening.focus is None else 1.0 / listening.focus
    curvature, pulse = 1.0 / paths.radius, fine.energy[groups[1]]
    found = kernels.attribute(
        beam,
        moment,
        0.5 * most,  # at positive frequencies
        first,
        last,
        paths.direction,
        slowness,
        paths.delay,
        curvature,
        np.abs(paths.corners).max(axis=1),
        group,
        groups[0] < 0,
        _spectra(paths, elements, fine),
        _matched(fine)[groups[1]],
        pulse,
        fine.frequency,
        focus,
        listening.sound_speed,
        gate,
        reach,
        pattern_of(elements, listening.sound_speed, curvature, focus, band.high),
    )
    return Attribution(paths, first, *groups, found[0], 2.0 * found[1], *found[2:])


def _code(paths: Arrivals, snaps: int) -> Ints:
    """Number (path,) of the target, snap and way to the array of each."""
    return np.asarray(((paths.target + 1) * snaps + paths.snap) * len(FAMILIES) + paths.arrives_by)


def _loud(arrivals: Arrivals, snaps: int) -> Bools:
    """(path,) without those that together bring `FAINT` of the power of their group at most."""
    power, code = arrivals.amplitude**2, _code(arrivals, snaps)
    order = np.lexsort((power, code))
    up_to = np.cumsum(power[order])
    start = np.searchsorted(code[order], code[order])  # the first of each group
    total = np.bincount(code, power)[code[order]]
    loud = np.empty(len(power), bool)
    loud[order] = up_to - up_to[start] + power[order][start] > FAINT * total
    return loud


def _apart(one: Floats, other: Floats) -> float:
    """Bound on how far vectors (row, xyz) are from others, two at most."""
    if not (len(one) and len(other)):
        return 0.0
    far = np.maximum(one.max(axis=0) - other.min(axis=0), other.max(axis=0) - one.min(axis=0))
    return min(float(np.linalg.norm(far)), 2.0)


def _silence(points: int) -> tuple[Floats, Floats, Ints, Floats]:
    return np.zeros((points, 0)), np.zeros((points, 0)), np.full(points, NO_TARGET), np.zeros((points, 1))


def _clock(arrivals: Arrivals, clock: float, gate: float) -> float:
    """When (s) the direct pulse that delays are counted from arrives: as traced, where one does at that time."""
    direct = arrivals.delay[arrivals.direct & (arrivals.surface + arrivals.bottom == 0)]
    if not len(direct):
        return clock
    near = float(direct[np.argmin(np.abs(direct - clock))])
    return near if abs(near - clock) < gate else clock


def _spectra(paths: Arrivals, elements: Elements, band: Band) -> kernels.Complexes:
    """Spectra (path, bin) that elements hear, over that of the snap at 1 m, without delay."""
    amplitude = paths.amplitude
    if paths.hidden_from.shape[1]:  # of the array, as much as sees it
        hidden = np.bitwise_count(paths.hidden_from).sum(axis=1) - (paths.hidden_from[:, 0] >= 128)
        amplitude = amplitude * (1.0 - hidden / elements.count)
    sine = paths.direction[:, 1:] * (elements.face / paths.sound_speed)
    frequency = band.frequency
    heard = kernels.path_spectra(
        amplitude, paths.phase, paths.blur, paths.absorption, sine, frequency, band.relative
    )
    shaped = paths.coherent | paths.corners.any(axis=1) | (paths.rough_share > 0.0)
    if shaped.any():
        columns = (getattr(paths, name)[shaped] for name in ("coherent", "corners", "rough_share", "rough_delay"))
        heard[shaped] *= facet_response(frequency, *columns, paths.centre)
    return heard


def _matched(band: Band) -> Floats:
    """Amplitude (snap, bin) of pulses in what ranges them: flattened by the mean pulse, and a raised cosine."""
    mean = band.weight.mean(axis=0)
    taper = np.sin(np.pi * (np.arange(len(mean)) + 0.5) / len(mean)) ** 2
    return np.asarray(np.sqrt(band.energy * mean) * (taper / (mean + WHITENING * mean.max())))


def label_points(
    cloud: PointCloud,
    azimuth: Floats,
    elevation: Floats,
    arrivals: Arrivals,
    band: Band,
    moment: Moment,
    listening: Listening,
) -> PointLabels:
    """Labels of the points of a cloud on a grid of azimuth and elevation (rad).

    arrivals: paths of the frame; band: what each snap sends in the sonar's band; moment: the world at the instant of the
    frame. Bodies and the array are where sound meets them.
    """
    row, column = np.nonzero(np.isfinite(cloud.range))
    beam = direction(azimuth[column], elevation[row])
    late, most = (grid[row, column].astype(float) for grid in (cloud.delay, cloud.energy))
    found = attribution(arrivals, band, listening, beam, late, most)
    explained = (found.owner >= 0) & (found.energy.sum(axis=1) >= EXPLAINED * most)
    labels = {
        "target": np.full(len(row), NO_TARGET, np.int16),
        "emission": np.full(len(row), NO_TARGET, np.int16),
        "family": np.full(len(row), NO_TARGET, np.int8),
        "facet": np.full(len(row), NO_TARGET, np.int32),
        "true_range": np.full(len(row), np.nan, np.float32),
        "distance": np.full(len(row), np.nan, np.float32),
        "origin": np.full(len(row), ORIGINS.index("unexplained"), np.int8),
    }
    some = np.flatnonzero(explained)
    owner, loudest = found.owner[some], found.first[some] + found.share[some].argmax(axis=1)
    for name in ("target", "emission", "family"):
        labels[name][some] = getattr(found, "snap" if name == "emission" else name)[owner]
    labels["facet"][some] = found.paths.facet[loudest]
    labels["origin"][some] = _origins(found.paths.select(loudest), beam[some], listening, band)
    echo = np.flatnonzero(labels["target"] >= 0)
    places = cloud.position[row, column][echo].astype(float)
    near = _from_targets(found, echo, places, moment, listening)
    labels["true_range"][echo], labels["distance"][echo] = near
    return PointLabels(**{name: _on_grid(values, row, column, cloud.range.shape) for name, values in labels.items()})


def _on_grid(values: np.ndarray, row: Ints, column: Ints, shape: tuple[int, ...]) -> np.ndarray:
    grid = np.full(shape, NO_TARGET if values.dtype.kind == "i" else np.nan, values.dtype)
    grid[row, column] = values
    return grid


def _origins(paths: Arrivals, beam: Floats, listening: Listening, band: Band) -> Ints:
    """Index into ORIGINS (point,) of what beams (point, xyz) hear of the paths (point,) that bring most."""
    elements, centre = listening.elements, 0.5 * (band.low + band.high)
    spread = _spread(elements)
    apart = paths.direction / paths.sound_speed - beam / listening.sound_speed  # s/m
    found = np.full(len(beam), ORIGINS.index("main lobe"))
    beside = np.flatnonzero(2.0 * np.pi * centre * np.linalg.norm(apart @ spread, axis=1) > FIRST_NULL)
    found[beside] = ORIGINS.index("side lobe")
    if elements.on_lattice and len(beside):
        waves = np.linspace(band.low, band.high, MOST_BINS)[:, None, None] * apart[beside]
        order = np.rint(waves * elements.pitch) * np.array([0.0, 1.0, 1.0])
        rest = 2.0 * np.pi * np.linalg.norm((waves - order / elements.pitch) @ spread, axis=2)
        grating = ((rest < FIRST_NULL) & order.any(axis=2)).any(axis=0)
        found[beside[grating]] = ORIGINS.index("grating lobe")
    normal = _normal(elements, listening.sound_speed / centre)
    if normal is not None:
        found[(paths.direction @ normal) * (beam @ normal) < 0.0] = ORIGINS.index("mirror image")
    found[paths.target < 0] = ORIGINS.index("snap itself")
    return found


_normal = lru_cache(maxsize=16)(mirror_normal)


@lru_cache(maxsize=16)
def _spread(elements: Elements) -> Floats:
    """Matrix (xyz, 3) m: a vector times it is as long as the rms, over the aperture, of its product with positions."""
    live = elements.position[elements.gain != 0]
    about = live - live.mean(axis=0)
    return np.linalg.cholesky(about.T @ about / len(live) + 1e-18 * np.eye(3))


def _from_targets(
    found: Attribution, points: Ints, places: Floats, moment: Moment, listening: Listening
) -> tuple[Floats, Floats]:
    """Range (point,) of where the echoes of points were made, and distance (point,) of the places (point, xyz) that the
    sonar gives them from the target, where sound met it and the array (m)."""
    paths, share = found.paths, found.share[points]
    row = np.minimum(found.first[points, None] + np.arange(share.shape[1]), len(paths.delay) - 1)
    weight = share / share.sum(axis=1, keepdims=True)
    heard = np.einsum("pe,pe->p", weight, paths.delay[row])
    met = heard - np.einsum("pe,pe->p", weight, paths.radius[row]) / paths.sound_speed
    made = np.einsum("pe,pex->px", weight, paths.point[row])
    array = listening.pose.position + heard[:, None] * listening.velocity
    place = array + listening.pose.turn_to_world(places)
    distance, owner = np.empty(len(points)), found.owner[points]
    for group in np.unique(owner):
        some = owner == group
        body = moment.bodies[found.target[group]]
        mean = float(met[some].mean())
        there = _later(body, mean)
        made[some] = there.pose.to_world(body.pose.to_body(made[some])) + (met[some, None] - mean) * there.velocity
        distance[some] = surface_distances(there, place[some] - (met[some, None] - mean) * there.velocity)
    return np.linalg.norm(made - array, axis=1), distance


def _later(body: Body, seconds: float) -> Body:
    """The body where it is so many seconds after the instant of the frame."""
    return replace(body, pose=Pose(body.pose.position + seconds * body.velocity, body.pose.orientation))


def surface_distances(body: Body, points: Floats) -> Floats:
    """Distances (point,) m of points (point, xyz) of the world from the surface of a body, inside or outside: exact."""
    ready = casting_mesh(body.mesh)
    at, found = (body.pose.to_body(points) - ready.centre) / ready.size, np.empty(len(points))
    kernels.distances(at, ready.vertices, ready.faces, *ready.tree, found)
    return found * ready.size
