"""Ground truth of a frame: where everything is, and the levels of its paths."""

from sonarsynth.labelling.band import SLICES, Band
from sonarsynth.labelling.echoes import echoes
from sonarsynth.labelling.ledger import ledger
from sonarsynth.labelling.powers import Powers, family, path_powers
from sonarsynth.labelling.truth import label

__all__ = ["SLICES", "Band", "Powers", "echoes", "family", "label", "ledger", "path_powers"]
