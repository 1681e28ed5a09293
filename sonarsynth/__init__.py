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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sonarsynth.description import FieldError
    from sonarsynth.environment.boundaries import (
        FluidHalfSpace,
        PressureRelease,
        ReflectionTable,
        Rigid,
        SeaBottom,
        SeaSurface,
        Sediment,
    )
    from sonarsynth.environment.noise import (
        FlatNoise,
        KnudsenNoise,
        RainNoise,
        RecordedNoise,
        TabulatedNoise,
        ThermalNoise,
        WenzNoise,
        WindNoise,
    )
    from sonarsynth.environment.noise.directions import (
        BottomDirections,
        IsotropicDirections,
        OneDirection,
        RingDirections,
        SurfaceDirections,
    )
    from sonarsynth.environment.sea import (
        Absorption,
        Cast,
        Catenary,
        Environment,
        Isovelocity,
        Linear,
        Munk,
        Tabulated,
        TemperatureSalinity,
        Thermocline,
    )
    from sonarsynth.export import points
    from sonarsynth.frontiers import measure as accuracy
    from sonarsynth.geometry.motion import Circle, ConstantVelocity, Line, Still, Waypoint, Waypoints
    from sonarsynth.geometry.recorded_track import RecordedTrack
    from sonarsynth.imaging import DenseDelayAndSum, FocusedDelayAndSum
    from sonarsynth.pictures import show
    from sonarsynth.pictures.ray_pictures import rays
    from sonarsynth.pictures.snap_pictures import snap
    from sonarsynth.pictures.soundscape_figures.soundscape_pictures import soundscape
    from sonarsynth.pipeline import render
    from sonarsynth.planning import Plan, plan
    from sonarsynth.propagation import AutoTracing, Refracted, Straight
    from sonarsynth.propagation.eigenrays import RayArrivals, eigenrays, eigenrays_between
    from sonarsynth.propagation.ray_request import EigenrayRequest, RayRequest
    from sonarsynth.ranging import (
        AutoPlacing,
        BeamAxis,
        FirstEcho,
        IsovelocityPlacing,
        Peaks,
        RefractedPlacing,
        SensorDelays,
        WavefrontCancelling,
    )
    from sonarsynth.receiver import (
        Band,
        BandPass,
        BeamGrid,
        Converter,
        Electronics,
        LowPass,
        Overload,
        PlanarLattice,
        PositionTable,
        Romanis,
        SensorErrors,
        Sonar,
    )
    from sonarsynth.recipe import Accuracy, Axis, Choice, Normal, Recipe, Sobol, Splits, Uniform, Zip
    from sonarsynth.recipe.reading import RecipeError, dump, load, loads, schema
    from sonarsynth.recipe.scene import EchoWindow, Physics, Processing, Scene, Trajectory, World
    from sonarsynth.scattering import Isotropic, Kirchhoff, MirrorLobe, PartlyReflecting
    from sonarsynth.schedule import BuildReport, build
    from sonarsynth.schedule.repairing import RepairReport, repair
    from sonarsynth.signals import AutoSynthesis, DirectSum, GriddedSynthesis
    from sonarsynth.sources.noise_source import NoiseRecording, NoiseSource
    from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
    from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation
    from sonarsynth.store import open_store as open
    from sonarsynth.store import verify
    from sonarsynth.store.cards import write as card
    from sonarsynth.targets.shapes import Box, Cylinder, LShape, MeshFile, Myring, Remus100, Sphere
    from sonarsynth.targets.target import Target
    from sonarsynth.targets.target_strength import target_strength

