"""What the water does to sound on its way: the description of absorption turned into numbers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.acoustics import seawater
from sonarsynth.conventions import Floats
from sonarsynth.world.environment import Absorption


def absorption_db_per_m(absorption: Absorption, frequency: npt.ArrayLike, depth: npt.ArrayLike) -> Floats:
    """Absorption (dB/m) at frequencies (Hz) and depths (m, positive down), broadcast together.

    Warns with `seawater.OutOfRange` outside the range of the formula.
    """
    water = (absorption.temperature, absorption.salinity)
    match absorption.formula:
        case "francois_garrison":
            return seawater.francois_garrison(frequency, *water, depth, absorption.ph)
        case "ainslie_mccolm":
            return seawater.ainslie_mccolm(frequency, *water, depth, absorption.ph)
        case "none":
            return np.zeros(np.broadcast_shapes(np.shape(frequency), np.shape(depth)))
