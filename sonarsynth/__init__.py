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
from typing import Any

_HOMES = {
    "export": "points",
    "description": "FieldError",
    "detection": "CellAveraging Detections ImagePeaks detect",
    "environment.boundaries": "FluidHalfSpace PressureRelease ReflectionTable Rigid SeaBottom SeaSurface Sediment",
    "environment.noise": "FlatNoise KnudsenNoise RainNoise TabulatedNoise ThermalNoise WenzNoise WindNoise",
    "environment.noise.recorded_noise": "RecordedNoise",
    "environment.noise.directions": (
        "BottomDirections IsotropicDirections OneDirection RingDirections SurfaceDirections"
    ),
    "environment.sea": (
        "Absorption Cast Catenary Environment Isovelocity Linear Munk Tabulated TemperatureSalinity Thermocline"
    ),
    "evaluation": "DetectorReport evaluate",
    "geometry.hovering": "Hover",
    "geometry.motion": "Circle ConstantVelocity Line RecordedTrack Still Waypoint Waypoints",
    "imaging": "DenseDelayAndSum FocusedDelayAndSum",
    "loading.moved_sources": "with_sources",
    "pictures": "show",
    "pictures.preview_figures.preview_pictures": "preview",
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
    "recipe": "Accuracy Axis Choice Integers LogUniform Normal Recipe Sobol Splits Zip Uniform",
    "recipe.populations.drawn_tracks": "AnyOrientation AtRest Hovering StraightAhead Upright Wandering",
    "recipe.populations.population": "BodyModel Population",
    "recipe.populations.regions": "Annulus BoxRegion FieldOfView PolygonRegion",
    "recipe.variation.random_variations": "Condition",
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
    "targets.relief": "Relief",
    "targets.shapes": "Box Cylinder Knots LShape MeshFile Myring Remus100 School Sphere",
    "targets.target": "Target",
    "targets.target_strength": "target_strength",
}
_HOME = {name: (home, name) for home, names in _HOMES.items() for name in names.split()}
_HOME |= {"accuracy": ("frontiers", "measure"), "card": ("store.cards", "write"), "open": ("loading", "open")}

__all__ = sorted(_HOME)  # noqa: PLE0605  the stub beside this file has the names for type checkers


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sonarsynth' has no attribute '{name}'")
    home, attribute = _HOME[name]
    return globals().setdefault(name, getattr(importlib.import_module(f"sonarsynth.{home}"), attribute))


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
