"""What echoes lose to the echo window, and to the removal of the direct pulse: measured in a few frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.planning.choices import OF_BEAMS
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_arrivals import (
    arrivals_of,
    behind_baffle,
    receiver_of,
    reception_of,
    survey_of,
)
from sonarsynth.planning.notes.source_notes import locator
from sonarsynth.planning.plans import Plan
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.cancelling.direct_pulse import remove
from sonarsynth.signals.auto_synthesis import DEFAULT_ERROR, deposit_for
from sonarsynth.signals.electronics import convert
from sonarsynth.signals.filtered_pulse import snap_levels

NOTED = 1e-3
"""Share of an echo that may be lost without a note."""
MOST = 150.0
"""dB that are said at most: single precision holds no more."""
FAINTEST = 1e-9
"""Share of the echoes of a frame under which a target's echo is not asked for."""


@dataclass(frozen=True, eq=False)
class EchoLosses:
    """Of one frame, by the light of its loudest snap."""

    frame: int
    lost: dict[str, float]  # share of the energy of each target's echo that the image is without; NaN: no echo
    fall: float  # dB by which the energy of the direct pulse falls, as the converter has it
    below: float  # dB: of the echoes over what is left of the direct pulse and of its rounding, in the echo window


def lost_echoes(plan: Plan) -> list[str]:
    """Notes on what echoes lose, where the direct pulse is taken out or the echo window cuts more than their feet."""
    windows = plan.windows
    if not (windows.direct_removed or windows.cut) or not plan.products & OF_BEAMS:
        return []
    rows = [row for index in windows.tight if (row := losses(plan.at(index), index)) is not None]
    lines = []
    chosen = plan.scene.processing.direct_pulse == "auto"
    why = "echoes arrive before it has passed" if chosen else "processing.direct_pulse"
    if windows.direct_removed and not rows:
        lines.append(
            f"the direct pulse is removed ({why}), but no echo is heard in the frames measured: images may have "
            "nothing but what is left of it, and are NaN where they do"
        )
    if windows.direct_removed and rows:
        fall, below = (min([MOST, *(getattr(row, name) for row in rows)]) for name in ("fall", "below"))
        frames = ", ".join(str(row.frame) for row in rows)
        lines.append(
            f"the direct pulse is removed ({why}): it is reduced by {fall:.0f} dB, to {abs(below):.0f} dB "
            f"{'below' if below >= 0 else 'over'} the echoes in their window (measured, frame {frames})"
        )
    loss = "the removal of the direct pulse" if windows.direct_removed else "the echo window"
    for name in plan.recipe.target_names:
        shares = ((row.lost[name], row.frame) for row in rows if row.lost.get(name, np.nan) >= 0)
        share, frame = max(shares, default=(0.0, 0))
        if share > NOTED:
            level = f"{-10 * np.log10(1 - share):.2g} dB" if share < 1 else "all of it"
            percent = f"{100 * share:.1f}" if share < 0.995 else f"{100 * share:.4g}"
            lines.append(f"{name}: {percent} % of its echo ({level}) is lost to {loss} in frame {frame}")
    return lines


def losses(plan: Plan, index: int) -> EchoLosses | None:
    """What is lost in a frame, by the signals of its direct pulse and of each echo alone; None without both.

    `plan` is that of the frame's sequence. What is removed depends on all that is heard, so an echo keeps what signals
    with it hold more, after the removal, than signals without.
    """
    frame, sonar, windows = plan.recipe.frame(index)[1], plan.scene.sonar, plan.windows
    arrivals = behind_baffle(arrivals_of(plan, frame), sonar)
    snaps, start = frame.moment.snaps, frame_start(plan, frame)
    straight = arrivals.direct & (arrivals.surface + arrivals.bottom == 0)
    if not straight.any():
        return None
    loud = np.array(snap_levels(snaps))[arrivals.snap] + 20 * np.log10(np.abs(arrivals.amplitude) + 1e-300)
    first = int(np.argmax(np.where(straight, loud, -np.inf)))
    lit, method = arrivals.snap == arrivals.snap[first], deposit_for(DEFAULT_ERROR)

    def hear(selected: np.ndarray) -> Signals:
        return method.signals(arrivals.select(selected & lit), snaps, reception_of(plan, frame))

    direct = hear(straight)
    echoes = [hear(arrivals.target == target) for target in range(len(frame.moment.bodies))]
    sent = np.array([_energy(echo.pressure) for echo in echoes])
    if not sent.sum() > 0:
        return None
    total = replace(direct, pressure=direct.pressure + sum(echo.pressure for echo in echoes))
    estimates = locator(plan.scene).locate(
        convert(total, sonar.converter), receiver_of(plan, frame), survey_of(plan, frame), 1
    )
    clock = float(estimates.time[0]) if np.isfinite(estimates.time[0]) else float(arrivals.delay[first])
    ends = ((clock + edge - start) * sonar.sampling_frequency for edge in (windows.echo_start, windows.echo_stop))
    window = slice(*(max(int(np.ceil(end)), 0) for end in ends))
    alone = _without(plan, direct, estimates)
    imaged = np.zeros(len(echoes))
    for target, echo in enumerate(echoes):
        both = _without(plan, replace(direct, pressure=direct.pressure + echo.pressure), estimates)
        imaged[target] = _energy((both - alone)[:, window])
    lost = np.where(sent > FAINTEST * sent.sum(), 1 - imaged / np.maximum(sent, 1e-300), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = _without(plan, convert(direct, sonar.converter), estimates)
        fall = 10 * float(np.log10(np.divide(_energy(direct.pressure), _energy(left))))
        below = 10 * float(np.log10(imaged.sum() / _energy(left[:, window])))
    names = [body.name for body in frame.moment.bodies]
    return EchoLosses(index, dict(zip(names, np.clip(lost, 0.0, 1.0).tolist(), strict=True)), fall, below)


def _without(plan: Plan, signals: Signals, estimates: SourceEstimates) -> np.ndarray:
    """Pressure (sensor, sample) as it is imaged; that of the signals where nothing can be, or is to be, taken out."""
    if not plan.windows.direct_removed or not np.isfinite(estimates.time[0]):
        return signals.pressure
    removed = remove(signals, estimates, plan.elements, plan.scene.sonar, plan.windows.supports.clear)
    return (signals if removed is None else removed).pressure


def _energy(pressure: np.ndarray) -> float:
    return float(np.sum(np.square(pressure, dtype=np.float64)))
