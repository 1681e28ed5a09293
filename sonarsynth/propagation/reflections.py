"""What surface and bottom do to each path, and caustics on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.columns import alike
from sonarsynth.conventions import Floats, Ints
from sonarsynth.environment.boundary_numbers import bounces
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.products import Paths


@dataclass(frozen=True, eq=False)
class Reflections:
    """What paths lose and how their pulses change by reflections and caustics."""

    modulus: Floats  # (path,)
    phase: Floats  # (path,) rad
    delay_std: Floats  # (path,) s


def reflections(environment: Environment, profile: Profile, paths: Paths, centre: float) -> Reflections:
    """Of all reflections and caustics of each path; centre (Hz): of the band, where the loss in bubbles is taken.

    A caustic advances the phase by a quarter period: exp(+i pi/2) at positive frequencies, in time dependence
    exp(+i 2 pi f t). Source: Jensen, Kuperman, Porter and Schmidt (2011), Computational Ocean Acoustics, section 3.3.
    """
    changed = at_boundaries(
        environment, profile, paths.surface_grazing, paths.surface, paths.bottom_grazing, paths.bottom, centre
    )
    phase = changed.phase + 0.5 * np.pi * paths.caustics if paths.caustics.any() else changed.phase
    return Reflections(changed.modulus, phase, changed.delay_std)


def at_boundaries(
    environment: Environment, profile: Profile, surface_grazing: Floats, surface: Ints, bottom_grazing: Floats,
    bottom: Ints, centre: float,
) -> Reflections:  # fmt: skip
    """Of so many reflections (path,) at grazing angles (path,) in rad."""
    if not (surface.any() or bottom.any()):
        none = alike(0.0, len(surface))
        return Reflections(alike(1.0, len(surface)), none, none)
    over = bounces(environment.surface, surface_grazing, surface, float(profile.at(0.0)), centre)
    under = bounces(environment.bottom, bottom_grazing, bottom, float(profile.at(environment.depth)), centre)
    blurred = np.sqrt(over.delay_std**2 + under.delay_std**2)
    return Reflections(over.modulus * under.modulus, over.phase + under.phase, blurred)


def reflections_along(
    environment: Environment, profile: Profile, depth: Floats, direction: Floats, surface: Ints, bottom: Ints,
    centre: float,
) -> Reflections:  # fmt: skip
    """Of so many reflections (path,) of rays that have directions (path, xyz) at depths (path,) m, by Snell's law."""
    slowness = np.sqrt(direction[:, 0] ** 2 + direction[:, 1] ** 2) / profile.at(depth)
    over, under = (np.arccos(np.minimum(slowness * float(profile.at(z)), 1.0)) for z in (0.0, environment.depth))
    return at_boundaries(environment, profile, over, surface, under, bottom, centre)


def as_sign(phase: Floats) -> tuple[Floats, Floats]:
    """Sign (path,) and rest of phases (path,): 0 for whole multiples of pi, else the phase between -pi and pi."""
    if not phase.any():
        return np.ones(phase.shape), phase
    half = np.rint(phase / np.pi)
    multiple, odd = np.abs(phase - np.pi * half) < 1e-9, half != 2.0 * np.rint(0.5 * half)
    within = phase - 2.0 * np.pi * np.rint(phase / (2.0 * np.pi))
    return np.where(multiple & odd, -1.0, 1.0), np.where(multiple, 0.0, within)
