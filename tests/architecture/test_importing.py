"""`import sonarsynth` is light, and what it offers is what is pinned here."""

from __future__ import annotations

import subprocess
import sys

import sonarsynth

HEAVY = (
    "numba",
    "trimesh",
    "matplotlib",
    "plotly",
    "open3d",
    "xarray",
    "dask",
    "distributed",
    "zarr",
    "scipy",
    "embreex",
    "torch",
)


def loaded_by(code: str) -> set[str]:
    """Top-level modules that are loaded after running code in a fresh interpreter."""
    report = "; import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert loaded_by("import sonarsynth") & set(HEAVY) == set()


def test_a_loaded_library_would_be_seen() -> None:
    assert "scipy" in loaded_by("import scipy")


def test_everything_on_the_surface_is_there_and_explains_itself() -> None:
    for name in sonarsynth.__all__:
        offered = getattr(sonarsynth, name)
        if callable(offered):
            assert offered.__doc__, f"{name} has no docstring"