__all__ = [
    "Absorption",
    "Accuracy",
    "AutoPlacing",
    "AutoSynthesis",
    "AutoTracing",
    "Axis",
    "Band",
    "BandPass",
    "BeamAxis",
    "BeamGrid",
    "BottomDirections",
    "Box",
    "BuildReport",
    "Cast",
    "Catenary",
    "Choice",
    "Circle",
    "ConstantVelocity",
    "Converter",
    "Cylinder",
    "DenseDelayAndSum",
    "DirectSum",
    "EchoWindow",
    "EigenrayRequest",
    "Electronics",
    "Environment",
    "FieldError",
    "FirstEcho",
    "FlatNoise",
    "FluidHalfSpace",
    "FocusedDelayAndSum",
    "Gabor",
    "GriddedSynthesis",
    "Isotropic",
    "IsotropicDirections",
    "Isovelocity",
    "IsovelocityPlacing",
    "KellerMiksis",
    "Kirchhoff",
    "KnudsenNoise",
    "LShape",
    "Line",
    "Linear",
    "LogarithmicBubble",
    "LowPass",
    "MeshFile",
    "MirrorLobe",
    "Munk",
    "Myring",
    "NoiseRecording",
    "NoiseSource",
    "Normal",
    "OneDirection",
    "Overload",
    "PartlyReflecting",
    "Peaks",
    "Physics",
    "Plan",
    "PlanarLattice",
    "PositionTable",
    "PressureRelease",
    "Processing",
    "RainNoise",
    "RayArrivals",
    "RayRequest",
    "Recipe",
    "RecipeError",
    "RecordedNoise",
    "RecordedSnap",
    "RecordedTrack",
    "ReflectionTable",
    "Refracted",
    "RefractedPlacing",
    "Remus100",
    "RepairReport",
    "Ricker",
    "Rigid",
    "RingDirections",
    "Romanis",
    "Scene",
    "SeaBottom",
    "SeaSurface",
    "Sediment",
    "SensorDelays",
    "SensorErrors",
    "SnapVariation",
    "SnappingShrimp",
    "Sobol",
    "Sonar",
    "Sphere",
    "Splits",
    "Still",
    "Straight",
    "SurfaceDirections",
    "Tabulated",
    "TabulatedNoise",
    "Target",
    "TemperatureSalinity",
    "ThermalNoise",
    "Thermocline",
    "Trajectory",
    "Uniform",
    "WavefrontCancelling",
    "Waypoint",
    "Waypoints",
    "WenzNoise",
    "WindNoise",
    "World",
    "Zip",
    "accuracy",
    "build",
    "card",
    "dump",
    "eigenrays",
    "eigenrays_between",
    "load",
    "loads",
    "open",
    "plan",
    "points",
    "rays",
    "render",
    "repair",
    "schema",
    "show",
    "snap",
    "soundscape",
    "target_strength",
    "verify",
]

_HOMES = {
    "export": "points",
    "description": "FieldError",
    "environment.boundaries": "FluidHalfSpace PressureRelease ReflectionTable Rigid SeaBottom SeaSurface Sediment",
    "environment.noise": "FlatNoise KnudsenNoise RainNoise TabulatedNoise ThermalNoise WenzNoise WindNoise",
    "environment.noise.recorded_noise": "RecordedNoise",
    "environment.noise.directions": (
        "BottomDirections IsotropicDirections OneDirection RingDirections SurfaceDirections"
    ),
    "environment.sea": (
        "Absorption Cast Catenary Environment Isovelocity Linear Munk Tabulated TemperatureSalinity Thermocline"
    ),
    "geometry.motion": "Circle ConstantVelocity Line RecordedTrack Still Waypoint Waypoints",
    "imaging": "DenseDelayAndSum FocusedDelayAndSum",
    "pictures": "show",
    "pictures.ray_pictures": "rays",
    "pictures.snap_pictures": "snap",
    "pictures.soundscape_figures.soundscape_pictures": "soundscape",
    "pipeline": "render",
    "planning": "Plan plan",
    "propagation": "AutoTracing Refracted Straight",
    "propagation.eigenrays": "RayArrivals eigenrays eigenrays_between",
    "propagation.ray_request": "EigenrayRequest RayRequest",
    "ranging": (
        "AutoPlacing BeamAxis FirstEcho IsovelocityPlacing Peaks RefractedPlacing SensorDelays WavefrontCancelling"
    ),
    "receiver": (
        "Band BandPass BeamGrid Converter Electronics LowPass Overload PlanarLattice PositionTable Romanis "
        "SensorErrors Sonar"
    ),
    "recipe": "Accuracy Axis Choice Normal Recipe Sobol Splits Zip Uniform",
    "recipe.reading": "RecipeError dump load loads schema",
    "recipe.scene": "EchoWindow Physics Processing Scene Trajectory World",
    "scattering": "Isotropic Kirchhoff MirrorLobe PartlyReflecting",
    "schedule": "BuildReport build",
    "schedule.repairing": "RepairReport repair",
    "signals": "AutoSynthesis DirectSum GriddedSynthesis",
    "sources.noise_source": "NoiseRecording NoiseSource",
    "sources.shrimp": "LogarithmicBubble SnappingShrimp",
    "sources.snap_models": "Gabor KellerMiksis RecordedSnap Ricker SnapVariation",
    "store": "verify",
    "targets.shapes": "Box Cylinder LShape MeshFile Myring Remus100 Sphere",
    "targets.target": "Target",
    "targets.target_strength": "target_strength",
}
_HOME = {name: (home, name) for home, names in _HOMES.items() for name in names.split()}
_HOME |= {"accuracy": ("frontiers", "measure"), "card": ("store.cards", "write"), "open": ("store", "open_store")}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sonarsynth' has no attribute '{name}'")
    home, attribute = _HOME[name]
    return globals().setdefault(name, getattr(importlib.import_module(f"sonarsynth.{home}"), attribute))


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
