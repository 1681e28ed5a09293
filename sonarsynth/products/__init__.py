"""Results in flight: frozen dataclasses of arrays, shapes in the annotations. The stages meet only here.

Axes: path (an arrival), sensor, sample, snap, target, elevation, azimuth, xyz, term (polynomial over the aperture).
Unless said otherwise arrays are float64, positions in m in the sonar frame, times in s on the clock of the frame (0 is
the instant of the frame; a snap at `Snap.time` is heard a travel time later).
"""

from sonarsynth.products.labels import LEDGER, ORIGINS, Echoes, Ledger, PointLabels, Truth
from sonarsynth.products.paths import FAMILIES, Arrivals, Paths
from sonarsynth.products.results import REASONS, Bearings, EnergyImage, PointCloud, Signals

__all__ = [
    "FAMILIES",
    "LEDGER",
    "ORIGINS",
    "REASONS",
    "Arrivals",
    "Bearings",
    "Echoes",
    "EnergyImage",
    "Ledger",
    "Paths",
    "PointCloud",
    "PointLabels",
    "Signals",
    "Truth",
]
