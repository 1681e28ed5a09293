"""The command line starts light: what each command does not need is not imported for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

READERS = {"xarray", "pandas", "zarr"}
SCHEDULERS = {"dask", "distributed"}
LIBRARIES = READERS | SCHEDULERS | {"numpy", "numba", "llvmlite", "scipy", "trimesh", "embreex", "matplotlib"}


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
    assert loaded & (READERS | SCHEDULERS | {"numba", "llvmlite", "matplotlib", "embreex"}) == set()


def test_a_short_build_needs_no_reader_and_no_scheduler_and_comparing_files_no_compiler(tmp_path: Path) -> None:
    store = str(tmp_path / "s.zarr")
    loaded = loaded_by("build", "configs/remus.yaml", store, "--frames", "3:4")
    assert "sonarsynth.store.writing" in loaded
    assert loaded & (READERS | SCHEDULERS | {"matplotlib", "open3d", "scipy.optimize"}) == set()
    loaded = loaded_by("verify", "--quick", store)
    assert "sonarsynth.store.checking.verifying" in loaded
    assert loaded & (READERS | SCHEDULERS | {"numba", "scipy", "matplotlib", "sonarsynth.recipe"}) == set()
