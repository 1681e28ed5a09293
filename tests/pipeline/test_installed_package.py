"""A wheel and an sdist build, hold what they must, and the wheel runs the first dataset where it is installed alone."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", str(out)], cwd=ROOT, check=True)
    return out


def test_the_wheel_and_the_sdist_hold_recipes_schema_and_notebooks(built: Path) -> None:
    (wheel,), (sdist,) = built.glob("*.whl"), built.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
    assert {"sonarsynth/configs/remus.yaml", "sonarsynth/configs/recipe.schema.json"} <= names
    assert {"sonarsynth/notebooks/first_frame.py", "sonarsynth/py.typed", "sonarsynth/__init__.pyi"} <= names
    assert not any(name.startswith(("tests/", "tools/")) for name in names)
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {"pyproject.toml", "configs/remus.yaml", "tools/docs/mkdocs.yml", "README.md", "LICENSE"} <= inside


def test_the_wheel_runs_the_first_dataset_from_anywhere(built: Path, tmp_path: Path) -> None:
    """In a folder of its own: libraries are those of this environment, sonarsynth is that of the wheel alone."""
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as file:
        file.extractall(tmp_path / "site")
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "site"), "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    where = "import sonarsynth; print(sonarsynth.__file__)"
    for arguments in (
        ["-c", where],
        ["-m", "sonarsynth", "init", "mine.yaml", "--from", "remus"],
        ["-m", "sonarsynth", "build", "mine.yaml", "mine.zarr", "--frames", "0:2", "--workers", "0", "--no-predict"],
        ["-m", "sonarsynth", "verify", "mine.zarr"],
        ["-m", "sonarsynth", "notebooks", "notebooks"],
    ):
        done = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        if where in arguments:
            assert done.stdout.startswith(str(tmp_path))
    assert (tmp_path / "notebooks" / "first_frame.ipynb").is_file()
