"""Locating and ranging through a sound-speed profile, by travel times along rays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.arrays.bistatic_range import bistatic_range
from sonarsynth.equations.arrays.spherical_wave import Wavefront, spherical_wave, wavefront_delays
from sonarsynth.equations.rays.ray_solutions import eigenrays, water
from sonarsynth.geometry import Pose, unit
from sonarsynth.ranging.location.pulse_times import Pulse
from sonarsynth.ranging.location.source_position import Bend, SonarKnowledge, SourceFix, place
from sonarsynth.ranging.placing.solution import Solution
from sonarsynth.receiver import Elements

STEPS = 20
"""Newton steps at most; five or six are usual."""
TOLERANCE = 1e-10
"""s: travel times are met to this (0.15 um)."""


@dataclass(frozen=True, eq=False)
class FirstRays:
    """The fastest direct ray of each pair of points; NaN in a shadow and out of the water. World frame."""

    travel_time: Floats  # (pair,) s
    departure: Floats  # (pair, xyz) unit vector of travel at the start
    arrival: Floats  # (pair, xyz) unit vector of travel at the end


def first_rays(profile: Profile, start: Floats, end: Floats) -> FirstRays:
    """Fastest direct rays from `start` (pair, xyz) to `end` (pair, xyz), world frame; the bottom stops none."""
    a, b = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
    across = b[:, :2] - a[:, :2]
    distance = np.hypot(across[:, 0], across[:, 1])
    wet = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1) & (a[:, 2] <= 0) & (b[:, 2] <= 0)
    time = np.full(len(a), np.nan)
    departure, arrival = np.full(a.shape, np.nan), np.full(a.shape, np.nan)
    if wet.any():
        bottom = max(-a[wet, 2].min(), -b[wet, 2].min(), profile.depth[-1]) + 1.0
        sea = water(profile.depth, profile.speed, float(bottom))
        rays = eigenrays(sea, -a[wet, 2], -b[wet, 2], distance[wet])
        joined, first = np.unique(rays.pair, return_index=True)
        pair = np.flatnonzero(wet)[joined]
        time[pair] = rays.travel_time[first]
        heading = across[pair] / np.where(distance[pair] > 0, distance[pair], 1.0)[:, None]
        for vectors, sine in ((departure, rays.start_sine[first]), (arrival, rays.end_sine[first])):
            cosine = np.sqrt(np.maximum((1 - sine) * (1 + sine), 0.0))
            vectors[pair] = np.column_stack([heading * cosine[:, None], sine])
    return FirstRays(time, departure, arrival)


def bending(profile: Profile, elements: Elements, undone: bool, pose: Pose) -> Bend:
    """What rays through the profile add to straight delays over an array that has a pose, which is `undone` or not."""
    sensors = np.vstack([elements.position, np.zeros(3)])

    def delays(source: Floats, sound_speed: float) -> Floats:
        rays = first_rays(profile, pose.to_world(source)[None], pose.to_world(sensors))
        straight = np.linalg.norm(source - sensors, axis=1) / sound_speed
        extra = rays.travel_time - straight
        return np.asarray(extra[:-1] - extra[-1])

    return Bend(delays, float(profile.at(-pose.position[2])), undone)


def placed_along_rays(
    wave: Wavefront, pulse: Pulse, elements: Elements, knowledge: SonarKnowledge, bend: Bend
) -> SourceFix:
    """A row of a pulse with its wavefront, as `bend` says: where it is undone, no error of the assumed speed is."""
    c = knowledge.sonar.assumed_sound_speed
    bent = _unbent(pulse, wave, elements, bend.sound_speed, 0.0, c) if bend.undone else wave
    row = place(wave, pulse, knowledge, bent)
    for _ in range(3):  # delays beyond straight ones change little with the place: this settles at once
        extra = bend.delays(row.position, c if bend.undone else bend.sound_speed)
        if not np.all(np.isfinite(extra)):
            break
        straight = _unbent(pulse, wave, elements, c, extra)
        if not bend.undone:
            return place(wave, pulse, knowledge, unbent=straight)
        row = place(replace(straight, by_sound_speed=np.zeros(4)), pulse, replace(knowledge, gradient=0.0), bent)
    return row


def _unbent(
    pulse: Pulse, wave: Wavefront, elements: Elements, speed: float, extra: Floats | float, measured: float = 0.0
) -> Wavefront:
    """The straight wave at `speed` (m/s) that is left when delays `extra` (sensor,) in s are taken away; measured: the
    speed (m/s) that `wave` was fitted with, where it is another."""
    q = elements.position
    delay = wave.time + wavefront_delays(q, wave.direction, wave.curvature, measured or speed) + wave.residual - extra
    return spherical_wave(delay, q, speed, pulse.weight, wave.direction, wave.curvature) or wave


def refracted_solution(
    delay: Floats, beam: Floats, source: Floats, sound_speed: float, pose: Pose, profile: Profile
) -> Solution:
    """Where echoes come from through a profile: Newton on travel times from the closed form.

    Solves T(A -> P) + T(P -> S) - T(S -> A) = delay for P on the ray that arrives along the beam. P = A + r v; the
    residual falls by slope (e1.v + e2.v)/c, with e1 and e2 the directions of travel at P of the rays from the array and
    from the source, and v turns by what the ray's arrival direction misses the beam. `sound_speed` is what the beams
    are steered with: a beam hears what arrives with its slowness over the array, from a direction a little off its
    own where the water at the array is of another speed. NaN in shadow zones, out of the water, and near the baseline.
    """
    local = float(profile.at(-pose.position[2]))
    sideways = beam[:, 1:] * (local / sound_speed)
    ahead = np.sqrt(np.maximum(1 - np.sum(sideways**2, axis=1), 0.0)) * np.where(beam[:, 0] < 0, -1.0, 1.0)
    direction = unit(np.column_stack([ahead, sideways]))
    closed = bistatic_range(local * delay, direction, source)
    array, snap = pose.position[None], pose.to_world(source)[None]
    wanted = pose.turn_to_world(direction)
    v, r = wanted, closed.range
    direct = first_rays(profile, snap, array).travel_time[0]
    for _ in range(STEPS):
        point = array + r[:, None] * v
        out, back = first_rays(profile, array, point), first_rays(profile, snap, point)
        late = out.travel_time + back.travel_time - direct - delay
        slope = np.sum((out.arrival + back.arrival) * v, axis=1) / profile.at(-point[:, 2])
        missed = wanted - out.departure
        settled = np.abs(late) + np.linalg.norm(missed, axis=1) * r / local < TOLERANCE
        if np.all(settled | np.isnan(late)):
            break
        r = r - np.clip(late / slope, -0.5 * r, 0.5 * r)
        v = unit(v + missed)
    good = settled & ~closed.ill_conditioned & (slope * local >= 0.1)
    position, r = np.where(good[:, None], pose.to_body(point), np.nan), np.where(good, r, np.nan)
    return Solution(position, r, closed.by_path, closed.by_angle, closed.by_source, closed.by_path * delay)
