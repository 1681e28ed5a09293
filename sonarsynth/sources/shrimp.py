"""Sources: snapping shrimp, and the snap that they make."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Lt, MinLen

from sonarsynth.conventions import Decibels, Metres, NonNegativeMetres, Number, Position, Seconds
from sonarsynth.description import BY_KIND, description
from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation


@description
class LogarithmicBubble:
    """The thesis's snap (eq. 7 and 8): R(t) = a (1 + erf(k (t - m)/sqrt 2)) ln(1 + q t), t <= 0, in metres and seconds.

    The printed constants b, c, d are permuted: b is our q, c is k, d is m. The collapse is at t = 0.
    """

    kind: Literal["logarithmic_bubble"] = "logarithmic_bubble"
    a: Annotated[Metres, Gt(0)] = 4.758856979338349e-04
    k: Annotated[Number, Gt(0)] = 3.782988768729427e03
    """Growth rate (1/s)."""
    m: Annotated[Seconds, Lt(0)] = -6.172539122042230e-04
    """Middle of the growth (s)."""
    q: Annotated[Number, Lt(0)] = -1.494179079227920e05
    """Collapse time scale, negative (1/s)."""
    density: Annotated[Number, Gt(0)] = 1000.0
    """Water density (kg/m3) in p = (rho/r) d(R^2 R')/dt; sea water of 1025 makes a snap 0.21 dB louder."""


SnapModel = Annotated[LogarithmicBubble | KellerMiksis | RecordedSnap | Ricker | Gabor, BY_KIND]
"""The models of a snap, by `kind`."""


@description
class SnappingShrimp:
    """A shrimp on the bottom that snaps at given times."""

    kind: Literal["snapping_shrimp"] = "snapping_shrimp"
    name: str = "shrimp"
    """For people; nothing depends on it."""
    position: tuple[Metres, Metres] | Position
    """(x, y) on the bottom, or (x, y, z)."""
    height: NonNegativeMetres = 0.0
    """Height above the bottom, where z is left out."""
    snap: SnapModel = LogarithmicBubble()
    """What a snap sounds like at 1 m."""
    source_level: Annotated[Decibels, Ge(-200), Le(300)] | None = None
    """Peak source level (dB re 1 uPa at 1 m; before any filter, of a Keller-Miksis bubble below its `level_below`) to
    scale the snap to; left out: the snap's own level."""
    variation: SnapVariation = SnapVariation()
    """How its snaps differ; left out: they do not."""
    snap_times: Annotated[tuple[Seconds, ...], MinLen(1)] = (0.0,)
    """Times of collapse (s) after the instant of each frame."""


Source = Annotated[SnappingShrimp, BY_KIND]
"""What makes sound, by `kind`."""
