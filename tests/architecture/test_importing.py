"""`import sonarsynth` is light, and what it offers is what is pinned here."""

from __future__ import annotations

import subprocess
import sys

import sonarsynth

HEAVY = (
    "numba",
    "trimesh",
    "matplotlib",
    "plotly",
    "open3d",
    "xarray",
    "dask",
    "distributed",
    "zarr",
    "scipy",
    "embreex",
    "torch",
)

SURFACE = [
    "Absorption",
    "Accuracy",
    "Annulus",
    "AnyOrientation",
    "AtRest",
    "AutoPlacing",
    "AutoSynthesis",
    "AutoTracing",
    "Axis",
    "Band",
    "BandPass",
    "BeamAxis",
    "BeamGrid",
    "BodyModel",
    "BottomDirections",
    "Box",
    "BoxRegion",
    "BuildReport",
    "Cast",
    "Catenary",
    "CellAveraging",
    "Choice",
    "Circle",
    "Condition",
    "ConstantVelocity",
    "Converter",
    "Cylinder",
    "DenseDelayAndSum",
    "Detections",
    "DetectorReport",
    "DirectSum",
    "EchoWindow",
    "EigenrayRequest",
    "Electronics",
    "Environment",
    "FieldError",
    "FieldOfView",
    "FirstEcho",
    "FlatNoise",
    "FluidHalfSpace",
    "FocusedDelayAndSum",
    "Gabor",
    "GriddedSynthesis",
    "Hover",
    "Hovering",
    "ImagePeaks",
    "Integers",
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
    "LogUniform",
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
    "PolygonRegion",
    "Population",
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
    "StraightAhead",
    "SurfaceDirections",
    "Tabulated",
    "TabulatedNoise",
    "Target",
    "TemperatureSalinity",
    "ThermalNoise",
    "Thermocline",
    "Trajectory",
    "Uniform",
    "Upright",
    "Wandering",
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
    "detect",
    "dump",
    "eigenrays",
    "eigenrays_between",
    "evaluate",
    "load",
    "loads",
    "open",
    "plan",
    "points",
    "preview",
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


def loaded_by(code: str) -> set[str]:
    """Top-level modules that are loaded after running code in a fresh interpreter."""
    report = "; import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert loaded_by("import sonarsynth") & set(HEAVY) == set()


def test_a_loaded_library_would_be_seen() -> None:
    assert "scipy" in loaded_by("import scipy")


def test_the_surface_is_pinned() -> None:
    assert sorted(sonarsynth.__all__) == SURFACE


def test_everything_on_the_surface_is_there_and_explains_itself() -> None:
    for name in sonarsynth.__all__:
        offered = getattr(sonarsynth, name)
        if callable(offered):
            assert offered.__doc__, f"{name} has no docstring"
