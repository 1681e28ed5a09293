"""What a boundary does to sound: its description turned into numbers.

Coefficients are for f > 0 in time dependence exp(+i 2 pi f t) and the same at every frequency (absorption in the bottom
goes with frequency, so its loss tangent is a number). Roughness is what depends on frequency: exp(-(2 pi f
delay_std)^2/2). Formulas out of their range do not warn here, frame after frame: `boundary_notes` say it once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface
from sonarsynth.equations.water import boundary_reflection, formula_ranges


@dataclass(frozen=True, eq=False)
class Bounces:
    """What all the reflections of each path at one boundary do to it, together."""

    modulus: Floats  # (path,) factor on the amplitude
    phase: Floats  # (path,) rad: the sum of the phases, of which a change of sign is pi; 0 without a reflection
    delay_std: Floats  # (path,) s: the reflections take exp(-(2 pi f delay_std)^2/2) off the spectrum


def bounces(
    boundary: SeaSurface | SeaBottom, grazing: npt.ArrayLike, count: npt.ArrayLike, sound_speed: npt.ArrayLike,
    frequency: float | None = None,
) -> Bounces:  # fmt: skip
    """The effect of `count` (path,) reflections at the same grazing angle (path,) (rad), of no matter where count is 0.

    sound_speed (m/s) is the water's at the boundary; frequency (Hz) as for `coefficient`. The blur of several bounces
    adds up by squares: they meet different pieces of the boundary. A reflection at an angle that is NaN gives NaN.
    """
    both = np.broadcast_arrays(np.asarray(count), np.asarray(grazing, float))
    shape, (times, angle) = both[0].shape, (column.reshape(-1) for column in both)
    modulus, (phase, spread) = np.ones(times.size), np.zeros((2, times.size))
    met = np.flatnonzero(times > 0)
    if len(met):
        times, q = times[met], angle[met]
        once = coefficient(boundary, q, frequency) + 0.0  # no negative zeros: the phase of -1 is pi
        size, turn, none = np.abs(once), np.angle(once), 0.0 * q  # NaN of what is NaN
        if times.max() > 1:
            size, turn = size**times, turn * times
        modulus[met], phase[met], spread[met] = size + none, turn + none, none
        if rms_height(boundary) != 0.0:
            speed = np.broadcast_to(sound_speed, shape).reshape(-1)[met]
            spread[met] += np.sqrt(times) * delay_std(boundary, q, speed)
    return Bounces(*(column.reshape(shape) for column in (modulus, phase, spread)))


def coefficient(boundary: SeaSurface | SeaBottom, grazing: npt.ArrayLike, frequency: float | None = None) -> Complexes:
    """Reflection coefficient (path,) of the smooth boundary at grazing angles (path,) in rad; 1 where they are NaN.

    frequency (Hz) is needed for bubbles alone: their loss is taken there, as 10^(-loss/20), for the whole band.
    Raises ValueError where it is missing.
    """
    angle = np.asarray(grazing, float)
    none = np.isnan(angle)
    q = np.where(none, 0.5 * np.pi, angle) if none.any() else angle
    value = boundary.reflection.coefficient(q)
    if isinstance(boundary, SeaSurface) and boundary.bubbles and boundary.wind_speed is not None:
        if frequency is None:
            raise ValueError("the loss in bubbles needs a frequency")
        with formula_ranges.noted():
            value = value * 10.0 ** (-boundary_reflection.bubble_loss(boundary.wind_speed, frequency, q) / 20.0)
    return np.asarray(np.where(none, 1.0 + 0j, value) if none.any() else value)


def rms_height(boundary: SeaSurface | SeaBottom) -> float:
    """Root-mean-square height (m) of a boundary, as written or as the wind makes it."""
    if isinstance(boundary, SeaSurface) and boundary.wind_speed is not None:
        with formula_ranges.noted():
            return float(boundary_reflection.wind_wave_height(boundary.wind_speed))
    return boundary.rms_height


def delay_std(boundary: SeaSurface | SeaBottom, grazing: npt.ArrayLike, sound_speed: npt.ArrayLike) -> Floats:
    """Time (path,) in s such that roughness takes exp(-(2 pi f delay_std)^2/2) off one reflection; 0 where grazing is
    NaN.

    sound_speed (m/s) is the water's at the boundary. What this takes is scattered, not lost, and is not simulated.
    """
    q = np.nan_to_num(np.asarray(grazing, float), nan=0.0)
    return boundary_reflection.roughness_blur(rms_height(boundary), q, sound_speed)


def boundary_notes(boundary: SeaSurface | SeaBottom, low: float, high: float) -> tuple[tuple[str, str], ...]:
    """Field and line for each formula of a boundary that is used outside its range, in a band low to high (Hz)."""
    notes: list[tuple[str, str]] = []
    reflection = boundary.reflection
    with formula_ranges.noted() as lines:
        if reflection.sediment is not None:
            formula_ranges.APL_SEDIMENTS.check(frequency=[low, high])
        if reflection.fluid is not None:
            formula_ranges.FLUID_BED.check(speed_ratio=reflection.fluid[1])
    notes += [("reflection", line) for line in lines]
    if isinstance(boundary, SeaSurface) and boundary.wind_speed is not None:
        with formula_ranges.noted() as lines:
            boundary_reflection.wind_wave_height(boundary.wind_speed)
        notes += [("wind_speed", line) for line in lines]
        if boundary.bubbles:
            with formula_ranges.noted() as lines:
                boundary_reflection.bubble_loss(boundary.wind_speed, 0.5 * (low + high), 0.5 * np.pi)
            notes += [("bubbles", line) for line in lines]
    return tuple(notes)
