"""What people write of a chorus of snapping shrimp."""

from __future__ import annotations

from typing import Annotated, Final, Literal, get_args

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Floats, Metres, Number, PositiveMetres, PositiveSeconds
from sonarsynth.description import description
from sonarsynth.sources.shrimp import LogarithmicBubble, SnapModel

SnapDensity = Literal["mud", "harbour", "reef", "rubble"]

DENSITIES: Final[dict[SnapDensity, tuple[float, float]]] = {
    "mud": (1e-6, 1e-5),
    "harbour": (1e-5, 2e-4),
    "reef": (1e-4, 2e-3),
    "rubble": (2e-3, 1e-2),
}
"""Ranges (snaps/(m2 s)) by what the bottom is. Estimates: sources of 185 dB so dense make the 20 snaps/s over 140 dB
and 3 to 4 over 150 dB that Cato and Bell (1991, MRL-TR-91-23) counted near rock and rubble; the ends are guesses."""

WIDTHS = 8
"""Widths that snaps come in, equally likely: the medians of as many equal parts of their law."""


@description
class Clusters:
    """Snaps that come together: a Neyman-Scott process. Source: Neyman and Scott (1958), J. R. Stat. Soc. B 20, 1."""

    snaps: Annotated[Number, Ge(0.1), Le(100)] = 3.0
    """Snaps of a cluster: the mean of a Poisson law, so that counts over long times have a Fano factor of 1 + snaps."""
    radius: Annotated[PositiveMetres, Le(20)] = 2.0
    """Radius of a cluster on the bottom, evenly filled."""
    duration: Annotated[PositiveSeconds, Le(1)] = 0.1
    """Duration of a cluster, evenly filled."""


@description
class Chorus:
    """Snapping shrimp all over the bottom. Each snap is heard directly and by the images of surface and bottom; it
    lights nothing: its echoes off targets are left out."""

    density: SnapDensity | Annotated[Number, Ge(0), Le(1)] = 1.5e-4
    """Snaps per m2 of bottom and second; or what the bottom is, which stands for the geometric mean of a range of
    estimates: mud 3.2e-6, harbour 4.5e-5, reef 4.5e-4, rubble 4.5e-3."""
    level: Annotated[Decibels, Ge(0), Le(250)] = 185.0
    """Mean of the peak source level (dB re 1 uPa at 1 m, before any filter)."""
    deviation: Annotated[Decibels, Ge(0), Le(10)] = 5.0
    """Standard deviation of the source level, which is normal in dB."""
    width: Annotated[Number, Ge(0), Le(0.5)] = 0.1
    """Standard deviation of the natural logarithm of the width of snaps."""
    snap: SnapModel = LogarithmicBubble()
    """What a snap sounds like."""
    clusters: Clusters | None = None
    """How snaps come together; left out: each by itself, in place and time (Poisson)."""
    reach: Literal["auto"] | Annotated[Metres, Ge(1), Le(3000)] = "auto"
    """Horizontal distance from the array to which snaps are heard one by one; `auto`: where those beyond bring under
    2 % of the power, or are so many that their sum is Gaussian noise (with `distant`), but 3000 m at most."""
    images: Literal["auto"] | Annotated[int, Ge(0), Le(200)] = "auto"
    """Reflections at surface and bottom that are followed, in all; `auto`: until more bring under 1 % of the power."""

    distant: bool = True
    """Whether snaps beyond the reach are heard, as Gaussian noise of their spectrum and directions, where they bring
    2 % of the power or more."""

    @property
    def rate(self) -> float:
        """Snaps/(m2 s)."""
        if isinstance(self.density, str):
            low, high = DENSITIES[self.density]
            return float(np.sqrt(low * high))
        return self.density

    @property
    def widths(self) -> Floats:
        """(width,) that a snap lasts over its model, each as likely."""
        from scipy.special import ndtri

        return np.asarray(np.exp(self.width * ndtri((np.arange(WIDTHS) + 0.5) / WIDTHS)), float)

    def row(self) -> str:
        """What `plan` shows of it."""
        law = "" if self.clusters is None else f" in clusters of {self.clusters.snaps:g}"
        named = f" ({self.density}: an estimate)" if isinstance(self.density, str) else ""
        return f"{self.rate:.2g} snaps/(m2 s){named}{law}, {self.level:g} dB +- {self.deviation:g} dB"


assert set(DENSITIES) == set(get_args(SnapDensity))
