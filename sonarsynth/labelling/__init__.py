"""Ground truth of a frame: where everything is, and the levels of its paths."""

from sonarsynth.labelling.attributing import Listening
from sonarsynth.labelling.band import SLICES, Band
from sonarsynth.labelling.echoes import echoes
from sonarsynth.labelling.ledger import ledger
from sonarsynth.labelling.points import label_points
from sonarsynth.labelling.powers import Powers, family, path_powers
from sonarsynth.labelling.truth import label

__all__ = [
    "SLICES",
    "Band",
    "Listening",
    "Powers",
    "echoes",
    "family",
    "label",
    "label_points",
    "ledger",
    "path_powers",
]
