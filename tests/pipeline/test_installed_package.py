"""A wheel and an sdist build, hold what they must, install into a bare environment, and run the first dataset there."""

from __future__ import annotations

import os
import re
import shutil
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


def lend_kernels(installed: Path) -> None:
    """Kernels that the checkout compiled go to the same sources, but for one room's: to compile all takes a minute."""
    for ours in (ROOT / "sonarsynth").rglob("*.py"):
        source = installed / ours.relative_to(ROOT / "sonarsynth")
        assert source.read_bytes() == ours.read_bytes()
        shutil.copystat(ours, source)  # by which numba tells that it is the same
        kernels = ours.parent.glob(f"__pycache__/{ours.stem}.*.nb?") if "ranging" not in ours.parts else ()
        for kernel in kernels:
            (source.parent / "__pycache__").mkdir(exist_ok=True)
            shutil.copy2(kernel, source.parent / "__pycache__")


@pytest.mark.parametrize("kind", ["whl", "tar.gz"])
def test_what_is_built_installs_into_a_bare_environment_and_runs_the_first_dataset(
    kind: str, built: Path, tmp_path: Path
) -> None:
    """Nothing but what the package itself asks for, in the versions of the lock; away from the checkout."""
    (package,) = built.glob(f"*.{kind}")
    locked = re.findall(r"^[a-z0-9][\w.-]*==[^\\\n]+", (ROOT / "tools" / "requirements.lock").read_text(), re.MULTILINE)
    (tmp_path / "constraints.txt").write_text("\n".join(locked))
    python = tmp_path / "bare" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(python.parents[1])], check=True)
    install = [Path(sys.executable).with_name("uv"), "pip", "install", "--quiet", "--python", python]
    subprocess.run([*install, "--constraint", tmp_path / "constraints.txt", package], check=True)
    if kind == "whl":
        lend_kernels(next(python.parents[1].glob("lib/python*/site-packages/sonarsynth")))
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    command = str(python.with_name("sonarsynth"))
    first_dataset = (
        [command, "init", "mine.yaml", "--from", "remus"],
        [command, "build", "mine.yaml", "mine.zarr", "--frames", "0:2", "--workers", "0", "--no-predict"],
        [command, "verify", "mine.zarr"],
        [command, "notebooks", "notebooks"],
    )
    where = [str(python), "-c", "import sonarsynth; print(sonarsynth.__file__)"]
    for arguments in (where, *(first_dataset if kind == "whl" else first_dataset[:1])):
        done = subprocess.run(arguments, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        if arguments is where:
            assert done.stdout.startswith(str(tmp_path))
    assert (tmp_path / "mine.yaml").is_file()
    assert kind != "whl" or (tmp_path / "notebooks" / "first_frame.ipynb").is_file()
