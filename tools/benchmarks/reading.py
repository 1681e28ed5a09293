"""`tools/bench reading`: frames per second from a built store, by xarray, by plain zarr and by the frames for
training, on the same arrays. A table, and the ratios to xarray in the same run.

The store is `configs/remus.yaml`, 64 frames in shards of 8, on a warm disk cache. What is read: the arrays that a
network is trained on (energy image, range and target of every beam), the signals, or every array that has frames. How:
single frames in random order, and batches of 32 that follow each other from a random one. xarray decodes as well: fill
values to NaN, counts of a converter to Pa. Best of `ROUNDS`, by the wall clock, and the processor's time of that round,
of all threads. READING_ROUNDS=1 for fewer.

Opening is timed as well: the store, and a made one of 1e5 frames, of which only what opening reads is there.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr

from benchmarks.timing import RECIPE, markdown
from sonarsynth import planning, schedule
from sonarsynth.loading import Frames
from sonarsynth.recipe import reading
from sonarsynth.store import create, layout_of
from sonarsynth.store.encoding import encoded
from sonarsynth.store.frame_reading import FrameReader

ROUNDS = int(os.environ.get("READING_ROUNDS", "3"))
BATCH = 32
TRAINING = ("image/energy", "cloud/range", "truth/beams/target")
"""Arrays that a network is trained on."""

Read = Callable[[slice], list[np.ndarray]]
"""Gives some frames, that follow each other, of every array."""


def by_zarr(path: Path, names: Sequence[str]) -> Read:
    """Plain zarr, its arrays opened once."""
    root = zarr.open_group(path, mode="r")
    arrays = [root[name] for name in names]
    return lambda frames: [np.asarray(array[frames]) for array in arrays]


def by_xarray(path: Path, names: Sequence[str]) -> Read:
    """xarray, the tree opened once: each variable is sliced and loaded."""
    tree = xr.open_datatree(path, engine="zarr", chunks=None)
    return lambda frames: [tree[name].isel(frame=frames).values for name in names]


def by_variables(path: Path, names: Sequence[str]) -> Read:
    """xarray, its variables looked up once: no coordinates are cut along."""
    tree = xr.open_datatree(path, engine="zarr", chunks=None)
    variables = [tree[name].variable for name in names]
    return lambda frames: [variable[frames].values for variable in variables]


def by_frame(path: Path, names: Sequence[str]) -> Read:
    """As `sonarsynth.loading.Frames` reads: frame by frame, without zarr, decoded as `ss.open` does."""
    reader = FrameReader(path)
    arrays = [reader.array(name) for name in names]

    def some(array: Any, frames: slice) -> np.ndarray:
        several = [array[f] for f in range(frames.start, frames.stop)]
        return np.stack(several) if len(several) > 1 else several[0][None]  # a sample is not copied either

    return lambda frames: [some(array, frames) for array in arrays]


WAYS: dict[str, Callable[[Path, Sequence[str]], Read]] = {
    "plain zarr": by_zarr,
    "xarray, tree[name].isel(frame=...)": by_xarray,
    "xarray, tree[name].variable[...]": by_variables,
    "loading.Frames": by_frame,
}


def cut(first: int) -> slice:
    """One frame."""
    return slice(first, first + 1)


def plans(frames: int, random: np.random.Generator) -> dict[str, list[slice]]:
    """What is read in a round, by what it is called."""
    starts = random.integers(0, frames - BATCH + 1, 2)
    return {
        "single": [cut(int(f)) for f in random.permutation(frames)],
        f"batches of {BATCH}": [slice(int(f), int(f) + BATCH) for f in starts],
    }


def paced(read: Read, wanted: Sequence[slice]) -> dict[str, float]:
    """Frames per second, and milliseconds of the processor for each."""
    count = sum(frames.stop - frames.start for frames in wanted)
    rounds = []
    for _ in range(ROUNDS):
        wall, cpu = time.perf_counter(), time.process_time()
        for frames in wanted:
            read(frames)
        rounds.append((time.perf_counter() - wall, time.process_time() - cpu))
    wall, cpu = min(rounds)
    return {"frames_per_second": count / wall, "cpu_ms_a_frame": 1e3 * cpu / count}


def same(reads: Sequence[Read]) -> bool:
    """Whether all ways give the same numbers, but for what xarray decodes."""
    plain, *others = (read(slice(3, 5)) for read in reads)
    return all(
        np.array_equal(a, b, equal_nan=True)
        for other in others
        for a, b in zip(plain, other, strict=True)
        if a.dtype == b.dtype
    )


def opening(path: Path) -> dict[str, float]:
    """Seconds to open the store, the best of five."""
    ways: dict[str, Callable[[], Any]] = {
        "plain zarr": lambda: zarr.open_group(path, mode="r"),
        "xarray": lambda: xr.open_datatree(path, engine="zarr"),
    }
    found = {}
    for name, way in ways.items():
        times = []
        for _ in range(5):
            began = time.perf_counter()
            way()
            times.append(time.perf_counter() - began)
        found[name] = min(times)
    return found


def many(folder: Path) -> dict[str, float]:
    """Seconds to open a store of 1e5 frames, and its train split, with all frames built; the best of three."""
    plan = planning.plan(reading.load(RECIPE.with_name("survey.yaml"), ["repeats=50000"]), products=("image",))
    path = folder / "many.zarr"
    create(path, plan)
    layout, random = layout_of(plan), np.random.default_rng(2)
    for array in layout.arrays:
        if array.path in ("truth/sonar_position", "split"):
            for shard in range(layout.shards):
                shape = (len(layout.region(shard)), *array.shape[1:])
                content = encoded(array, [random.integers(0, 3, shape).astype(array.dtype)])
                (path / array.file(shard)).parent.mkdir(parents=True, exist_ok=True)
                (path / array.file(shard)).write_bytes(content or b"")
    times = {}
    for name, split in (("all", None), ("train", "train")):
        took = []
        for _ in range(3):
            began = time.perf_counter()
            data = Frames(path, split=split)
            took.append(time.perf_counter() - began)
            assert len(data) == 100_000 if split is None else 30_000 < len(data) < 37_000
        times[name] = min(took)
    return times


def bench(path: Path | None = None) -> dict[str, Any]:
    """Frames per second of every way to read, of some arrays, singly and in batches."""
    with tempfile.TemporaryDirectory() as folder:
        if path is None:
            path = Path(folder) / "remus.zarr"
            schedule.build(planning.plan(reading.load(RECIPE)), path)
        arrays = layout_of(planning.plan(reading.load(RECIPE))).arrays
        some = {"image": ("image/energy",), "image, range, target": TRAINING, "signals": ("signals/pressure",)}
        some[f"all {len(arrays)} arrays"] = tuple(a.path for a in arrays if not a.empty)
        wanted = plans(arrays[0].shape[0], np.random.default_rng(1))
        result: dict[str, Any] = {"opening_seconds": opening(path), "load": os.getloadavg()[0], "read": {}}
        result["opening_1e5_seconds"] = many(Path(folder))
        for what, names in some.items():
            reads = {way: make(path, names) for way, make in WAYS.items()}
            assert same(list(reads.values())), what
            result["read"][what] = {
                how: {way: paced(read, cuts) for way, read in reads.items()} for how, cuts in wanted.items()
            }
        return result


def table(result: dict[str, Any]) -> str:
    """The result in Markdown."""
    rows = [["frames/s (ms of processor a frame)", *WAYS]]
    for what, by_how in result["read"].items():
        for how, by_way in by_how.items():
            cells = [f"{r['frames_per_second']:.0f} ({r['cpu_ms_a_frame']:.2f})" for r in by_way.values()]
            rows.append([f"{what}, {how}", *cells])
    lines = markdown(rows)
    opened = ", ".join(f"{way} {1e3 * seconds:.0f} ms" for way, seconds in result["opening_seconds"].items())
    lines += ["", f"opening the store: {opened}; load {result['load']:.1f}"]
    opened = ", ".join(f"{split} {seconds:.2f} s" for split, seconds in result["opening_1e5_seconds"].items())
    lines += [f"loading.Frames of 1e5 frames: {opened}", ""]
    for what, by_how in result["read"].items():
        for how, by_way in by_how.items():
            rate = {way: r["frames_per_second"] for way, r in by_way.items()}
            ratio = rate["loading.Frames"] / rate["xarray, tree[name].isel(frame=...)"]
            lines.append(f"{what}, {how}: loading.Frames reads {ratio:.1f} times as many frames as xarray")
    return "\n".join(lines)
