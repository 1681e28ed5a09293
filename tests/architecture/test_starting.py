"""The command line starts light: what each command does not need is not imported for it."""

from __future__ import annotations

import subprocess
import sys

import pytest

LIBRARIES = {"numba", "llvmlite", "scipy", "xarray", "dask", "distributed", "zarr", "trimesh", "embreex", "matplotlib"}


def loaded_by(*arguments: str) -> set[str]:
    """Modules that are loaded when a command has ended."""
    code = (
        "import sys\nfrom sonarsynth.cli import main\nsys.argv = ['sonarsynth', *sys.argv[1:]]\n"
        "try:\n    main()\nfinally:\n    print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


@pytest.mark.parametrize("command", [["--help"], ["build", "--help"], ["plan", "--help"], ["verify", "--help"]])
def test_help_needs_no_library_and_no_scene(command: list[str]) -> None:
    loaded = loaded_by(*command)
    assert "sonarsynth.cli" in loaded
    assert loaded & LIBRARIES == set()
    assert loaded & {"sonarsynth.recipe.scene", "sonarsynth.recipe", "sonarsynth.pipeline"} == set()


def test_a_schema_needs_no_compiler_store_or_scheduler() -> None:
    loaded = loaded_by("schema")
    assert "sonarsynth.recipe.scene" in loaded
    assert loaded & {"numba", "llvmlite", "xarray", "dask", "distributed", "zarr", "matplotlib", "embreex"} == set()
