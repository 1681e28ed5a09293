"""Ground truth of a frame: where everything is, and the levels of its paths."""

from sonarsynth.labels.attribution_of_points import SonarTiming
from sonarsynth.labels.echo_levels import echo_levels
from sonarsynth.labels.frame_truth import label
from sonarsynth.labels.level_band import SLICES, Band
from sonarsynth.labels.link_budget import link_budget
from sonarsynth.labels.path_powers import family, path_powers
from sonarsynth.labels.point_labels import label_points

__all__ = [
    "SLICES",
    "Band",
    "SonarTiming",
    "echo_levels",
    "family",
    "label",
    "label_points",
    "link_budget",
    "path_powers",
]
