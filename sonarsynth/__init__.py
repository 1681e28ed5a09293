"""sonarsynth: labelled synthetic datasets of snapping-shrimp passive sonar: traced, beamformed, ranged, and true.

    import sonarsynth as ss

    recipe = ss.load("configs/remus.yaml")          # or ss.Recipe(scene=ss.Scene(world=ss.World(...)))
    print(ss.plan(recipe).stages)
    tree = sonarsynth.pipeline.render(recipe, 0)      # one frame, without a store
    if __name__ == "__main__":                      # worker processes import the script again
        ss.build(recipe, "remus.zarr", frames=range(8))
        print(ss.verify("remus.zarr").ok)

Names are looked up when they are first used, so importing the package is light.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sonarsynth.description import FieldError
    from sonarsynth.environment.boundaries import (
        FluidHalfSpace,
        PressureRelease,
        ReflectionTable,
        Rigid,
        SeaBed,
        SeaSurface,
        Sediment,
    )
    from sonarsynth.environment.sea import (
        Absorption,
        Cast,
        Catenary,
        Environment,
        FlatNoise,
        Isovelocity,
        Linear,
        Munk,
        Tabulated,
        TemperatureSalinity,
        Thermocline,
        WenzNoise,
    )
    from sonarsynth.geometry.motion import Circle, Course, Line, Still, Waypoint, Waypoints
    from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
    from sonarsynth.planning import Plan, plan
    from sonarsynth.propagation import AutoTracing, Refracted, Straight
    from sonarsynth.propagation.eigenrays import RayArrivals, eigenrays, eigenrays_between
    from sonarsynth.propagation.ray_request import EigenrayRequest, RayRequest
    from sonarsynth.ranging import AutoRange, IsovelocityRange, RefractedRange, SensorDelays, WavefrontCancelling
    from sonarsynth.receiver import (
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
    from sonarsynth.recipe import Accuracy, Axis, Choice, Normal, Recipe, Sobol, Splits, Together, Uniform
    from sonarsynth.recipe.reading import RecipeError, dump, load, loads, schema
    from sonarsynth.recipe.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
    from sonarsynth.scattering import Isotropic, Kirchhoff, MirrorLobe, PartlyReflecting
    from sonarsynth.schedule import BuildReport, build
    from sonarsynth.schedule.repairing import RepairReport, repair
    from sonarsynth.signals import AutoSynthesis, DirectSum, KernelDeposit
    from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
    from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation
    from sonarsynth.store import verify
    from sonarsynth.targets.shapes import Box, Cylinder, LShape, MeshFile, Myring, Remus100, Sphere
    from sonarsynth.targets.target import Target
    from sonarsynth.targets.target_strength import target_strength

__all__ = [
    "Absorption",
    "Accuracy",
    "AutoRange",
    "AutoSynthesis",
    "AutoTracing",
    "Axis",
    "Band",
    "BandPass",
    "BeamGrid",
    "Box",
    "BuildReport",
    "Cast",
    "Catenary",
    "Choice",
    "Circle",
    "Converter",
    "Course",
    "Cylinder",
    "DenseDelayAndSum",
    "DirectSum",
    "EchoWindow",
    "EigenrayRequest",
    "Environment",
    "FieldError",
    "FlatNoise",
    "FluidHalfSpace",
    "FocusedDelayAndSum",
    "Gabor",
    "Isotropic",
    "Isovelocity",
    "IsovelocityRange",
    "KellerMiksis",
    "KernelDeposit",
    "Kirchhoff",
    "LShape",
    "Line",
    "Linear",
    "LogarithmicBubble",
    "LowPass",
    "MeshFile",
    "MirrorLobe",
    "Munk",
    "Myring",
    "Normal",
    "PartlyReflecting",
    "Physics",
    "Plan",
    "PlanarLattice",
    "PositionTable",
    "PressureRelease",
    "Processing",
    "RayArrivals",
    "RayRequest",
    "Recipe",
    "RecipeError",
    "RecordedSnap",
    "ReflectionTable",
    "Refracted",
    "RefractedRange",
    "Remus100",
    "RepairReport",
    "Ricker",
    "Rigid",
    "Romanis",
    "Scene",
    "SeaBed",
    "SeaSurface",
    "Sediment",
    "SensorDelays",
    "SnapVariation",
    "SnappingShrimp",
    "Sobol",
    "Sonar",
    "Sphere",
    "Splits",
    "Still",
    "Straight",
    "Tabulated",
    "Target",
    "TemperatureSalinity",
    "Thermocline",
    "Together",
    "Trajectory",
    "Uniform",
    "WavefrontCancelling",
    "Waypoint",
    "Waypoints",
    "WenzNoise",
    "World",
    "build",
    "dump",
    "eigenrays",
    "eigenrays_between",
    "load",
    "loads",
    "plan",
    "repair",
    "schema",
    "target_strength",
    "verify",
]

_HOMES = {
    "beamforming": "DenseDelayAndSum FocusedDelayAndSum",
    "config": "RecipeError dump load loads schema",
    "description": "FieldError",
    "planning": "Plan plan",
    "ranging": "AutoRange IsovelocityRange RefractedRange SensorDelays WavefrontCancelling",
    "recipe": "Accuracy Axis Choice Normal Recipe Sobol Splits Together Uniform",
    "scattering": "Isotropic Kirchhoff MirrorLobe PartlyReflecting",
    "scattering.strength": "target_strength",
    "scattering.targets": "Target",
    "scene": "EchoWindow Physics Processing Scene Trajectory World",
    "schedule": "BuildReport build",
    "schedule.repairing": "RepairReport repair",
    "sonar": "Band BandPass BeamGrid Converter LowPass PlanarLattice PositionTable Romanis Sonar",
    "store": "verify",
    "synthesis": "AutoSynthesis DirectSum KernelDeposit",
    "tracing": "AutoTracing Refracted Straight",
    "tracing.eigenrays": "RayArrivals eigenrays eigenrays_between",
    "tracing.ray_request": "EigenrayRequest RayRequest",
    "world.boundaries": "FluidHalfSpace PressureRelease ReflectionTable Rigid SeaBed SeaSurface Sediment",
    "world.environment": (
        "Absorption Cast Catenary Environment FlatNoise Isovelocity Linear Munk Tabulated "
        "TemperatureSalinity Thermocline WenzNoise"
    ),
    "world.motion": "Circle Course Line Still Waypoint Waypoints",
    "world.shapes": "Box Cylinder LShape MeshFile Myring Remus100 Sphere",
    "world.snaps": "Gabor KellerMiksis RecordedSnap Ricker SnapVariation",
    "world.sources": "LogarithmicBubble SnappingShrimp",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sonarsynth' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"sonarsynth.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
