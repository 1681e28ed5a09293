"""Choice of the located snap that is taken to illuminate the targets: the one whose echoes stand out most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.location.pulse_times import transit
from sonarsynth.receiver import Elements, Sonar

NEAREST = 1.0
"""Range (m) assumed for a snap of unknown range: so near that it counts as a weak one."""


def light_first(
    estimates: SourceEstimates, signals: Signals, elements: Elements, sonar: Sonar, opens: float, closes: float
) -> SourceEstimates:
    """The estimates, reordered so that the snap that illuminates is first: its time is the clock of the frame.

    The score of a snap is its source pressure (its largest pressure times its range) over the rms pressure in its echo
    window, from `opens` to `closes` (s) after its direct arrival: other snaps in that window hide its echoes. Snaps
    whose echo window is not wholly in the record come last, in their old order. No truth is used.
    """
    within = in_record(estimates, signals, opens, closes)
    if within.sum() < 2 and within[:1].all():
        return estimates
    score = np.full(len(within), -np.inf)
    for row in np.flatnonzero(within):
        time = float(estimates.time[row])
        near = np.abs(_part(signals, time, time, transit(elements, sonar.assumed_sound_speed)))
        range_ = float(np.linalg.norm(estimates.position[row]))
        source = float(near.max(initial=0.0)) * (range_ if np.isfinite(range_) else NEAREST)
        others = _part(signals, time + opens, time + closes).astype(float)
        score[row] = source / max(float(np.sqrt(np.mean(others**2))), 1e-30)
    order = np.argsort(-score, kind="stable")
    return replace(estimates, **{name: value[order] for name, value in vars(estimates).items()})


def in_record(estimates: SourceEstimates, signals: Signals, opens: float, closes: float) -> Bools:
    """Whether (estimate,) the whole echo window of each is in the record; false without a time."""
    end = signals.start + signals.pressure.shape[1] / signals.sampling_frequency
    with np.errstate(invalid="ignore"):
        return np.asarray((signals.start <= estimates.time + opens) & (estimates.time + closes <= end))


def _part(signals: Signals, start: float, stop: float, margin: float = 0.0) -> Floats:
    """Pressure (sensor, sample) from start to stop (s) of the record, and `margin` (s) more at either end."""
    first, last = ((t - signals.start) * signals.sampling_frequency for t in (start - margin, stop + margin))
    return np.asarray(signals.pressure[:, max(int(np.floor(first)), 0) : max(int(np.ceil(last)), 0) + 1])
