"""Snaps beside the logarithmic bubble: a physical bubble, and plain test pulses; how snaps vary."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal, Self

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Decibels, Metres, NonNegativeMetres, Number, Pascals, PositiveHertz
from sonarsynth.description import description
from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, waveforms
from sonarsynth.equations.bubble.bubble_collapse import Collapse
from sonarsynth.equations.bubble.bubble_equations import Cavity, ambient_pressure
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.recordings import RecordedSnap

__all__ = ["Gabor", "KellerMiksis", "RecordedSnap", "Ricker", "SnapVariation"]


LARGEST_MACH = 0.5
"""Of the wall, over the speed of sound: the equation is of first order. Below 200 kHz even Mach 0.7 changes little."""


@description
class KellerMiksis(PulseModel):
    """A bubble of vapour and a little gas that collapses from rest (Keller and Miksis 1980), in water of 20 degC. The
    defaults give 206 dB re 1 uPa at 1 m, peak to peak, below 200 kHz, at 5 m.

    The first collapse is at t = 0. Deeper shrimp snap faster and louder. Levels are of the peak below 200 kHz: that
    before any filter lasts nanoseconds and is not heard.
    """

    kind: Literal["keller_miksis"] = "keller_miksis"
    radius: Annotated[Metres, Ge(1e-4)] = 3.5e-3
    """Largest radius, at rest."""
    gas_pressure: Annotated[Pascals, Gt(0)] = 2000.0
    """Pressure of the gas at the largest radius: less gas, a harder collapse. One whose wall would move faster than
    half the speed of sound is refused."""
    depth: NonNegativeMetres | None = None
    """Depth whose pressure drives the collapse; left out: that of the shrimp."""
    rebounds: Annotated[int, Ge(0), Le(10)] = 1
    """Collapses that are kept after the first; the pulse ends at the top of the last rebound."""

    def at_depth(self, depth: float) -> Self:
        """As `PulseModel.at_depth`."""
        return replace(self, depth=max(depth, 0.0)) if self.depth is None else self

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`. Raises ValueError as `collapse`."""
        return bubble_pulse.pulse(self.collapse(depth), highest)

    def collapse(self, depth: float) -> Collapse:
        """The solved bubble, at its own depth or else at this one (m). Raises ValueError where it does not collapse, or
        too fast."""
        ambient = ambient_pressure(depth if self.depth is None else self.depth)
        collapse = bubble_collapse.collapse(Cavity(self.radius, self.gas_pressure, ambient), self.rebounds)
        if collapse.mach > LARGEST_MACH:
            raise ValueError(
                f"the wall reaches {collapse.mach:.3g} times the speed of sound, over {LARGEST_MACH:g}: first-order "
                "theory does not hold; more gas_pressure slows it"
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
