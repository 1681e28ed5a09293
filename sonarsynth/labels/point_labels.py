"""Labels of the points of a cloud: whose echo each is, how it came to be heard, and where it was made."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from sonarsynth.casting.surface_distances import surface_distances
from sonarsynth.columns import rows_of
from sonarsynth.conventions import NO_TARGET, Floats, Ints, direction
from sonarsynth.geometry import turned
from sonarsynth.labels import point_kernels as kernels
from sonarsynth.labels.attribution_of_points import MOST_BINS, Attribution, SonarTiming, attribution
from sonarsynth.labels.level_band import Band
from sonarsynth.products import ORIGINS, Arrivals, Kind, PointCloud, PointLabels
from sonarsynth.receiver import Elements
from sonarsynth.receiver.mirror_images import mirror_normal
from sonarsynth.state import WorldState

FIRST_NULL = 1.9
"""rad of phase, root mean square over the aperture, at the first null of a beam: 1.915 of a disc, 1.81 of a line."""
EXPLAINED = 0.05
"""Of the energy of a point that the paths of a frame must bring, or noise made it."""

SCATTERED_BINS = 8
"""Frequencies that scatterers are summed at: of thousands at random, each tells as much. The same labels as of 48, in
half of the time (`configs/ping.yaml`)."""


def label_points(
    cloud: PointCloud,
    arrivals: Arrivals,
    band: Band,
    moment: WorldState,
    listening: SonarTiming,
    scattered: Arrivals | None = None,
) -> PointLabels:
    """Labels of the points of a cloud.

    arrivals: paths of the frame; band: what each snap sends in the sonar's band; moment: the world at the frame's
    instant; scattered: paths by what scatters in surface, bottom and water. Bodies and the array are where sound meets
    them.
    """
    beam = direction(cloud.azimuth, cloud.elevation)
    late, energy = cloud.delay.astype(float), cloud.energy.astype(float)
    attributed = attribution(arrivals, band, listening, beam, late, energy)
    explained = (attributed.owner >= 0) & (attributed.energy.sum(axis=1) >= EXPLAINED * energy)
    own = np.where(explained, attributed.energy.max(axis=1, initial=0.0), EXPLAINED * energy)
    lit = np.full(len(cloud), NO_TARGET)  # by which snap, of what scatters more than that
    if scattered is not None and len(cloud):
        heard = replace(listening, clock=attributed.clock)
        brought = attribution(scattered, band, heard, beam, late, energy, SCATTERED_BINS)
        lit = np.where(brought.energy.sum(axis=1) > own, np.append(brought.snap, NO_TARGET)[brought.owner], NO_TARGET)
    explained &= lit == NO_TARGET
    numbers = {"target": np.int16, "emission": np.int16, "family": np.int8, "lit_by": np.int8, "facet": np.int32}
    labels: dict[str, np.ndarray] = {name: np.full(len(cloud), NO_TARGET, of) for name, of in numbers.items()}
    labels |= {name: np.full(len(cloud), np.nan, np.float32) for name in ("true_range", "distance")}
    labels["origin"] = np.full(len(cloud), ORIGINS.index("unexplained"), np.int8)
    labels["emission"][:] = lit
    labels["origin"][lit != NO_TARGET] = ORIGINS.index("reverberation")
    rows = np.flatnonzero(explained)
    owner = attributed.owner[rows]
    loudest = attributed.rows[attributed.first[rows] + attributed.share[rows].argmax(axis=1)]
    for name in ("target", "emission", "family", "lit_by"):
        labels[name][rows] = getattr(attributed, "snap" if name == "emission" else name)[owner]
    labels["facet"][rows] = arrivals.facet[loudest]
    labels["origin"][rows] = _origins(arrivals, loudest, beam[rows], listening, band)
    echo = np.flatnonzero(labels["target"] >= 0)
    if len(echo):
        middle = attributed.clock + float(late[echo].mean())
        near = _from_targets(attributed, echo, cloud.position[echo].astype(float), middle, moment, listening)
        labels["true_range"][echo], labels["distance"][echo] = near
    return PointLabels(**labels)


def _origins(arrivals: Arrivals, path: Ints, beam: Floats, listening: SonarTiming, band: Band) -> Ints:
    """Index into ORIGINS (point,) of what beams (point, xyz) hear of the paths (point,) that bring most."""
    direction, kind = arrivals.direction[path], arrivals.kind[path]
    elements, centre = listening.elements, 0.5 * (band.low + band.high)
    spread = _spread(elements)
    apart = direction / arrivals.sound_speed - beam / listening.sound_speed  # s/m
    origin = np.full(len(beam), ORIGINS.index("main lobe"))
    beside = np.flatnonzero(2.0 * np.pi * centre * np.linalg.norm(apart @ spread, axis=1) > FIRST_NULL)
    origin[beside] = ORIGINS.index("side lobe")
    if elements.on_lattice and len(beside):
        waves = np.linspace(band.low, band.high, MOST_BINS)[:, None, None] * apart[beside]
        order = np.rint(waves * elements.pitch) * np.array([0.0, 1.0, 1.0])
        remainder = 2.0 * np.pi * np.linalg.norm((waves - order / elements.pitch) @ spread, axis=2)
        grating = ((remainder < FIRST_NULL) & order.any(axis=2)).any(axis=0)
        origin[beside[grating]] = ORIGINS.index("grating lobe")
    normal = _normal(elements, listening.sound_speed / centre)
    if normal is not None:
        origin[(direction @ normal) * (beam @ normal) < 0.0] = ORIGINS.index("mirror image")
    origin[kind == Kind.DIRECT] = ORIGINS.index("snap itself")
    origin[kind == Kind.REVERBERATION] = ORIGINS.index("reverberation")
    return origin


_normal = lru_cache(maxsize=16)(mirror_normal)


@lru_cache(maxsize=16)
def _spread(elements: Elements) -> Floats:
    """Matrix (xyz, 3) m: a vector times it is as long as the rms, over the aperture, of its product with positions."""
    live = elements.position[elements.gain != 0]
    about = live - live.mean(axis=0)
    return np.linalg.cholesky(about.T @ about / len(live) + 1e-18 * np.eye(3))


def _from_targets(
    attributed: Attribution, points: Ints, places: Floats, middle: float, moment: WorldState, listening: SonarTiming
) -> tuple[Floats, Floats]:
    """Range (point,) of where the echoes of points were made, and distance (point,) of the places (point, xyz) that the
    sonar gives them from the target, where sound met it and the array (m); middle (s): of when they are heard."""
    arrivals, rows, owner = attributed.arrivals, attributed.rows, attributed.owner[points]
    sonar, delay = listening.track.later(middle), arrivals.delay[rows]
    away = rows_of(arrivals.point, rows) - sonar.pose.position - np.outer(delay - middle, sonar.velocity)
    columns = delay, delay - arrivals.radius[rows] / arrivals.sound_speed, np.sqrt(np.einsum("px,px->p", away, away))
    heard, met, ranges = kernels.means(points, attributed.share, attributed.first, np.stack(columns, axis=1)).T
    late, distance = heard - middle, np.empty(len(points))
    place = turned(sonar.pose.turn_to_world(places), sonar.spin, late)
    place += sonar.pose.position + np.outer(late, sonar.velocity)
    for group in np.unique(owner):
        at = np.flatnonzero(owner == group)
        then = float(met[at].mean())
        placed = moment.bodies[attributed.target[group]].later(then)
        distance[at] = surface_distances(placed, place[at] - np.outer(met[at] - then, placed.velocity))
    return ranges, distance
