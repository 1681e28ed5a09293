"""Beams of a window of the signals, made when they are asked for: all beams at all frequencies are never held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


@dataclass(frozen=True, eq=False)
class BeamSpectra:
    """What a beamformer hears in any direction."""

    frequency: Floats  # (bin,) Hz, evenly spaced, in the sonar's band
    spacing: float  # Hz between two
    start: float  # s: the sample that phases refer to
    samples: int  # of the window
    sampling_frequency: float  # Hz
    spectra: Callable[[Floats], npt.NDArray[np.complex64]]
    """Spectra (beam, bin) in Pa, as `rfft` gives them, of beams in directions (beam, xyz), sonar frame: a plane wave
    from there gives its own."""
