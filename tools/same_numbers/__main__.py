"""tools/same COMMIT: frames of every shipped recipe by two commits, compared."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import zarr

from . import harbour

ROOT = Path(__file__).resolve().parents[2]


def main() -> int:
    """Exit status: 0 where every array that both commits store is the same, 1 where one differs, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="tools/same", description=__doc__)
    parser.add_argument("commit", help="what to compare this checkout with")
    parser.add_argument("--recipes", default="", help="names in configs/, such as remus,tank (default: all)")
    parser.add_argument("--frames", type=int, default=3, help="frames of each recipe")
    parser.add_argument("--renamed", action="append", default=[], metavar="OLD=NEW", help="a path of a group or array")
    options = parser.parse_args()
    renamed = dict(pair.split("=", 1) for pair in options.renamed)
    wanted = [name for name in options.recipes.split(",") if name]
    same = True
    with tempfile.TemporaryDirectory(prefix="same-") as base:
        old = _checked_out(options.commit, Path(base) / "old")
        names = sorted(path.stem for path in (old / "configs").glob("*.yaml"))
        for name in (name for name in names if name in wanted or not wanted):
            stores = {}
            for label, tree in (("old", old), ("new", ROOT)):
                place = Path(base) / f"{label}-{name}"
                place.mkdir()
                stores[label] = _build(tree, name, place, options.frames)
            same &= _compare(name, options.frames, stores["old"], stores["new"], renamed)
    return 0 if same else 1


def _checked_out(commit: str, place: Path) -> Path:
    """The files of a commit in a folder of its own. Raises SystemExit where there is no such commit."""
    place.mkdir()
    archive = subprocess.run(["git", "-C", str(ROOT), "archive", commit], capture_output=True, check=False)
    if archive.returncode:
        raise SystemExit(archive.stderr.decode().strip())
    subprocess.run(["tar", "-x", "-C", str(place)], input=archive.stdout, check=True)
    return place


def _build(tree: Path, name: str, place: Path, frames: int) -> Path:
    """Build the first frames of a recipe with the code of a checkout. Raises SystemExit where it fails."""
    store = place / f"{name}.zarr"
    python = [sys.executable, "-P"]
    environment = os.environ | {"PYTHONPATH": str(tree)}
    found = subprocess.run(
        [*python, "-c", "import sonarsynth; print(sonarsynth.__file__)"],
        env=environment, cwd=tree, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    if not found.startswith(str(tree)):
        raise SystemExit(f"{tree}: the code of another checkout runs ({found.strip()})")
    sets = [part for value in (harbour.written(place) if name == "harbour" else ()) for part in ("--set", value)]
    recipe = str(tree / "configs" / f"{name}.yaml")
    command = [*python, "-m", "sonarsynth", "build", recipe, str(store), "--workers", "0", *sets]
    for some in (f"0:{frames}", "0"):  # a recipe may have one frame only
        done = subprocess.run(
            [*command, "--frames", some], env=environment, cwd=tree, capture_output=True, text=True, check=False
        )
        if done.returncode == 0:
            return store
    raise SystemExit(f"{name} by {tree}: status {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def _compare(name: str, frames: int, old: Path, new: Path, renamed: Mapping[str, str]) -> bool:
    """Print what differs between the first frames of two stores, and what a frame costs in both. True where nothing
    does."""
    after = _arrays(new, frames)
    before = {_renamed(path, renamed): array for path, array in _arrays(old, frames).items()}
    both = sorted(before.keys() & after.keys())
    different = {path: text for path in both if (text := _differs(before[path], after[path]))}
    print(
        f"{name}: {len(both) - len(different)} arrays are the same; "
        f"CPU time a frame {_cpu(old):.0f} ms, now {_cpu(new):.0f} ms",
        flush=True,
    )
    for path, text in different.items():
        print(f"  {path}: {text}")
    for label, paths in (("gone", before.keys() - after.keys()), ("new", after.keys() - before.keys())):
        if paths:
            print(f"  {label}: {', '.join(sorted(paths))}")
    return not different


def _renamed(path: str, renamed: Mapping[str, str]) -> str:
    for old, new in renamed.items():
        if path == old or path.startswith(f"{old}/"):
            return new + path[len(old) :]
    return path


def _arrays(store: Path, frames: int) -> dict[str, np.ndarray]:
    """Every array of a store by its path, as stored; so many frames of those that have them."""
    members = zarr.open_group(store, mode="r").members(max_depth=None)
    arrays = {path: node for path, node in members if isinstance(node, zarr.Array)}
    return {path: np.asarray(a[:frames] if _of_frames(a) else a[...]) for path, a in arrays.items()}


def _of_frames(array: zarr.Array) -> bool:
    names = getattr(array.metadata, "dimension_names", None)
    return bool(names) and names[0] == "frame"


def _differs(old: np.ndarray, new: np.ndarray) -> str:
    """How two arrays differ, "" where no bit does."""
    numbers = old.dtype.kind in "fiu"
    if old.shape != new.shape or (numbers and old.dtype != new.dtype):
        return f"{old.dtype} {old.shape}, now {new.dtype} {new.shape}"
    if not numbers:
        return "" if list(map(str, old.ravel())) == list(map(str, new.ravel())) else "other texts"
    if old.tobytes() == new.tobytes():
        return ""
    a, b = np.nan_to_num(old.astype(float)), np.nan_to_num(new.astype(float))
    apart, largest = np.abs(a - b).max(), np.abs(a).max()
    return f"{np.count_nonzero(old != new)} of {old.size} values, by {apart:.2g} at most (the largest is {largest:.2g})"


def _cpu(store: Path) -> float:
    """CPU time (ms) of the cheapest frame: others may compile."""
    rows = [json.loads(line) for line in store.with_name(f"{store.name}.times.jsonl").read_text().splitlines()]
    return 1e3 * min(sum(row["cpu"].values()) for row in rows if "cpu" in row)


if __name__ == "__main__":
    sys.exit(main())
