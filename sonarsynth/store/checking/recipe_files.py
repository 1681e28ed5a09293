"""Files that the recipe in a store names: opened only within a folder that the user of the store names.

A store may come from anybody, and its recipe may name any file of whoever repairs it. So each is looked for within
that folder alone, by the end of its path, through no link, and is the one only if it has the digest that the store has
of it: nothing is said of any other.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from typing import Any

from sonarsynth.recipe import Recipe
from sonarsynth.recipe.reading import recipe_of
from sonarsynth.recipe.reading.yaml_source import read_text
from sonarsynth.store import Folder, Mismatch, provenance
from sonarsynth.store.creating import plain_recipe
from sonarsynth.store.files import within


def files_of(path: Folder, attrs: Mapping[str, Any], folder: Path | str | None) -> dict[str, str]:
    """Where the files are that a store's recipe names, by their paths in it. Raises Mismatch without a folder, and for
    a file that is not in it as it was."""
    named = sorted(set(provenance.paths(plain_recipe(attrs))))
    if not named:
        return {}
    if folder is None:
        common = os.path.commonpath([os.path.dirname(os.path.abspath(name)) for name in named])
        raise Mismatch(
            f"{path}: its recipe names files, such as {named[0]}, and a store of somebody else may name any of yours: "
            f"say in which folder they may be looked for, such as --files {common}"
        )
    root, digests = Path(os.path.realpath(folder)), _digests(attrs)
    return {name: _file_of_digest(path, name, root, digests.get(PurePath(name).name, set())) for name in named}


def _digests(attrs: Mapping[str, Any]) -> dict[str, set[str]]:
    """SHA-256 of the files that a store was made of, by their names."""
    digests: dict[str, set[str]] = {}
    try:
        for file in attrs["inputs"]["files"]:
            digests.setdefault(str(file["name"]), set()).add(str(file["sha256"]))
    except (KeyError, TypeError):
        pass
    return digests


def _file_of_digest(path: Folder, name: str, root: Path, digests: set[str]) -> str:
    """The file within a folder that has the longest end of a path in common, and one of the digests."""
    names, changed = [folder for folder in PurePath(name).parts if folder not in ("/", "..", ".")], False
    for first in range(len(names)):
        inside = "/".join(names[first:])
        try:
            with within.opened(root, inside) as file:
                changed, digest = True, hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            continue
        if digest in digests:
            return str(root / inside)
    if changed:
        raise Mismatch(f"{path}: a file that its recipe names, {name}, has changed since the store was built")
    raise Mismatch(f"{path}: {name}, which its recipe names, is not in {root}")


def recipe_with(text: str, name: str, files: Mapping[str, str]) -> Recipe:
    """The recipe of a text, with its files where they are. Raises RecipeError."""
    source = read_text(text, name, Path())
    return recipe_of(replace(source, data=_placed(source.data, files)), check_files=False, resolved=True)


def _placed(value: Any, files: Mapping[str, str]) -> Any:
    if isinstance(value, list):
        return [_placed(inner, files) for inner in value]
    if not isinstance(value, dict):
        return value
    for name in provenance.paths({key: value.get(key) for key in ("kind", "path")}):
        return value | {"path": files[name]}
    return {key: _placed(inner, files) for key, inner in value.items()}
