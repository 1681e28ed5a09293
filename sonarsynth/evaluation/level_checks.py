"""Levels: whether they add up, and whether the signals have them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.evaluation.checks import SmallVariables, every, numbered
from sonarsynth.products import LINK_BUDGET
from sonarsynth.store.checking.check_rows import Check

if TYPE_CHECKING:
    import xarray as xr

LINK_BUDGET_TOLERANCE = 0.1  # dB

INAUDIBLE = 120.0
"""dB under the direct snap: echoes weaker than this are below what a converter, or single precision, holds."""


def link_budget_adds_up(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """received = source - loss_out + scattering - loss_in - absorption - boundary for every path family."""
    budget = {name: every(tree, f"link_budget/{name}")[frames] for name in LINK_BUDGET}
    total = budget["source_level"] + budget["scattering"]
    for loss in ("transmission_loss_out", "transmission_loss_in", "absorption_loss", "boundary_loss"):
        total = total - budget[loss]
    apart = np.abs(total - budget["received_level"])
    worst = float(np.nanmax(apart, initial=0.0))
    return Check(
        "link budget adds up",
        f"within {LINK_BUDGET_TOLERANCE} dB",
        f"{worst:.2g} dB",
        worst <= LINK_BUDGET_TOLERANCE,
        {"worst_db": worst},
        numbered(frames[(apart > LINK_BUDGET_TOLERANCE).reshape(len(frames), -1).any(axis=1)]),
    )


FAINTEST = -600.0
"""dB re 1 uPa: single precision holds nothing of fainter signals, so that nothing can be measured."""


def link_budget_measured(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The level predicted for the loudest path of each family is that of the signals of this path alone.

    Such signals are made wherever signals are: a level that is missing there is a failure. They are as good as was
    asked for.
    """
    tolerance = max(LINK_BUDGET_TOLERANCE, float(20.0 * np.log10(1.0 + tree.attrs.get("accuracy_signal", 0.0))))
    name, expected = "link budget measured in signals", f"within {tolerance:.2g} dB"
    if "measured_level" not in tree["link_budget"].dataset:
        return Check(name, expected, "not in this store", None, {})
    predicted, measured = (
        every(tree, f"link_budget/{level}")[frames] for level in ("isolated_level", "measured_level")
    )
    predicted = np.where(predicted > FAINTEST, predicted, np.nan)
    has_signals = np.isfinite(measured).any() or bool(tree.attrs.get("products"))
    count = int(np.isfinite(predicted).sum())
    if not (has_signals and count):
        return Check(name, expected, "not measured: no signals were made" if count else "no paths", None, {})
    apart = np.abs(measured - predicted)[np.isfinite(predicted)]
    missing = int((~np.isfinite(apart)).sum())
    worst = float(np.max(apart, initial=0.0, where=np.isfinite(apart)))
    result = f"{worst:.2g} dB over {count - missing} paths" + (f", {missing} without a level" if missing else "")
    good = worst <= tolerance and not missing
    bad = np.isfinite(predicted) & ~(np.abs(measured - predicted) <= tolerance)
    spoiled = numbered(frames[bad.reshape(len(frames), -1).any(axis=1)])
    return Check(name, expected, result, good, {"worst_db": worst, "paths": count, "missing": missing}, spoiled)


def echoes_heard(block: SmallVariables, frame: int) -> bool:
    """Whether the link budget, where there is one, has an echo less than INAUDIBLE below the direct snap."""
    if not block.has("link_budget"):
        return True
    level = block.of("link_budget/received_level", frame)  # (snap, echo, family), the direct path last
    echo, direct = (np.max(path, initial=-np.inf, where=np.isfinite(path)) for path in (level[:, :-1], level[:, -1:]))
    return bool(echo > direct - INAUDIBLE)


def snaps_heard(block: SmallVariables, frame: int) -> np.ndarray:
    """(snap,) whether the snap reaches the array directly, by the link budget where there is one."""
    if not block.has("link_budget"):
        return np.zeros(0, bool)
    return np.asarray(block.of("link_budget/paths", frame)[:, -1].sum(axis=1) > 0)
