"""render(plan, i): one frame from recipe to labelled data, pure. Labels enter here and nowhere below.

    trace_frame       Plan -> Traced: Frame, Arrivals, Truth, Ledger
    beamform_frame    Traced -> Heard: Signals, Bearings, EnergyImage
    range_frame       Traced, Heard -> Values: everything that is stored, the PointCloud with it

The three are the tasks that the scheduler runs; what nobody asked for is not computed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import FieldError
from sonarsynth.labelling import SLICES, Band, echoes, label, ledger, path_powers
from sonarsynth.planning import Plan, arrivals_of, check_unseen, plan
from sonarsynth.products import Arrivals, Bearings, Echoes, EnergyImage, Ledger, Signals, Truth
from sonarsynth.randomness import stream
from sonarsynth.recipe import Recipe
from sonarsynth.render.hearing import hear
from sonarsynth.render.laps import LAPS, counted, lap
from sonarsynth.render.stored import (
    Values,
    bearing_values,
    cloud_values,
    ledger_values,
    of_isolated,
    signal_values,
    table,
    truth_values,
)
from sonarsynth.scene import Frame
from sonarsynth.synthesis.pulse import snap_levels
from sonarsynth.tracing import Straight
from sonarsynth.variables import VARIABLES, Variable, attributes, coordinates, variables
from sonarsynth.world.moment import Snap

if TYPE_CHECKING:
    import xarray as xr

    from sonarsynth.tracing.fan import RayFan

__all__ = [
    "LAPS",
    "VARIABLES",
    "Heard",
    "Traced",
    "Values",
    "Variable",
    "attributes",
    "beamform_frame",
    "coordinates",
    "counted",
    "follow_rays",
    "process",
    "range_frame",
    "record",
    "render",
    "trace_at",
    "trace_frame",
    "variables",
]


@dataclass(frozen=True, eq=False)
class Traced:
    """What the trace task gives."""

    frame: Frame
    arrivals: Arrivals
    truth: Truth
    ledger: Ledger
    echoes: Echoes


@dataclass(frozen=True, eq=False)
class Heard:
    """What the beamform task gives; None where no product needs it."""

    signals: Signals | None
    bearings: Bearings | None
    image: EnergyImage | None
    imaged: Signals | None = None  # what the image was made of: without the snap's own reflections, where these go
    isolated: Floats | None = None  # (snap, target + 1, family) dB: isolated paths of the ledger as signals have them


def trace_frame(plan: Plan, index: int) -> Traced:
    """Every path of a frame, and its truth."""
    plan = plan.at(index)
    frame = plan.recipe.frame(index)[1]
    check_unseen(plan, frame)
    return trace_at(plan, frame)


def trace_at(plan: Plan, frame: Frame) -> Traced:
    """Every path of a frame that is at hand, and its truth; `plan` is that of its sequence."""
    sonar, arrivals = plan.scene.sonar, arrivals_of(plan, frame)
    lap("trace")
    seen = arrivals.at_centre
    levels = snap_levels(frame.moment.snaps)
    straight = isinstance(plan.propagation, Straight)
    doppler = plan.scene.physics.doppler
    truth = label(frame.moment, frame.sonar_pose, sonar.beams, plan.connect, levels, straight, doppler)
    band, targets = _band(plan, frame.moment.snaps), len(frame.moment.bodies)
    powers = path_powers(seen, band)
    book = ledger(seen, powers, band, targets, levels, _expansion_error(plan, seen))
    heard = echoes(seen, powers, targets, levels)
    lap("label")
    return Traced(frame, arrivals, truth, book, heard)


def _band(plan: Plan, snaps: tuple[Snap, ...]) -> Band:
    """The band that levels are taken in."""
    from sonarsynth.synthesis.direct_sum import relative_absorption
    from sonarsynth.synthesis.isolated import energy_in_slices

    sonar = plan.scene.sonar
    energy = np.array([energy_in_slices(snap.waveform, sonar, SLICES) for snap in snaps]).reshape(-1, SLICES)
    band = Band(sonar.band.low, sonar.band.high, energy, np.zeros(SLICES))
    return replace(band, relative=relative_absorption(plan.absorption, band.frequency, sonar.band.centre))


def _expansion_error(plan: Plan, arrivals: Arrivals) -> float:
    """Error (dB) of a level from expanding wavefronts and amplitudes over the aperture, as measured at its probes.

    A beam of sensors that are up to phi out of phase loses at most 20 log10 cos phi. NaN where a sensor has no ray.
    """
    if not np.isfinite([arrivals.wavefront_error, arrivals.amplitude_error]).all():
        return float("nan")
    phase = min(2 * np.pi * plan.scene.sonar.band.high * arrivals.wavefront_error, 1.5)
    return float(20 * np.log10((1.0 + arrivals.amplitude_error) / np.cos(phase)))


def follow_rays(plan: Plan, index: int) -> RayFan:
    """The rays that the recipe asks for, followed through a frame. Raises FieldError where it asks for none."""
    from sonarsynth.tracing.fan import fan

    request = plan.recipe.rays
    if request is None:
        raise FieldError((), "the recipe asks for no rays: add 'rays:', with directions or a grid")
    plan = plan.at(index)
    scene, frame = plan.recipe.frame(index)
    if request.towards_shrimp and not frame.moment.snaps:
        raise FieldError(("rays", "towards_shrimp"), "the scene has no shrimp")
    return fan(
        scene.world.environment,
        plan.profile,
        frame.moment.bodies,
        frame.sonar_pose.position,
        frame.sonar_pose.turn_to_world(request.rays()),
        request.duration,
        request.bounces,
        towards=frame.moment.snaps[0].position if request.towards_shrimp else None,
        laws=scene.laws,
        centre=scene.sonar.band.centre,
        propagation=plan.propagation,
    )


def beamform_frame(plan: Plan, index: int, traced: Traced) -> Heard:
    """What the array hears: signals, where the snap is, and the energy image of the echo window."""
    if not plan.products:
        return Heard(None, None, None)
    signals, isolated = synthesise(plan, traced), measure_isolated(plan, traced)
    lap("synthesise")
    if not plan.products & {"image", "cloud"}:
        return Heard(signals, None, None, isolated=isolated)
    return replace(process(plan, traced.frame, signals), isolated=isolated)


def process(plan: Plan, frame: Frame, signals: Signals) -> Heard:
    """What the sonar makes of signals: where the snap is, and the energy image of the echo window."""
    processing, sonar, environment = plan.scene.processing, plan.scene.sonar, plan.scene.world.environment
    snaps = plan.sizes["snap"]
    bearings = processing.locating.locate(
        signals, plan.elements, sonar, frame.sonar_pose, environment.depth, snaps, plan.profile
    )
    lap("locate")
    heard = float(bearings.time[0]) if snaps else np.nan
    start, stop = heard + plan.windows.echo_start, heard + plan.windows.echo_stop
    end = signals.start + plan.windows.samples / signals.sampling_frequency
    imaged = signals
    if signals.start <= start and stop <= end:
        if processing.cancelling is not None:
            bed, pose = environment.depth, frame.sonar_pose
            imaged = processing.cancelling.cancel(signals, bearings, plan.elements, sonar, pose, bed, (start, stop))
        image = plan.choices.beamforming.image(imaged, plan.elements, sonar, start, stop)
    else:  # no direct pulse was found, or an echo was taken for it: no clock, so no image, rather than an arbitrary one
        silent = np.full((sonar.beams.elevations, sonar.beams.azimuths), np.nan, np.float32)
        image = EnergyImage(silent, sonar.beams.azimuth, sonar.beams.elevation, np.nan, np.nan)
    lap("beamform")
    return Heard(signals, bearings, image, imaged)


def synthesise(plan: Plan, traced: Traced) -> Signals:
    """Pressure at each hydrophone: echoes and direct snap, ambient noise, converter."""
    plan = plan.at(traced.frame.index)
    return record(plan, traced.frame, hear(plan, traced.frame, traced.arrivals))


def record(plan: Plan, frame: Frame, signals: Signals) -> Signals:
    """Signals as the sonar has them: with ambient noise, through the converter; `plan` is that of the sequence."""
    from sonarsynth.synthesis import add_noise, convert

    sonar, noise = plan.scene.sonar, plan.scene.world.environment.noise
    if noise is not None:
        random = stream(frame.seed, "noise", frame.key, frame.step)
        signals = add_noise(signals, noise, sonar, plan.elements, random)
    return signals if sonar.converter is None else convert(signals, sonar.converter)


def measure_isolated(plan: Plan, traced: Traced) -> Floats:
    """Levels (snap, target + 1, family) in dB of the isolated paths of the ledger, measured in signals of each."""
    from sonarsynth.synthesis.isolated import measured_levels

    plan = plan.at(traced.frame.index)
    scene, book = plan.scene, traced.ledger
    method, snaps = plan.choices.synthesis, traced.frame.moment.snaps
    measured = measured_levels(method, book.isolated, snaps, scene.sonar, plan.absorption)
    return of_isolated(book, traced.truth.snap_level[book.isolated.snap] + measured)


def range_frame(plan: Plan, index: int, traced: Traced, heard: Heard) -> Values:
    """The point cloud, and every stored value of the frame."""
    plan = plan.at(index)
    frame = traced.frame
    values = table("/", trajectory=frame.trajectory, step=frame.step, time=frame.time, split=plan.recipe.split(index))
    values |= truth_values(traced.truth, traced.echoes, traced.arrivals) | ledger_values(traced.ledger, heard.isolated)
    if heard.signals is not None and "signals" in plan.products:
        counts = any(v.name == "pressure" and v.dtype == "int16" for v in variables(plan))
        values |= signal_values(heard.signals, counts)
    if heard.image is None or heard.bearings is None or heard.imaged is None:
        lap("collect")
        return values
    values |= bearing_values(heard.bearings)
    if "image" in plan.products:
        values |= table("/image", energy=heard.image.energy, start=heard.image.start, stop=heard.image.stop)
    lap("collect")
    if "cloud" in plan.products:
        scene = plan.scene
        cloud = plan.choices.ranging.cloud(
            heard.imaged,
            heard.image,
            heard.bearings,
            plan.elements,
            scene.sonar,
            frame.sonar_pose,
            plan.profile,
        )
        values |= cloud_values(cloud)
        lap("range")
    return values


def render(recipe: Recipe | Plan, index: int) -> xr.DataTree:
    """One frame of a recipe as a labelled DataTree: groups and names as in a store, without the frame axis. Pure."""
    import xarray as xr

    made = plan(recipe) if isinstance(recipe, Recipe) else recipe
    traced = trace_frame(made, index)
    values = range_frame(made, index, traced, beamform_frame(made, index, traced))
    groups: dict[str, xr.Dataset] = {"/": xr.Dataset(attrs=attributes(made))}
    for (group, name), (dims, array, attrs) in coordinates(made).items():
        one = (dims[1:], array[index], attrs) if "frame" in dims else (dims, array, attrs)
        groups.setdefault(group, xr.Dataset()).coords[name] = one
    for v in variables(made):
        attrs = {"units": v.units, "long_name": v.long_name, **dict(v.attributes)}
        data = values[v.group, v.name]
        if "scale_factor" in attrs:
            data = (data * attrs.pop("scale_factor")).astype(np.float32)
        groups.setdefault(v.group, xr.Dataset())[v.name] = (v.dims[1:], data, attrs)
    return xr.DataTree.from_dict(groups)
