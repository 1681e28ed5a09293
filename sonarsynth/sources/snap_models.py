"""Snaps beside the logarithmic bubble: a physical bubble, and plain test pulses; how snaps vary."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal, Self

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import (
    Decibels,
    Hertz,
    KilogramsPerCubicMetre,
    NonNegativeMetres,
    Number,
    Pascals,
    PositiveHertz,
    PositiveMetres,
    WaterSoundSpeed,
)
from sonarsynth.description import description
from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, waveforms
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.recordings import RecordedSnap

__all__ = ["Gabor", "KellerMiksis", "RecordedSnap", "Ricker", "SnapVariation"]


@description
class KellerMiksis(PulseModel):
    """A bubble of vapour and a little gas that collapses from rest (Keller and Miksis 1980). The defaults, in water of
    20 degC at 5 m, give 206 dB re 1 uPa at 1 m, peak to peak, below 200 kHz.

    The first collapse is at t = 0. Deeper shrimp snap faster and louder.
    """

    kind: Literal["keller_miksis"] = "keller_miksis"
    radius: PositiveMetres = 3.5e-3
    """Largest radius, at rest."""
    gas_pressure: Annotated[Pascals, Ge(0)] = 2000.0
    """Pressure of the gas at the largest radius: less gas, a harder collapse."""
    depth: NonNegativeMetres | None = None
    """Depth whose pressure drives the collapse; left out: that of the shrimp."""
    surface_pressure: Annotated[Pascals, Ge(0)] = 101325.0
    """Pressure of the air above the sea."""
    vapour_pressure: Annotated[Pascals, Ge(0)] = 2339.0
    """Pressure of the vapour within the bubble, constant."""
    surface_tension: Annotated[Number, Ge(0)] = 0.0725
    """Surface tension in N/m."""
    viscosity: Annotated[Number, Ge(0)] = 1e-3
    """Viscosity of the water in Pa s."""
    density: Annotated[KilogramsPerCubicMetre, Gt(0)] = 998.0
    """Density of the water."""
    sound_speed: WaterSoundSpeed = 1482.0
    """In the water about the bubble: sets what it radiates, not how that travels."""
    exponent: Annotated[Number, Ge(1), Le(3)] = 1.4
    """Polytropic exponent of the gas: 1 is isothermal."""
    core_ratio: Annotated[Number, Gt(1)] | None = None
    """Radius of the gas at ambient pressure over that of its hard core (van der Waals): 8.86 argon, 8.5 air. Left out:
    an ideal gas."""
    rebounds: Annotated[int, Ge(0), Le(10)] = 1
    """Collapses that are kept after the first; the pulse ends at the top of the last rebound."""
    fade: Annotated[Number, Ge(0), Le(1)] = 0.5
    """Part of the time before the first collapse, and after the last, over which the flow fades in and out."""
    level_below: Annotated[Hertz, Ge(1e3), Le(2e6)] | None = 200e3
    """Frequency of the low pass behind which its peak is taken, for `source_level` and the level that is stored; the
    snap itself is not filtered. From 1 to 3000 Pa of gas at 5 m that peak moves by 3 dB, the unfiltered one (`null`),
    which lasts nanoseconds and is not heard, by 32 dB."""
    largest_mach: Annotated[Number, Gt(0)] = 0.5
    """A bubble whose wall moves faster than this times the speed of sound is refused: the equation is of first order.
    Below 200 kHz even Mach 0.7 changes little."""

    def at_depth(self, depth: float) -> Self:
        """As `PulseModel.at_depth`."""
        return replace(self, depth=max(depth, 0.0)) if self.depth is None else self

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`. Raises ValueError as `collapse`."""
        collapse = self.collapse(depth)
        pulse = bubble_pulse.pulse(collapse, highest, self.fade)
        if self.level_below is None:
            return pulse
        return replace(pulse, peak=bubble_pulse.peak_below(collapse, self.level_below, self.fade))

    def cavity(self, depth: float) -> Cavity:
        """The bubble at its own depth, or else at this one (m), as the equations take it."""
        own_depth = depth if self.depth is None else self.depth
        ambient = bubble_collapse.ambient_pressure(own_depth, self.density, surface=self.surface_pressure)
        core = (
            bubble_collapse.hard_core(self.radius, self.gas_pressure, ambient, self.core_ratio)
            if self.core_ratio
            else 0.0
        )
        return Cavity(
            radius=self.radius,
            gas_pressure=self.gas_pressure,
            ambient_pressure=ambient,
            vapour_pressure=self.vapour_pressure,
            surface_tension=self.surface_tension,
            viscosity=self.viscosity,
            density=self.density,
            sound_speed=self.sound_speed,
            exponent=self.exponent,
            core=core,
        )

    def collapse(self, depth: float) -> Collapse:
        """The solved bubble. Raises ValueError where it does not collapse, or faster than `largest_mach`."""
        collapse = bubble_collapse.collapse(self.cavity(depth), self.rebounds)
        if collapse.flag in {bubble_collapse.SETTLED, bubble_collapse.SINGULAR}:
            raise ValueError(f"the bubble has no snap: {collapse.reason}")
        if collapse.mach > self.largest_mach:
            raise ValueError(
                f"the wall reaches {collapse.mach:.3g} times the speed of sound, over largest_mach "
                f"{self.largest_mach:.3g}: first-order theory does not hold; more gas_pressure slows it"
            )
        return collapse


@description
class Ricker(PulseModel):
    """A test pulse: the second derivative of a Gaussian, upside down. Its spectrum is exact."""

    kind: Literal["ricker"] = "ricker"
    frequency: PositiveHertz
    """Where the spectrum is largest."""
    peak: Annotated[Pascals, Gt(0)] = 1.0
    """Pressure at 1 m at t = 0."""

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`."""
        return waveforms.ricker(self.frequency, self.peak, highest)


@description
class Gabor(PulseModel):
    """A test pulse: a tone in a Gaussian. Its spectrum is exact."""

    kind: Literal["gabor"] = "gabor"
    frequency: PositiveHertz
    """Frequency of the tone."""
    cycles: Annotated[Number, Gt(0), Le(1000)] = 5.0
    """Cycles of the tone in the Gaussian's width at half its height."""
    peak: Annotated[Pascals, Gt(0)] = 1.0
    """Pressure at 1 m at t = 0."""

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`."""
        return waveforms.gabor(self.frequency, self.cycles, self.peak, highest)


@description
class SnapVariation:
    """How one snap differs from the next: normal in level and in the logarithm of the width, independent, cut at three
    standard deviations."""

    level: Annotated[Decibels, Ge(0), Le(20)] = 0.0
    """Standard deviation of the level."""
    width: Annotated[Number, Ge(0), Le(0.5)] = 0.0
    """Standard deviation of the natural logarithm of the width: 0.1 is about 10 %."""
