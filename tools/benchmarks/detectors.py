"""`tools/bench detectors`: what the detectors without training reach on datasets of shipped recipes. A table.

Average precision at 2 m, over all objects and by their signal to noise (false alarms are those of all objects).
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import sonarsynth as ss
from benchmarks.timing import CONFIGS, markdown

STORES = {"remus": 64, "reef": 64, "survey": 150}
"""Recipes, and how many of their frames are built."""
DETECTORS = {"peaks": ss.ImagePeaks(), "cfar": ss.CellAveraging()}


def bench() -> dict[str, Any]:
    """Figures of each detector on each dataset, as `evaluate --json` has them."""
    found: dict[str, Any] = {}
    for name, frames in STORES.items():
        with tempfile.TemporaryDirectory() as folder:
            store = Path(folder) / f"{name}.zarr"
            ss.build(ss.load(CONFIGS / f"{name}.yaml"), store, products=["image", "cloud"], frames=range(frames))
            found[name] = {
                kind: ss.evaluate(store, ss.detect(store, method)).as_json() for kind, method in DETECTORS.items()
            }
    return found


def table(found: dict[str, Any]) -> str:
    """Rows: each dataset with its objects, then its detectors. Columns: intervals of signal to noise."""
    intervals = {column for by_kind in found.values() for one in by_kind.values() for column in one["by_snr"]}
    columns = sorted(intervals, key=_lower_limit)
    rows = [("", "", "all", *(column.removesuffix(" dB") for column in columns))]
    for name, by_kind in found.items():
        first = next(iter(by_kind.values()))
        objects = [first["by_snr"].get(column, {"objects": ""})["objects"] for column in columns]
        rows.append((f"`{name}.yaml`, {STORES[name]} frames", "objects", *map(str, [first["objects"], *objects])))
        for kind, figures in by_kind.items():
            cells = [figures["by_snr"].get(column) for column in columns]
            precision = (f"{cell['ap_2m']:.2f}" if cell else "" for cell in cells)
            rows.append(("", f"`{kind}`", f"{figures['ap_2m']:.2f}", *precision))
    return "\n".join(markdown(rows))


def _lower_limit(interval: str) -> float:
    """Of an interval such as "under -10 dB", "-10 to -5 dB" or "over 20 dB"."""
    return -math.inf if interval.startswith("under") else float(interval.removeprefix("over ").split()[0])
