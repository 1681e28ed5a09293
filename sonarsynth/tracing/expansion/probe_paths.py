"""Legs at the probe sensors of an array, each of them traced."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.columns import Columns, rows_of
from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.equations.kernels.unit_vectors import to_images
from sonarsynth.geometry import Pose
from sonarsynth.propagation.bounces import MOST_BOUNCES
from sonarsynth.propagation.path_model import KnownRays
from sonarsynth.propagation.reflections import at_boundaries
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.expansion.probe_sensors import BRANCH, Probes, pick_branch, sphere
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation


@dataclass(frozen=True, eq=False)
class ReceiverGeometry:
    """Where legs go, and through what."""

    medium: Medium  # as rays bend in it
    receiver: Receiver
    probe: Probes
    propagation: Propagation


@dataclass(frozen=True, eq=False)
class ApertureSamples(Columns):
    """Legs at the probes."""

    delay: Floats  # (leg, term) as of `ArrayExpansion`, and the next two
    phase: Floats
    delay_variance: Floats
    gain: Floats  # (leg, probe)
    departure: Floats | None  # (leg, probe, xyz); None: towards the images of the probes
    error: Floats  # (leg,) s

    @staticmethod
    def room(count: int, sensors: int, terms: int, *, straight: bool) -> ApertureSamples:
        """Room for so many, at so many probes, with so many terms; straight: towards images."""
        delay, phase, variance = np.zeros((3, count, terms))
        departure = None if straight else np.zeros((count, sensors, 3))
        return ApertureSamples(delay, phase, variance, np.ones((count, sensors)), departure, np.zeros(count))

    @property
    def known(self) -> dict[str, Floats]:
        """What there is, by name."""
        return {name: value for name, value in vars(self).items() if value is not None}

    def put(self, rows: Ints, values: dict[str, Floats]) -> None:
        """Write what is known of some of them; the rest stays as it is in room."""
        for name, value in values.items():
            getattr(self, name)[rows] = value


def traced(legs: ReceivePaths, geometry: ReceiverGeometry) -> ApertureSamples:
    """Legs at the probes, each of them traced."""
    straight = geometry.propagation.straight(geometry.medium.profile)
    samples = ApertureSamples.room(len(legs.row), *geometry.probe.basis.shape, straight=straight)
    if straight:
        if not legs.bounces.any():
            return samples
        departure = image(legs, geometry.probe.position, geometry.receiver.pose)
        residual, gain = np.zeros(samples.gain.shape), samples.gain
    else:
        residual, gain, departure = rays_to_probes(legs, geometry)
    probe, rate = geometry.probe, 2.0 * np.pi * geometry.receiver.band[1]
    turned, loss, softer = _boundaries(legs, departure, geometry.medium, geometry.receiver.centre)
    turned, softer = (np.where(np.isnan(residual), np.nan, value) for value in (turned, softer))
    (delay, late), (phase, off), (variance, soft) = (probe.expand(value) for value in (residual, turned, softer))
    error = late + off / rate + soft * 0.5 * rate
    return ApertureSamples(delay, phase, variance, gain * loss, None if straight else departure, error)


def image(legs: ReceivePaths, position: Floats, sonar_pose: Pose, rows: Ints | None = None) -> Floats:
    """Unit vectors (leg, place, xyz) from each point to the image of each place (place, xyz) m of the sonar frame, as
    far as the ray is long; of all legs, or some rows of them."""
    chosen = slice(None) if rows is None else rows
    mirrored = (legs.surface[chosen] + legs.bottom[chosen]) % 2 == 1
    return np.asarray(
        to_images(legs.length[chosen], rows_of(legs.departure, chosen), mirrored, sonar_pose.turn_to_world(position))
    )


def _boundaries(legs: ReceivePaths, departure: Floats, medium: Medium, centre: float) -> tuple[Floats, Floats, Floats]:
    """Phase (leg, probe) that the reflections to each probe add to those to the centre, ratio of their moduli, and
    what their squared blurs (s2) add; centre: of the band (Hz)."""
    shape, profile = departure.shape[:2], medium.profile
    shift, ratio, softer = np.zeros(shape), np.ones(shape), np.zeros(shape)
    rows = np.flatnonzero(legs.bounces > 0)
    if not len(rows):
        return shift, ratio, softer
    x, y, _ = np.moveaxis(departure[rows], 2, 0)
    p = np.sqrt(x * x + y * y) / profile.at(depth(legs.point[rows]))[:, None]
    surface, bottom = (np.repeat(n[rows, None], p.shape[1], axis=1) for n in (legs.surface, legs.bottom))
    angles = [np.arccos(np.minimum(p * float(profile.at(z)), 1.0)) for z in (0.0, medium.depth)]
    bounced = at_boundaries(medium.environment, profile, angles[0], surface, angles[1], bottom, centre)
    turned = bounced.phase - (legs.phase - 0.5 * np.pi * legs.caustics)[rows, None]
    shift[rows] = turned - 2.0 * np.pi * np.rint(turned / (2.0 * np.pi))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio[rows] = np.where(legs.boundary[rows, None] > 0, bounced.modulus / legs.boundary[rows, None], 1.0)
    softer[rows] = bounced.delay_std**2 - legs.delay_std[rows, None] ** 2
    return shift, ratio, softer


def rays_to_probes(legs: ReceivePaths, geometry: ReceiverGeometry) -> tuple[Floats, Floats, Floats]:
    """Delay over the sphere's (s), gain over it (leg, probe), departure (leg, probe, xyz): rays to every probe."""
    medium, probe = geometry.medium, geometry.probe
    position = geometry.receiver.pose.to_world(probe.position)
    centre_rays = KnownRays(legs.point, legs.departure, legs.bounces + legs.turning)
    nothing = np.full((len(legs.row), len(position)), np.nan)
    beside = geometry.propagation.checked_rays_beside(medium.profile, medium.depth, centre_rays, position)
    time, spreading, departure = beside or (nothing, nothing.copy(), np.zeros((*nothing.shape, 3)))
    c = geometry.receiver.speed(medium)
    farther = sphere(legs.direction, legs.radius, probe.position)
    predicted = legs.travel_time[:, None] + farther / c
    lost = np.flatnonzero(np.isnan(time).any(axis=1))
    if len(lost):
        searched = legs.select(lost)
        rays = _searched(searched, position, predicted[lost], BRANCH * probe.aperture / c, geometry)
        time[lost], spreading[lost] = rays[0], rays[1]
        departure[lost] = np.where(np.isnan(rays[0])[..., None], searched.departure[:, None, :], rays[2])
    expected = legs.spreading[:, None] * legs.radius[:, None] / (legs.radius[:, None] + farther)
    return time - predicted, spreading / expected, departure


def _searched(
    legs: ReceivePaths, position: Floats, predicted: Floats, tolerance: float, geometry: ReceiverGeometry
) -> tuple[Floats, Floats, Floats]:
    """Time, spreading (leg, probe) and departure of the rays nearest in time among all; NaN where there is none."""
    count, sensors = predicted.shape
    start, end = np.repeat(legs.point, sensors, axis=0), np.tile(position, (count, 1))
    most = min(int(legs.bounces.max()), MOST_BOUNCES)  # those of a snap's own image have one more than others
    model = geometry.propagation.reflected(most)
    paths = model.checked_paths(geometry.medium.profile, geometry.medium.depth, start, end)
    same = (paths.surface == legs.surface[paths.pair // sensors]) & (paths.bottom == legs.bottom[paths.pair // sensors])
    nearest = pick_branch(paths, predicted, tolerance, same)
    missing = nearest < 0
    time = np.where(missing, np.nan, paths.travel_time[nearest])
    return time, np.where(missing, np.nan, paths.spreading[nearest]), paths.departure[nearest]
