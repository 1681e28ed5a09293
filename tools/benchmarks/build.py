"""`tools/bench build`: the whole remus dataset with 1 and 2 workers: frames per second, memory, identity."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.frame import RECIPE
from sonarsynth import config, planning, schedule


def different(first: Path, second: Path) -> list[str]:
    """Variables whose stored arrays are not identical, bit for bit."""
    import zarr

    a, b = zarr.open_group(first, mode="r"), zarr.open_group(second, mode="r")
    arrays = dict(a.members(max_depth=None))
    return [
        name
        for name, array in arrays.items()
        if isinstance(array, zarr.Array) and np.asarray(array[...]).tobytes() != np.asarray(b[name][...]).tobytes()
    ]


def bench() -> dict[str, Any]:
    """Build the dataset with 1 and with 2 workers and compare."""
    plan = planning.plan(config.load(RECIPE))
    result: dict[str, Any] = {"predicted_core_seconds": plan.predicted_seconds, "predicted_bytes": plan.predicted_bytes}
    with tempfile.TemporaryDirectory() as folder:
        stores = [Path(folder) / f"{workers}.zarr" for workers in (1, 2)]
        for workers, path in zip((1, 2), stores, strict=True):
            report = schedule.build(plan, path, workers=workers).as_json()
            size = sum(f.stat().st_size for f in path.rglob("*") if f.is_file())
            result[f"{workers} workers"] = {**report, "stored_bytes": size}
        result["different_arrays"] = different(*stores)
    return result
