"""Snapping shrimp, and the snap that they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from annotated_types import Ge, Gt, Le, Len, Lt

from sonarsynth.conventions import Decibels, Floats, Metres, NonNegativeMetres, Number, Seconds
from sonarsynth.description import BY_KIND, description
from sonarsynth.equations.bubble import waveforms
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.equations.bubble.snap_pressure import Bubble, onset
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation
from sonarsynth.sources.snap_pulses import largest_scales, scales
from sonarsynth.sources.sound_source import Emission, SoundSource


@description
class LogarithmicBubble(PulseModel):
    """The thesis's snap (eq. 7 and 8): R(t) = a (1 + erf(k (t - m)/sqrt 2)) ln(1 + q t), t <= 0, in metres and seconds.

    The printed constants b, c, d are permuted: b is our q, c is k, d is m. The collapse is at t = 0.
    """

    kind: Literal["logarithmic_bubble"] = "logarithmic_bubble"
    a: Annotated[Metres, Gt(0)] = 4.758856979338349e-04
    """Scale of the radius (m)."""
    k: Annotated[Number, Gt(0)] = 3.782988768729427e03
    """Growth rate (1/s)."""
    m: Annotated[Seconds, Lt(0)] = -6.172539122042230e-04
    """Middle of the growth (s)."""
    q: Annotated[Number, Lt(0)] = -1.494179079227920e05
    """Collapse time scale, negative (1/s)."""
    density: Annotated[Number, Gt(0)] = 1000.0
    """Water density (kg/m3) in p = (rho/r) d(R^2 R')/dt; sea water of 1025 makes a snap 0.21 dB louder."""

    @property
    def bubble(self) -> Bubble:
        """The constants, as the equations take them."""
        return Bubble(self.a, self.k, self.m, self.q, self.density)

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`."""
        return waveforms.logarithmic(self.bubble, highest)

    def fault(self, longest: float, limit: float) -> str:
        """As `PulseModel.fault`."""
        duration = -onset(self.bubble)
        if not 1.0 / -self.q < duration:
            return f"grows for {duration:.3g} s and has no time to collapse: q is too small"
        if not longest * duration <= limit:
            return f"grows for {longest * duration:.3g} s; a snap is over in {limit:g} s"
        return ""


SnapModel = Annotated[LogarithmicBubble | KellerMiksis | RecordedSnap | Ricker | Gabor, BY_KIND]
"""The models of a snap, by `kind`."""


ABOVE_RELIEF: Final = 1e-3
"""m between a shrimp and the facet that it sits on."""


@description
class SnappingShrimp(SoundSource):
    """A shrimp on the bottom that snaps at given times."""

    kind: Literal["snapping_shrimp"] = "snapping_shrimp"
    name: str = "shrimp"
    """Name, for people; nothing depends on it."""
    position: Annotated[tuple[Metres, ...], Len(2, 3)]
    """Position (x, y) on the bottom, or (x, y, z): east, north and up, 0 at the surface."""
    height: NonNegativeMetres = 0.0
    """Height above the bottom, where z is left out."""
    snap: SnapModel = LogarithmicBubble()
    """What a snap sounds like at 1 m."""
    source_level: Annotated[Decibels, Ge(-200), Le(300)] | None = None
    """Peak source level (dB re 1 uPa at 1 m; before any filter, of a Keller-Miksis bubble below its `level_below`) to
    scale the snap to; left out: the snap's own level."""
    variation: SnapVariation = SnapVariation()
    """How its snaps differ; left out: they do not."""
    snap_times: tuple[Seconds, ...] = (0.0,)
    """Times of collapse (s) after the instant of each frame; none: it is silent, as it may be in some sequences."""

    times_field: ClassVar[str] = "snap_times"
    pulse_field: ClassVar[str] = "snap"

    def position_at(self, bottom: float, time: float = 0.0) -> Floats:
        """As `SoundSource.position_at`."""
        x, y, *z = self.position
        return np.array([x, y, z[0] if z else self.height - bottom])

    def on_relief(self, bottom: float, ground: Callable[[Floats], float]) -> Self:
        """As `SoundSource.on_relief`."""
        x, y, *z = self.position
        rise = 0.0 if z else ground(np.array([x, y]))
        return self if rise == 0.0 else replace(self, position=(x, y, self.height + rise + ABOVE_RELIEF - bottom))

    @property
    def times(self) -> tuple[float, ...]:
        """As `SoundSource.times`."""
        return self.snap_times

    def model(self, bottom: float) -> PulseModel:
        """As `SoundSource.model`."""
        return self.snap.at_depth(-float(self.position_at(bottom)[2]))

    @property
    def level(self) -> float | None:
        """As `SoundSource.level`."""
        return self.source_level

    @property
    def largest_scales(self) -> tuple[float, float]:
        """As `SoundSource.largest_scales`."""
        return largest_scales(self.variation)

    def emissions(self, bottom: float, random: np.random.Generator, start: float) -> tuple[Emission, ...]:
        """As `SoundSource.emissions`: each snap as loud and as long as is drawn for it."""
        drawn = scales(self.variation, random, len(self.times))
        snaps = zip(self.times, drawn.gain.tolist(), drawn.width.tolist(), strict=True)
        return tuple(self.emission(bottom, start, *snap) for snap in snaps)
