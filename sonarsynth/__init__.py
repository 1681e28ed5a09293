"""sonarsynth: labelled synthetic datasets of snapping-shrimp passive sonar: traced, beamformed, ranged, and true.

    import sonarsynth as ss

    recipe = ss.load("configs/remus.yaml")          # or ss.Recipe(scene=ss.Scene(world=ss.World(...)))
    print(ss.plan(recipe).stages)
    ss.build(recipe, "remus.zarr", frames=range(8))
    print(ss.verify("remus.zarr").ok)
    tree = xarray.open_datatree("remus.zarr", engine="zarr")

Names are looked up when they are first used, so importing the package is light. One frame without a store:
`sonarsynth.render.render(recipe, 0)`. Shapes, motions, beamformers and the other interchangeable parts are in
`sonarsynth.world`, `sonarsynth.beamforming`, and so on.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sonarsynth.config import RecipeError, dump, load, loads, schema
    from sonarsynth.description import FieldError
    from sonarsynth.planning import Plan, plan
    from sonarsynth.recipe import Recipe
    from sonarsynth.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
    from sonarsynth.schedule import BuildReport, build
    from sonarsynth.sonar import Band, BeamGrid, Converter, Sonar
    from sonarsynth.store import verify
    from sonarsynth.world.environment import Environment
    from sonarsynth.world.sources import SnappingShrimp
    from sonarsynth.world.targets import Target

__all__ = [
    "Band",
    "BeamGrid",
    "BuildReport",
    "Converter",
    "EchoWindow",
    "Environment",
    "FieldError",
    "Physics",
    "Plan",
    "Processing",
    "Recipe",
    "RecipeError",
    "Scene",
    "SnappingShrimp",
    "Sonar",
    "Target",
    "Trajectory",
    "World",
    "build",
    "dump",
    "load",
    "loads",
    "plan",
    "schema",
    "verify",
]

_HOMES = {
    "config": ("RecipeError", "dump", "load", "loads", "schema"),
    "description": ("FieldError",),
    "planning": ("Plan", "plan"),
    "recipe": ("Recipe",),
    "scene": ("EchoWindow", "Physics", "Processing", "Scene", "Trajectory", "World"),
    "schedule": ("BuildReport", "build"),
    "sonar": ("Band", "BeamGrid", "Converter", "Sonar"),
    "store": ("verify",),
    "world.environment": ("Environment",),
    "world.sources": ("SnappingShrimp",),
    "world.targets": ("Target",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sonarsynth' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"sonarsynth.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
