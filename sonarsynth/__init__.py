"""sonarsynth: labelled synthetic sonar datasets: pressure, images, point clouds, and the exact truth of each.

    import sonarsynth as ss
    recipe = ss.load("configs/remus.yaml")
    print(ss.plan(recipe))                           # stages, errors, time and size, before anything is built
    frame = ss.render(recipe, 0)                     # one frame as an xarray.DataTree, without a store
    if __name__ == "__main__":                       # worker processes import the script again
        ss.build(recipe, "remus.zarr", frames=range(8))
        tree = ss.open("remus.zarr")
        print(ss.verify("remus.zarr").ok)

Recipes are written in YAML or with the classes below; these are looked up when they are first used.
"""

from __future__ import annotations

import importlib
import re
from typing import Any

with open(f"{__file__}i", encoding="utf-8") as _stub:  # which names the home of each export for type checkers too
    _IMPORTS = re.findall(r"^from sonarsynth\.(\S+) import (\([^)]*\)|.*)", _stub.read(), re.MULTILINE)
_HOMES = {exported: (home, name) for home, names in _IMPORTS for name, exported in re.findall(r"(\w+) as (\w+)", names)}

__all__ = sorted(_HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'sonarsynth' has no attribute '{name}'")
    home, attribute = _HOMES[name]
    return globals().setdefault(name, getattr(importlib.import_module(f"sonarsynth.{home}"), attribute))


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
