"""Snaps of a chorus as they reach the array: straight rays, directly and by the images of surface and bottom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.equations.rays.ray_solutions import mean_slowness, water
from sonarsynth.products.pulse_arrivals import PulseArrivals
from sonarsynth.propagation.images import images
from sonarsynth.propagation.reflections import Reflections, at_boundaries
from sonarsynth.signals.pulse_sums.adding_pulses import CAVITY
from sonarsynth.sources.chorus import ChorusSnaps, ListeningWindow
from sonarsynth.state import Medium, Receiver

FAINT = 40.0
"""dB: a path so far below the root mean square pressure of all within the reach, by its level at the centre of the
band, is left out. Of 10 to 110 kHz in 900 m of water that took 1 dB at 10 kHz, 0.1 dB at 30 kHz and nothing above."""


class ChorusReach(NamedTuple):
    """How far, and by how many images, snaps are heard one by one."""

    reach: float  # m, horizontally
    images: int  # reflections, in all
    edges: Floats  # (ring + 1,) m
    kurtosis: float  # excess kurtosis of the chorus
    beyond: float  # dB: power of what is beyond the reach, re all of it
    level: float  # dB re 1 uPa: of what is within the reach, in the band


class ImageHeights(NamedTuple):
    """Ways from the bottom to the array, unfolded."""

    climb: Floats  # (image,) m that the ray climbs
    slowness: Floats  # (image,) s/m: mean over the depths that it crosses
    surface: Ints  # (image,) reflections
    bottom: Ints  # (image,)
    turns: Floats  # (image,) -1 where it arrives from above

    def select(self, rows: Ints) -> ImageHeights:
        """Those of these indices."""
        return ImageHeights(
            self.climb[rows], self.slowness[rows], self.surface[rows], self.bottom[rows], self.turns[rows]
        )


@dataclass(frozen=True, eq=False)
class ChorusArrivals(PulseArrivals):
    """Arrivals of a chorus at the array centre, sorted by snap, then image: as `PulseArrivals`, gains at the centre of
    the band, with

    level       (path,)       dB    peak source level re 1 uPa at 1 m
    width       (path,)       -     number of the width, of `Chorus.widths`
    snap        (path,)       -     number of the snap, of those in the window
    boundaries  (path,)       -     reflections
    absorption  (path,)       dB    at the centre of the band; not in gain
    key         (snap, 5)     -     of `ChorusSnaps`
    """

    level: Floats
    width: Ints
    snap: Ints
    boundaries: Ints
    absorption: Floats
    key: Ints

    @property
    def received(self) -> Floats:
        """Peak level (path,) at the array centre, dB re 1 uPa."""
        return np.asarray(self.level + 20.0 * np.log10(np.abs(self.gain)) - self.absorption)

    @staticmethod
    def _whole() -> tuple[str, ...]:
        return ("key", "sound_speed")


def no_chorus() -> ChorusArrivals:
    """A chorus without a snap."""
    none, integers = np.zeros(0), np.zeros(0, np.int64)
    return ChorusArrivals(
        delay=none,
        direction=np.zeros((0, 3)),
        length=none,
        gain=none,
        phase=none,
        delay_std=none,
        level=none,
        width=integers,
        snap=integers,
        boundaries=integers,
        absorption=none,
        key=np.zeros((0, 5), np.int64),
        sound_speed=1500.0,
    )


def image_heights(profile: Profile, bottom_depth: float, end: float, bounces: int) -> ImageHeights:
    """Of a source on the bottom, for an array at depth `end` (m), by at most so many reflections.

    Its image in the bottom is in the source itself: the source level is of both.
    """
    layers, ends = water(profile.depth, profile.speed, bottom_depth), np.array([bottom_depth])
    edges = np.array([0.0, min(max(end, 0.0), bottom_depth), bottom_depth])
    above, below = (
        float(mean_slowness(layers, np.array([a]), np.array([b]))[0]) if b > a else 1.0 / float(profile.at(a))
        for a, b in pairwise(edges)
    )
    rows = []
    for image in images(ends, edges[1:2], bottom_depth, bounces):
        climb = float(image.climb[0])
        if climb >= 0.0 and (image.bottom <= image.surface):
            crossed = float(image.above[0]) * above + float(image.between[0] + image.below[0]) * below
            slowness = crossed / climb if climb > 0.0 else below
            rows.append((climb, slowness, image.surface, image.bottom, image.turns))
    height, mean, surface, bottom, turns = (np.array(column) for column in zip(*rows, strict=True))
    return ImageHeights(height, mean, surface, bottom, turns)


def listening(heights: ImageHeights, receiver: Receiver, window: tuple[float, float], reach: float) -> ListeningWindow:
    """What `draw_snaps` needs of an array and a window (s, since the start of the motions)."""
    slow, fast = 1.0 / float(heights.slowness.max()), 1.0 / float(heights.slowness.min())
    return ListeningWindow(receiver.pose.position[:2], *window, reach, float(heights.climb.max()), slow, fast)


def reflected(
    environment: Environment, profile: Profile, heights: ImageHeights, grazing: Floats, f: float
) -> Reflections:
    """What the reflections of images do at grazing angles (..., image) in rad; f (Hz): of the middle of the band."""
    every = np.broadcast_to(np.arange(len(heights.climb)), grazing.shape).ravel()
    surface, bottom, angle = heights.surface[every], heights.bottom[every], grazing.ravel()
    bounced = at_boundaries(environment, profile, angle, surface, angle, bottom, f)
    return Reflections(*(x.reshape(grazing.shape) for x in (bounced.modulus, bounced.phase, bounced.delay_std)))


def chorus_arrivals(
    snaps: ChorusSnaps,
    reach: ChorusReach,
    medium: Medium,
    receiver: Receiver,
    time: float,
    window: tuple[float, float],
) -> ChorusArrivals:
    """Arrivals in a window (s, after the instant of the frame, which is `time` (s) after the start of the motions).

    The array moves from snap to snap at the velocity and spin of its `instant`; while it hears one it is at rest. A
    path so rough that the phase of its reflections is lost (2 pi f sigma > 1 in the middle of the band) keeps its
    energy, with a random sign. Paths that are `FAINT` are left out.
    """
    heights = image_heights(medium.profile, medium.depth, float(depth(receiver.pose.position)), reach.images)
    emitted, at = (snaps.time - time)[:, None], receiver.pose.position[:2]
    level = away = np.broadcast_to((snaps.position - at)[:, None], (len(snaps.time), len(heights.climb), 2))
    climb = np.broadcast_to(heights.climb, away.shape[:2])
    velocity = np.zeros(3) if receiver.track is None else receiver.track.velocity
    delay = emitted + np.hypot(np.hypot(level[..., 0], level[..., 1]), climb) * heights.slowness
    for _ in range(2 if velocity.any() else 0):  # it makes way at a hundredth of the speed of sound, or less
        moved = (delay - receiver.instant)[..., None] * velocity
        level = away - moved[..., :2]
        climb = np.abs(heights.climb + moved[..., 2] * heights.turns)
        delay = emitted + np.hypot(np.hypot(level[..., 0], level[..., 1]), climb) * heights.slowness
    snap, image = np.nonzero((delay > window[0]) & (delay < window[1]))
    level, climb, delay = level[snap, image], climb[snap, image], delay[snap, image]
    length = np.maximum(np.hypot(np.hypot(level[:, 0], level[:, 1]), climb), 1e-6)
    own = heights.select(image)
    bounced = reflected(
        medium.environment, medium.profile, own, np.arcsin(np.minimum(climb / length, 1.0)), receiver.centre
    )
    sign = np.where(np.floor(snaps.sign[snap] * 2.0 ** (4 + image % 40)) % 2.0, -1.0, 1.0)
    lost = 2.0 * np.pi * receiver.centre * bounced.delay_std > 1.0
    towards = np.column_stack([level, -climb * own.turns]) / length[:, None]
    used, number = np.unique(snap, return_inverse=True)
    chorus = ChorusArrivals(
        delay=delay,
        direction=receiver.turn_to_array(towards, delay),
        length=length,
        gain=np.where(lost, sign, 1.0) * bounced.modulus / np.maximum(length, CAVITY),
        phase=np.where(lost, 0.0, bounced.phase),
        delay_std=np.where(lost, 0.0, bounced.delay_std),
        level=snaps.level[snap],
        width=snaps.width[snap],
        snap=number,
        boundaries=own.surface + own.bottom,
        absorption=medium.mean_absorption * length,
        key=snaps.key[used],
        sound_speed=receiver.speed(medium),
    )
    chorus = replace(chorus, gain=chorus.gain * np.where(chorus.direction[:, 0] < 0.0, receiver.sonar.behind, 1.0))
    return chorus.select(chorus.received >= reach.level - FAINT)
