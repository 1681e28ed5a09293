"""Results in flight: frozen dataclasses of arrays, shapes in the annotations. The stages meet only here.

Axes: path (an arrival), sensor, sample, emission (a snap), estimate, target, elevation, azimuth, point, xyz, term
(polynomial over the aperture).
Unless said otherwise arrays are float64, positions in m in the sonar frame, times in s on the clock of the frame (0 is
the instant of the frame; a snap at `Emission.time` is heard a travel time later).
"""

from sonarsynth.products.array_expansion import ArrayExpansion
from sonarsynth.products.labels import LINK_BUDGET, ORIGINS, SPLITS, VIEWS, Echoes, LinkBudget, PointLabels, Truth, View
from sonarsynth.products.paths import DIRECT, FAMILIES, Arrivals, Kind, Paths
from sonarsynth.products.results import (
    REASONS,
    EnergyImage,
    LateSegment,
    LateSignals,
    PointCloud,
    Signals,
    SourceEstimates,
    no_points,
)
from sonarsynth.products.steered_spectra import BeamSpectra, Snapshots

__all__ = [
    "DIRECT",
    "FAMILIES",
    "LINK_BUDGET",
    "ORIGINS",
    "REASONS",
    "SPLITS",
    "VIEWS",
    "ArrayExpansion",
    "Arrivals",
    "BeamSpectra",
    "Echoes",
    "EnergyImage",
    "Kind",
    "LateSegment",
    "LateSignals",
    "LinkBudget",
    "Paths",
    "PointCloud",
    "PointLabels",
    "Signals",
    "Snapshots",
    "SourceEstimates",
    "Truth",
    "View",
    "no_points",
]
