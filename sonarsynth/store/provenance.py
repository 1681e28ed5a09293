"""Where a store comes from: what it was made of, by what code, with which libraries, on what machine, and when.

What follows from the recipe goes into attributes of its own, the same for every builder of the plan. What another
machine, another day or another check-out would make different is all in one attribute, `provenance`, which says how the
store was begun, is written once, and is no part of what the store is of.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sonarsynth.conventions import finite_json
from sonarsynth.description.code_version import versions
from sonarsynth.description.named_files import digest
from sonarsynth.environment.readers import files_of
from sonarsynth.recipe import FILE_KINDS

if TYPE_CHECKING:
    from sonarsynth.planning import Plan
    from sonarsynth.recipe.reading import Source

PROVENANCE: Final = "provenance"
"""The attribute of the root that differs between two builds of one plan."""

NUMERIC: Final = ("python", "numpy", "scipy", "numba", "llvmlite", "trimesh", "embreex", "open3d", "gsw", "blas")
"""Those whose next version may change the last digits of a number: what sums and transforms, what compiles kernels
(numba reads the bytecode of a minor version of Python), what reads and cleans meshes, what casts rays, what has the
equation of state. The others of `LIBRARIES` carry numbers or pack them; the digest of a shard is of numbers alone."""

_GIT_SECONDS: Final = 10.0


def made_of(plan: Plan) -> dict[str, Any]:
    """Attributes that follow from the plan: what it does, what it was made of, whose it is."""
    dataset = plan.recipe.as_json()["dataset"]
    return {"plan": planned(plan), "inputs": inputs(plan), "dataset": dataset}


def planned(plan: Plan) -> dict[str, Any]:
    """The plan, without predicted times (which are the machine's)."""
    record = plan.as_json()
    for name in ("predicted_seconds", "choices", "shard_frames"):  # attributes of their own, but the first
        record.pop(name)
    record["stages"] = [{name: value for name, value in row.items() if name != "seconds"} for row in record["stages"]]
    finite: dict[str, Any] = finite_json(record)
    return finite


def inputs(plan: Plan) -> dict[str, Any]:
    """SHA-256 of the meshes of each target as used, and of the files that the recipe names (their names, not paths)."""
    recipe = plan.recipe
    meshes = {name: [mesh.digest for mesh in meshes_of_target] for name, meshes_of_target in recipe.meshes.items()}
    files = {(Path(path).name, digest(path)) for path in paths(recipe.as_json())}
    return {"meshes": meshes, "files": [{"name": name, "sha256": sha256} for name, sha256 in sorted(files)]}


def begun(source: Source | None = None) -> dict[str, Any]:
    """How a store is begun, here and now: the attribute `provenance`."""
    return {
        PROVENANCE: {
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "recipe_as_written": "" if source is None else source.text,
            "recipe_settings": [] if source is None else list(source.settings),
            "versions": dict(versions()),
            "machine": machine(),
            "git": git_state(),
        }
    }


def numeric_versions() -> dict[str, str]:
    """Versions of what may change the last digits of a number, in this process."""
    return _numeric(versions())


def _numeric(numbers: Mapping[str, Any]) -> dict[str, str]:
    """Those of `NUMERIC`; of Python the minor version."""
    numeric = {name: str(numbers[name]) for name in NUMERIC if name in numbers}
    if "python" in numeric:
        numeric["python"] = ".".join(numeric["python"].split(".")[:2])
    return numeric


def other_versions(stored: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """What may change last digits and is another here than where a store was begun, by its root attributes: the version
    there and here. What only one of them has is not compared: a store that needs it cannot be built without."""
    begun = stored.get(PROVENANCE)
    stored_versions = begun.get("versions") if isinstance(begun, Mapping) else None
    before, now = _numeric(stored_versions) if isinstance(stored_versions, Mapping) else {}, numeric_versions()
    return {name: (old, now[name]) for name, old in before.items() if now.get(name, old) != old}


def differing(before: Mapping[str, str], now: Mapping[str, str]) -> str:
    """What differs between two sets of versions, in words; "" where nothing does."""
    odd = [name for name in now if before.get(name, now[name]) != now[name]]
    return ", ".join(f"{name} {before[name]} there and {now[name]} here" for name in odd)


def machine() -> dict[str, Any]:
    """Processor, its cores and the system; nothing that names the host, a user or a path."""
    return {
        "cpu": _cpu_model(),
        "architecture": platform.machine(),
        "cores": os.cpu_count() or 0,
        "system": platform.system(),
        "release": _leading_number(platform.release()),
        "distribution": _distribution(),
        "libc": " ".join(platform.libc_ver()).strip(),
        "byte_order": sys.byteorder,
    }


def git_state(package: Path | None = None) -> dict[str, Any] | None:
    """Commit of the check-out that the code runs from, and whether the package differs from it; None outside one."""
    package = Path(__file__).resolve().parent.parent if package is None else package
    tracked = _git(package, "ls-files", "--error-unmatch", "__init__.py")
    commit = None if tracked is None else _git(package, "rev-parse", "HEAD")
    if not commit:
        return None
    changed = _git(package, "status", "--porcelain", "--", ".")
    return {"commit": commit, "dirty": None if changed is None else bool(changed)}


def _git(folder: Path, *arguments: str) -> str | None:
    """What git prints; None where there is no git, or it has no answer."""
    command = ["git", "-C", str(folder), "-c", "core.fsmonitor=false", *arguments]
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    env = inherited | {"GIT_OPTIONAL_LOCKS": "0", "LC_ALL": "C"}
    try:
        done = subprocess.run(
            command,
            env=env,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_GIT_SECONDS,
            check=True,
        )
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return None
    return done.stdout.strip()


def paths(value: Any) -> Iterator[str]:
    """Paths of files in a recipe."""
    if isinstance(value, Mapping):
        if any(value.get("kind") == kind for kind in FILE_KINDS) and isinstance(value.get("path"), str):
            yield from map(str, files_of(Path(value["path"])))
        for inner in value.values():
            yield from paths(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from paths(inner)


def _cpu_model() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() in ("model name", "Processor", "cpu model"):
                return " ".join(value.split())
    except OSError:
        pass
    return platform.processor() or "unknown"


def _distribution() -> str:
    try:
        return str(platform.freedesktop_os_release().get("PRETTY_NAME", ""))
    except OSError:
        return ""


def _leading_number(text: str) -> str:
    """A version without what a builder of kernels may have added, such as a name of a company or a host."""
    match = re.match(r"[\d.]+", text)
    return match[0].rstrip(".") if match else ""
