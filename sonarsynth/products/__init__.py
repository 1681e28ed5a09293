"""Results in flight: frozen dataclasses of arrays, shapes in the annotations. The stages meet only here.

Axes: path (an arrival), sensor, sample, snap, target, elevation, azimuth, xyz, term (polynomial over the aperture).
Unless said otherwise arrays are float64, positions in m in the sonar frame, times in s on the clock of the frame (0 is
the instant of the frame; a snap at `Snap.time` is heard a travel time later).
"""

from sonarsynth.products.labels import LINK_BUDGET, ORIGINS, Echoes, LinkBudget, PointLabels, Truth
from sonarsynth.products.paths import FAMILIES, Arrivals, Paths
from sonarsynth.products.results import REASONS, EnergyImage, PointCloud, Signals, SourceEstimates

__all__ = [
    "FAMILIES",
    "LINK_BUDGET",
    "ORIGINS",
    "REASONS",
    "Arrivals",
    "Echoes",
    "EnergyImage",
    "LinkBudget",
    "Paths",
    "PointCloud",
    "PointLabels",
    "Signals",
    "SourceEstimates",
    "Truth",
]
