"""What `sonarsynth` exports, for type checkers: at run time each name is looked up when it is first used."""

from sonarsynth.description import FieldError as FieldError
from sonarsynth.detection import (
    CellAveraging as CellAveraging,
    Detections as Detections,
    ImagePeaks as ImagePeaks,
    detect as detect,
)
from sonarsynth.environment.boundaries import (
    FluidHalfSpace as FluidHalfSpace,
    PressureRelease as PressureRelease,
    ReflectionTable as ReflectionTable,
    Rigid as Rigid,
    SeaBottom as SeaBottom,
    SeaSurface as SeaSurface,
    Sediment as Sediment,
)
from sonarsynth.environment.noise import (
    FlatNoise as FlatNoise,
    KnudsenNoise as KnudsenNoise,
    RainNoise as RainNoise,
    RecordedNoise as RecordedNoise,
    TabulatedNoise as TabulatedNoise,
    ThermalNoise as ThermalNoise,
    WenzNoise as WenzNoise,
    WindNoise as WindNoise,
)
from sonarsynth.environment.noise.directions import (
    BottomDirections as BottomDirections,
    IsotropicDirections as IsotropicDirections,
    OneDirection as OneDirection,
    RingDirections as RingDirections,
    SurfaceDirections as SurfaceDirections,
)
from sonarsynth.environment.sea import (
    Absorption as Absorption,
    Cast as Cast,
    Catenary as Catenary,
    Environment as Environment,
    Isovelocity as Isovelocity,
    Linear as Linear,
    Munk as Munk,
    Tabulated as Tabulated,
    TemperatureSalinity as TemperatureSalinity,
    Thermocline as Thermocline,
)
from sonarsynth.export import points as points
from sonarsynth.frontiers import measure as accuracy
from sonarsynth.evaluation import DetectorReport as DetectorReport, evaluate as evaluate
from sonarsynth.geometry.hovering import Hover as Hover
from sonarsynth.geometry.motion import (
    Circle as Circle,
    ConstantVelocity as ConstantVelocity,
    Line as Line,
    Still as Still,
    Waypoint as Waypoint,
    Waypoints as Waypoints,
)
from sonarsynth.geometry.recorded_track import RecordedTrack as RecordedTrack
from sonarsynth.imaging import DenseDelayAndSum as DenseDelayAndSum, FocusedDelayAndSum as FocusedDelayAndSum
from sonarsynth.loading import open as open
from sonarsynth.loading.moved_sources import with_sources as with_sources
from sonarsynth.pictures import show as show
from sonarsynth.pictures.preview_figures.preview_pictures import preview as preview
from sonarsynth.pictures.ray_pictures import rays as rays
from sonarsynth.pictures.snap_pictures import snap as snap
from sonarsynth.pictures.soundscape_figures.soundscape_pictures import soundscape as soundscape
from sonarsynth.pipeline import render as render
from sonarsynth.planning import Plan as Plan, plan as plan
from sonarsynth.propagation import AutoTracing as AutoTracing, Refracted as Refracted, Straight as Straight
from sonarsynth.propagation.eigenrays import (
    RayArrivals as RayArrivals,
    eigenrays as eigenrays,
    eigenrays_between as eigenrays_between,
)
from sonarsynth.propagation.ray_request import EigenrayRequest as EigenrayRequest, RayRequest as RayRequest
from sonarsynth.ranging import (
    AutoPlacing as AutoPlacing,
    BeamAxis as BeamAxis,
    FirstEcho as FirstEcho,
    IsovelocityPlacing as IsovelocityPlacing,
    Peaks as Peaks,
    RefractedPlacing as RefractedPlacing,
    SensorDelays as SensorDelays,
    WavefrontCancelling as WavefrontCancelling,
)
from sonarsynth.receiver import (
    Band as Band,
    BandPass as BandPass,
    BeamGrid as BeamGrid,
    Converter as Converter,
    Electronics as Electronics,
    LowPass as LowPass,
    Overload as Overload,
    PlanarLattice as PlanarLattice,
    PositionTable as PositionTable,
    Romanis as Romanis,
    SensorErrors as SensorErrors,
    Sonar as Sonar,
)
from sonarsynth.recipe import (
    Accuracy as Accuracy,
    Axis as Axis,
    Choice as Choice,
    Integers as Integers,
    LogUniform as LogUniform,
    Normal as Normal,
    Recipe as Recipe,
    Sobol as Sobol,
    Splits as Splits,
    Uniform as Uniform,
    Zip as Zip,
)
from sonarsynth.recipe.populations.drawn_tracks import (
    AnyOrientation as AnyOrientation,
    AtRest as AtRest,
    Hovering as Hovering,
    StraightAhead as StraightAhead,
    Upright as Upright,
    Wandering as Wandering,
)
from sonarsynth.recipe.populations.population import BodyModel as BodyModel, Population as Population
from sonarsynth.recipe.populations.regions import (
    Annulus as Annulus,
    BoxRegion as BoxRegion,
    FieldOfView as FieldOfView,
    PolygonRegion as PolygonRegion,
)
from sonarsynth.recipe.reading import (
    RecipeError as RecipeError,
    dump as dump,
    load as load,
    loads as loads,
    schema as schema,
)
from sonarsynth.recipe.scene import (
    EchoWindow as EchoWindow,
    Physics as Physics,
    Processing as Processing,
    Scene as Scene,
    Trajectory as Trajectory,
    World as World,
)
from sonarsynth.recipe.variation.random_variations import Condition as Condition
from sonarsynth.scattering import (
    Isotropic as Isotropic,
    Kirchhoff as Kirchhoff,
    MirrorLobe as MirrorLobe,
    PartlyReflecting as PartlyReflecting,
)
from sonarsynth.schedule import BuildReport as BuildReport, build as build
from sonarsynth.schedule.repairing import RepairReport as RepairReport, repair as repair
from sonarsynth.signals import (
    AutoSynthesis as AutoSynthesis,
    DirectSum as DirectSum,
    GriddedSynthesis as GriddedSynthesis,
)
from sonarsynth.sources.noise_source import NoiseRecording as NoiseRecording, NoiseSource as NoiseSource
from sonarsynth.sources.shrimp import LogarithmicBubble as LogarithmicBubble, SnappingShrimp as SnappingShrimp
from sonarsynth.sources.snap_models import (
    Gabor as Gabor,
    KellerMiksis as KellerMiksis,
    RecordedSnap as RecordedSnap,
    Ricker as Ricker,
    SnapVariation as SnapVariation,
)
from sonarsynth.store import verify as verify
from sonarsynth.store.cards import write as card
from sonarsynth.targets.relief import Relief as Relief
from sonarsynth.targets.shapes import (
    Box as Box,
    Cylinder as Cylinder,
    Knots as Knots,
    LShape as LShape,
    MeshFile as MeshFile,
    Myring as Myring,
    Remus100 as Remus100,
    School as School,
    Sphere as Sphere,
)
from sonarsynth.targets.target import Target as Target
from sonarsynth.targets.target_strength import target_strength as target_strength

__all__: list[str]
