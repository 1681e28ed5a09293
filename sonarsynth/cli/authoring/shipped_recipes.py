"""The recipes that come with sonarsynth, wherever it is installed, and copies of them that work elsewhere."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import sonarsynth
from sonarsynth.cli.running import BadOption

PACKAGE = Path(sonarsynth.__file__).parent


def shipped() -> dict[str, Path]:
    """The shipped recipes by name: of the clone that runs, else those installed with the package."""
    return _shipped("configs", "*.yaml", PACKAGE.parent / "configs")


def shipped_notebooks() -> dict[str, Path]:
    """The notebooks by name, as plain Python with cell marks; as `shipped`."""
    return _shipped("notebooks", "*.py", PACKAGE.parent / "tools" / "notebooks")


def _shipped(name: str, pattern: str, in_clone: Path) -> dict[str, Path]:
    candidates = (sorted(folder.glob(pattern)) for folder in (in_clone, PACKAGE / name))
    return {file.stem: file for file in next((files for files in candidates if files), [])}


def text_of(name: str, file: Path) -> tuple[str, list[Path], list[str]]:
    """A shipped recipe as the text of a new file, the files that go with it, and the names of those that do not come.

    Commands in its comments name the new file. Raises BadOption where there is no such recipe.
    """
    from sonarsynth.recipe import reading
    from sonarsynth.store.provenance import paths

    files = shipped()
    name = Path(name).stem
    if name not in files:
        raise BadOption(f"--from: '{name}' is none of {', '.join(files) or 'the shipped recipes, which are not there'}")
    text = files[name].read_text(encoding="utf-8")
    text = re.sub(r"\A# yaml-language-server: .*\n", "", text)  # the schema is beside the shipped ones alone
    text = re.sub(rf"configs/{name}\.yaml", lambda _: str(file), text)
    text = re.sub(rf"\b{name}\.zarr", f"{file.stem}.zarr", text)
    beside = [files[name].parent / path for path in paths(reading.read(files[name]).data)]
    existing = [path for path in beside if path.is_file()]
    return text, existing, [path.name for path in beside if path not in existing]


def copy_beside(files: list[Path], folder: Path) -> None:
    """Copy files that a recipe names into its folder. Raises BadOption before any is copied where one is there."""
    for file in files:
        if (folder / file.name).exists():
            raise BadOption(f"{folder / file.name} exists already: nothing was written")
    for file in files:
        shutil.copyfile(file, folder / file.name)
