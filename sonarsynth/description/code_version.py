"""What made a number: the code of this package, and the libraries that touch numbers."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

LIBRARIES: Final = (
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "trimesh",
    "embreex",
    "open3d",
    "gsw",
    "numcodecs",
    "google-crc32c",
    "zarr",
    "xarray",
    "dask",
    "distributed",
    "pydantic",
    "ruamel.yaml",
)
"""What touches numbers on their way from the recipe to the disk; those that are not installed are left out."""


@cache  # reading the metadata of all libraries takes a quarter of the time in which a small store is laid out
def versions() -> Mapping[str, str]:
    """Versions of Python, of the libraries that touch numbers, and of the BLAS."""
    numbers = {"python": f"{platform.python_implementation()} {platform.python_version()}"}
    for name in LIBRARIES:
        try:
            numbers[name] = version(name)
        except PackageNotFoundError:
            continue
    import numpy as np

    blas = np.show_config(mode="dicts").get("Build Dependencies", {}).get("blas", {})
    return numbers | {"blas": f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip()}


APART: Final = (
    "frontiers",
    "cli",
    "evaluation",
    "pictures",
    "schedule",
    "store/cards",
    "validation",
    "__main__.py",
    "__init__.py",
)
"""Parts of the package that change no stored number."""


@cache
def code_digest() -> str:
    """SHA-256 of the sources, with their paths within the package."""
    package = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        inside = file.relative_to(package).as_posix()
        if not any(inside == folder or inside.startswith(f"{folder}/") for folder in APART):
            digest.update(f"{inside}\n".encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
