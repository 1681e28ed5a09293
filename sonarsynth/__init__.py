"""sonarsynth: labelled synthetic datasets of snapping-shrimp passive sonar: traced, beamformed, ranged, and true.

    import sonarsynth as ss

    recipe = ss.load("configs/remus.yaml")          # or ss.Recipe(scene=ss.Scene(world=ss.World(...)))
    print(ss.plan(recipe).stages)
    tree = sonarsynth.render.render(recipe, 0)      # one frame, without a store
    if __name__ == "__main__":                      # worker processes import the script again
        ss.build(recipe, "remus.zarr", frames=range(8))
        print(ss.verify("remus.zarr").ok)

Names are looked up when they are first used, so importing the package is light.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sonarsynth.beamforming import DenseDelayAndSum, FocusedDelayAndSum
    from sonarsynth.config import RecipeError, dump, load, loads, schema
    from sonarsynth.description import FieldError
    from sonarsynth.planning import Plan, plan
    from sonarsynth.ranging import IsovelocityRange, RefractedRange, SensorDelays
    from sonarsynth.recipe import Recipe
    from sonarsynth.scattering import Isotropic, MirrorLobe
    from sonarsynth.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
    from sonarsynth.schedule import BuildReport, build
    from sonarsynth.sonar import (
        Band,
        BandPass,
        BeamGrid,
        Converter,
        LowPass,
        PlanarLattice,
        PositionTable,
        Romanis,
        Sonar,
    )
    from sonarsynth.store import verify
    from sonarsynth.synthesis import DirectSum, KernelDeposit
    from sonarsynth.tracing import AutoTracing, Refracted, Straight
    from sonarsynth.tracing.ray_request import RayRequest
    from sonarsynth.world.boundaries import SeaBed, SeaSurface
    from sonarsynth.world.environment import (
        Absorption,
        Cast,
        Environment,
        FlatNoise,
        Isovelocity,
        Tabulated,
        TemperatureSalinity,
        WenzNoise,
    )
    from sonarsynth.world.motion import Circle, Line, Still, Waypoint, Waypoints
    from sonarsynth.world.shapes import Box, Cylinder, LShape, MeshFile, Myring, Remus100, Sphere
    from sonarsynth.world.sources import LogarithmicBubble, SnappingShrimp
    from sonarsynth.world.targets import Target

__all__ = [
    "Absorption",
    "AutoTracing",
    "Band",
    "BandPass",
    "BeamGrid",
    "Box",
    "BuildReport",
    "Cast",
    "Circle",
    "Converter",
    "Cylinder",
    "DenseDelayAndSum",
    "DirectSum",
    "EchoWindow",
    "Environment",
    "FieldError",
    "FlatNoise",
    "FocusedDelayAndSum",
    "Isotropic",
    "Isovelocity",
    "IsovelocityRange",
    "KernelDeposit",
    "LShape",
    "Line",
    "LogarithmicBubble",
    "LowPass",
    "MeshFile",
    "MirrorLobe",
    "Myring",
    "Physics",
    "Plan",
    "PlanarLattice",
    "PositionTable",
    "Processing",
    "RayRequest",
    "Recipe",
    "RecipeError",
    "Refracted",
    "RefractedRange",
    "Remus100",
    "Romanis",
    "Scene",
    "SeaBed",
    "SeaSurface",
    "SensorDelays",
    "SnappingShrimp",
    "Sonar",
    "Sphere",
    "Still",
    "Straight",
    "Tabulated",
    "Target",
    "TemperatureSalinity",
    "Trajectory",
    "Waypoint",
    "Waypoints",
    "WenzNoise",
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
    "beamforming": (
        "DenseDelayAndSum",
        "FocusedDelayAndSum",
    ),
    "config": (
        "RecipeError",
        "dump",
        "load",
        "loads",
        "schema",
    ),
    "description": ("FieldError",),
    "planning": (
        "Plan",
        "plan",
    ),
    "ranging": (
        "IsovelocityRange",
        "RefractedRange",
        "SensorDelays",
    ),
    "recipe": ("Recipe",),
    "scattering": (
        "Isotropic",
        "MirrorLobe",
    ),
    "scene": (
        "EchoWindow",
        "Physics",
        "Processing",
        "Scene",
        "Trajectory",
        "World",
    ),
    "schedule": (
        "BuildReport",
        "build",
    ),
    "sonar": (
        "Band",
        "BandPass",
        "BeamGrid",
        "Converter",
        "LowPass",
        "PlanarLattice",
        "PositionTable",
        "Romanis",
        "Sonar",
    ),
    "store": ("verify",),
    "synthesis": (
        "DirectSum",
        "KernelDeposit",
    ),
    "tracing": (
        "AutoTracing",
        "Refracted",
        "Straight",
    ),
    "tracing.ray_request": ("RayRequest",),
    "world.boundaries": (
        "SeaBed",
        "SeaSurface",
    ),
    "world.environment": (
        "Absorption",
        "Cast",
        "Environment",
        "FlatNoise",
        "Isovelocity",
        "Tabulated",
        "TemperatureSalinity",
        "WenzNoise",
    ),
    "world.motion": (
        "Circle",
        "Line",
        "Still",
        "Waypoint",
        "Waypoints",
    ),
    "world.shapes": (
        "Box",
        "Cylinder",
        "LShape",
        "MeshFile",
        "Myring",
        "Remus100",
        "Sphere",
    ),
    "world.sources": (
        "LogarithmicBubble",
        "SnappingShrimp",
    ),
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
