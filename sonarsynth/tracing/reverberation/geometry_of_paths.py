"""From a source to scatterers to the array: how long, how loud and from where, before any of them scatters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface
from sonarsynth.environment.boundary_numbers import coefficient, delay_std
from sonarsynth.equations.reverberation.bottom_strength import Angles
from sonarsynth.sources.sound_source import Emission
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.reverberation.ways import UnfoldedPaths, ways

NEAREST = 0.1
"""m: scatterers nearer than this to source or array are as loud as there."""


@dataclass(frozen=True, eq=False)
class ScatteredPaths:
    """Paths by scatterers (point,), of one emission, one way out and one way back.

    delay       (point,)       s     at the array centre, after the instant of the frame
    leaving     (point, xyz)   -     world, where they leave the emission to
    towards     (point, xyz)   -     world, where they come from
    out, back   (point,)       m     lengths
    spreading   (point,)       1/m2  energy flux of a source of 1 at a scatterer of 1 m2: directivity, reflections,
                                     baffle and absorption at the centre of the band, over out^2 back^2 m2
    angles                           in and out of a boundary
    """

    delay: Floats
    leaving: Floats
    towards: Floats
    out: Floats
    back: Floats
    amplitude: Floats  # (point,) signed, without absorption and strength: 1/(out back) and what else changes it
    absorbed: Floats  # (point,) energy left by absorption
    angles: Angles

    @property
    def way_out(self) -> Floats:
        """(point, xyz) m, unfolded at its reflections: from the emission to the image of the scatterer that it sees."""
        return np.asarray(self.leaving * self.out[:, None])

    @property
    def way_back(self) -> Floats:
        """(point, xyz) m: the same from the array."""
        return np.asarray(self.towards * self.back[:, None])

    @property
    def flux(self) -> Floats:
        """Energy (point,) over that of the pulse at 1 m, for a cross-section of 1 m2/sr."""
        return np.asarray(self.amplitude**2 * self.absorbed)


def out_ways(medium: Medium, emission: Emission, end: Floats, bounces: int, owner: str) -> list[UnfoldedPaths]:
    """From an emission to depths end (point,)."""
    return ways(medium.profile, medium.depth, float(depth(emission.position)), end, bounces, owner)


def back_ways(medium: Medium, receiver: Receiver, end: Floats, bounces: int, owner: str) -> list[UnfoldedPaths]:
    """From the array to the same."""
    return ways(medium.profile, medium.depth, float(depth(receiver.pose.position)), end, bounces, owner)


def scattered_paths(
    position: Floats, emission: Emission, medium: Medium, receiver: Receiver, out: UnfoldedPaths, back: UnfoldedPaths
) -> ScatteredPaths:
    """Paths by places (point, xyz) m. The array is where its velocity, and its spin, bring it from its `instant`."""
    velocity = np.zeros(3) if receiver.track is None else receiver.track.velocity
    away = position - emission.position
    over = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
    r1 = np.hypot(over, out.climb)
    delay = emission.time + r1 * out.slowness
    level = position[:, :2] - receiver.pose.position[:2]
    late = delay + np.hypot(np.hypot(*level.T), back.climb) * back.slowness
    if velocity.any():
        level = level - (late - receiver.instant)[:, None] * velocity[:2]
    beside = np.maximum(np.hypot(*level.T), 1e-9)
    r2 = np.hypot(beside, back.climb)
    towards = np.column_stack([level, np.broadcast_to(back.climb, r2.shape)]) / r2[:, None]
    sine_in, sine_out = np.abs(out.climb) / r1, np.abs(back.climb) / r2
    forward = -(away[:, 0] * level[:, 0] + away[:, 1] * level[:, 1]) / (over * beside)
    factor: Floats = np.ones(len(position))
    mirrored = factor
    leaving = np.column_stack([away[:, :2], np.broadcast_to(out.climb, r1.shape)]) / r1[:, None]
    if emission.directivity is not None:
        factor = emission.directivity(leaving)
        mirrored = emission.directivity(leaving * (1.0, 1.0, -1.0)) if out.own else factor
    if out.own:
        factor = _with_own_image(medium, out.own, sine_in, receiver.centre, factor, mirrored)
    if back.own:
        factor = factor * _with_own_image(medium, back.own, sine_out, receiver.centre, 1.0, 1.0)
    if receiver.sonar.baffle:
        factor = factor * np.where(receiver.turn_to_array(towards, late)[:, 0] < 0.0, receiver.sonar.behind, 1.0)
    factor = (
        factor * _reflected(medium, out, sine_in, receiver.centre) * _reflected(medium, back, sine_out, receiver.centre)
    )
    return ScatteredPaths(
        delay=delay + r2 * back.slowness,
        leaving=leaving,
        towards=towards,
        out=r1,
        back=r2,
        amplitude=factor / (np.maximum(r1, NEAREST) * np.maximum(r2, NEAREST)),
        absorbed=10.0 ** (-0.1 * medium.mean_absorption * (r1 + r2)),
        angles=Angles(sine_in, sine_out, np.clip(forward, -1.0, 1.0)),
    )


def _reflected(medium: Medium, path: UnfoldedPaths, sine: Floats, frequency: float) -> Floats | float:
    """Modulus (point,) of the mirror reflections on a path: what roughness takes from them still comes, from about the
    mirror point."""
    if not path.bounces:
        return 1.0
    grazing, environment = np.arcsin(np.minimum(sine, 1.0)), medium.environment
    top = np.abs(coefficient(environment.surface, grazing, frequency)) ** path.surface if path.surface else 1.0
    return top * (np.abs(coefficient(environment.bottom, grazing, frequency)) ** path.bottom if path.bottom else 1.0)


def _with_own_image(
    medium: Medium, own: str, sine: Floats, frequency: float, sent: Floats | float, mirrored: Floats | float
) -> Floats:
    """Root of the energy (point,) that a source on a boundary, `own`, and its image at the same place send to points.

    sent, mirrored (point,): amplitude of the source that way, and the other way up, which the boundary reflects by V at
    the sine of the grazing angle (point,) and frequency (Hz). Both are in phase as far as roughness leaves the
    reflection so: sent^2 + |V mirrored|^2 + 2 sent Re(V mirrored) exp(-(2 pi f delay_std)^2/2), Eckart (1953).
    """
    boundary: SeaSurface | SeaBottom = getattr(medium.environment, own)
    grazing = np.arcsin(np.minimum(sine, 1.0))
    image = coefficient(boundary, grazing, frequency) * mirrored
    blur = delay_std(boundary, grazing, medium.profile.at(0.0 if own == "surface" else medium.depth))
    coherent = np.exp(-0.5 * (2.0 * np.pi * frequency * blur) ** 2)
    return np.sqrt(np.maximum(sent**2 + np.abs(image) ** 2 + 2.0 * sent * image.real * coherent, 0.0))
