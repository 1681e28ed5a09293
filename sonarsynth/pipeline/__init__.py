"""render(plan, i): one frame from recipe to labelled data, pure. Labels enter here and nowhere below.

    trace_frame       Plan -> TracedFrame: Frame, Arrivals, Truth, LinkBudget
    beamform_frame    TracedFrame -> BeamformedFrame: Signals, SourceEstimates, EnergyImage
    range_frame       TracedFrame, BeamformedFrame -> Values: everything that is stored, the PointCloud with it

These three are the tasks that the scheduler runs. Only what the products need is computed: where they need no sound,
`silent_frame` takes the place of all three.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sonarsynth.description.method import returned
from sonarsynth.labels import echo_levels, label, link_budget, path_powers
from sonarsynth.labels.estimate_labels import Direct
from sonarsynth.pipeline.echo_image import cloud_of, image_of, image_without_clock, range_image_of
from sonarsynth.pipeline.frame_chorus import clear_values, frame_chorus, soundscape_values, with_chorus
from sonarsynth.pipeline.frame_reverberation import frame_reverberation, scattered_paths, with_reverberation
from sonarsynth.pipeline.handed_on import BeamformedFrame, Sound, TracedFrame
from sonarsynth.pipeline.labelled_estimates import emission_values, estimate_truth, heard_directly
from sonarsynth.pipeline.labelling import band_of, expansion_error, frame_values, isolated_levels, point_labels
from sonarsynth.pipeline.requested_rays import follow_rays
from sonarsynth.pipeline.signal_to_noise import SoundParts, snr_values
from sonarsynth.pipeline.stage_times import STAGES, mark_stage, stage_timer
from sonarsynth.pipeline.stored_values import (
    Values,
    beam_values,
    cloud_values,
    echo_values,
    image_values,
    in_slots,
    link_budget_values,
    path_values,
    range_image_values,
    signal_values,
    source_estimate_values,
    truth_values,
)
from sonarsynth.pipeline.synthesis import NO_RECORDER, Recorder, digitise, frame_signals, known_elements, known_signals
from sonarsynth.pipeline.variables import VARIABLES, Variable, attributes, coordinates, frame_tree, variables
from sonarsynth.planning import OF_BEAMS, Plan, check_unsampled_frame, context_of, plan, receiver_of, survey_of
from sonarsynth.planning.notes.source_notes import locator
from sonarsynth.products import Arrivals, PointCloud, Signals
from sonarsynth.ranging.location.association import in_record, light_first
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.filtered_pulse import snap_levels
from sonarsynth.threads import in_one_thread
from sonarsynth.tracing.arrivals import trace

if TYPE_CHECKING:
    import xarray as xr

    from sonarsynth.recipe import Recipe

__all__ = [
    "STAGES",
    "VARIABLES",
    "BeamformedFrame",
    "TracedFrame",
    "Values",
    "Variable",
    "attributes",
    "beamform_frame",
    "cloud_of",
    "coordinates",
    "digitise",
    "follow_rays",
    "frame_tree",
    "locate_and_image",
    "measured",
    "range_frame",
    "range_image_of",
    "render",
    "silent_frame",
    "stage_timer",
    "trace_at",
    "trace_frame",
    "trace_paths",
    "values_at",
    "variables",
]


def silent_frame(plan: Plan, index: int) -> Values:
    """Every stored value of a frame whose products need no sound: truth, and paths if asked for."""
    return silent_at(*_checked(plan, index))


def silent_at(plan: Plan, frame: Frame, arrivals: Arrivals | None = None) -> Values:
    """As `silent_frame`, of a frame that is made already; `plan` is that of its sequence, arrivals as of `trace_at`."""
    if plan.products:
        traced = trace_at(plan, frame, arrivals)
        return in_slots(plan, _traced_values(plan, traced, heard_directly(plan, traced.arrivals, frame.moment.snaps)))
    truth = label(context_of(plan, frame), plan.propagation, snap_levels(frame.moment.snaps))
    mark_stage("label")
    sound = soundscape_values(plan, frame, frame_chorus(plan, frame))
    return in_slots(plan, frame_values(plan, frame) | truth_values(truth) | sound)


def trace_frame(plan: Plan, index: int) -> TracedFrame:
    """Every path of a frame, and its truth."""
    return trace_at(*_checked(plan, index))


def trace_paths(plan: Plan, index: int) -> tuple[Frame, Arrivals]:
    """A frame and every path of it, for `trace_at`."""
    plan, frame = _checked(plan, index)
    arrivals = trace(context_of(plan, frame), plan.propagation)
    mark_stage("trace")
    return frame, arrivals


def _checked(plan: Plan, index: int) -> tuple[Plan, Frame]:
    """The plan of a frame's sequence, and the frame, checked as the plan's sampled frames were."""
    plan = plan.at(index)
    frame = plan.frame(index)
    check_unsampled_frame(plan, frame)
    return plan, frame


def trace_at(plan: Plan, frame: Frame, arrivals: Arrivals | None = None) -> TracedFrame:
    """Every path of a frame, and its truth; `plan` is that of its sequence; arrivals: its paths, where these are traced
    already."""
    context = context_of(plan, frame)
    arrivals = trace(context, plan.propagation) if arrivals is None else arrivals
    mark_stage("trace")
    from_centre, levels = arrivals.seen_from_centre.without_reverberation, snap_levels(context.snaps)
    truth = label(context, plan.propagation, levels)
    band, targets = band_of(plan, context.snaps), len(context.bodies)
    powers = path_powers(from_centre, band)
    budget = link_budget(from_centre, powers, band, targets, levels, expansion_error(plan, from_centre))
    levels_of_echoes = echo_levels(from_centre, powers, targets, levels)
    mark_stage("label")
    others = frame_chorus(plan, frame), frame_reverberation(plan, frame)
    mark_stage("trace")
    return TracedFrame(frame, arrivals, truth, budget, levels_of_echoes, *others)


def measured(plan: Plan, index: int, traced: TracedFrame) -> TracedFrame:
    """What was traced, with the levels of its isolated paths in signals of each alone, where signals are stored."""
    if "signals" not in plan.products or traced.isolated is not None:
        return traced
    isolated = isolated_levels(plan.at(index), traced.frame, traced.budget, traced.truth.snap_level)
    mark_stage("measure")
    return replace(traced, isolated=isolated)


def beamform_frame(plan: Plan, index: int, traced: TracedFrame, sound: Sound | None = None) -> BeamformedFrame:
    """Signals, source estimates, and the energy image of the echo window, as far as the products need them.
    sound: as `prepared_sound` has it, if at hand."""
    plan = plan.at(index)
    parts = SoundParts(plan)
    recorded = synthesise(plan, traced, parts, sound)
    mark_stage("synthesise")
    values = signal_values(plan, recorded) if "signals" in plan.products else {}  # while they are in the caches
    mark_stage("collect")
    beamformed = BeamformedFrame(recorded, None, None)
    if plan.products & OF_BEAMS:
        beamformed = locate_and_image(plan, traced.frame, known_signals(plan, traced.frame, recorded))
    values |= snr_values(plan, traced.frame, traced.arrivals, traced.truth, parts, beamformed.image)
    return replace(beamformed, values=values)


def locate_and_image(plan: Plan, frame: Frame, signals: Signals) -> BeamformedFrame:
    """Source estimates, and the energy image of the echo window; `plan` is that of the frame's sequence.

    Where no located snap has its echo window in the record there is no clock: the image is of the end of the record,
    as long as the echo window, and no echo has a place.
    """
    processing, windows, elements = plan.scene.processing, plan.windows, known_elements(plan, frame)
    receiver = replace(receiver_of(plan, frame), elements=elements)
    survey = survey_of(plan, frame)
    estimates = locator(plan.scene).checked_estimates(signals, receiver, survey, plan.sizes["estimate"])
    estimates = light_first(estimates, signals, elements, plan.scene.sonar, *windows.echo)
    mark_stage("locate")
    imaged, beams = signals, None
    if in_record(estimates, signals, *windows.echo)[:1].any():
        start, stop = (float(estimates.time[0]) + late for late in windows.echo)
        if processing.cancelling is not None:
            rest = processing.cancelling.cancel(signals, estimates, receiver, survey, (start, stop))
            imaged = returned(processing.cancelling, "cancel", rest, signals.pressure.shape, "pressure")
        imaged, beams, image = image_of(plan, elements, imaged, estimates, (start, stop))
    else:  # no direct pulse was found, or an echo was taken for it
        image = image_without_clock(plan, elements, signals)
    mark_stage("beamform")
    return BeamformedFrame(signals, estimates, image, imaged, beams)


def synthesise(
    plan: Plan, traced: TracedFrame, recorder: Recorder = NO_RECORDER, sound: Sound | None = None
) -> Signals:
    """Pressure at each hydrophone: echoes and direct snap, reverberation, chorus, ambient noise, converter."""
    plan = plan.at(traced.frame.index)
    signals = frame_signals(plan, traced.frame, traced.arrivals, recorder, sound)
    recorder("paths", signals)
    signals = with_reverberation(plan, traced.frame, signals, traced.reverberation)
    recorder("reverberation", signals)
    signals = with_chorus(plan, traced.frame, signals, traced.chorus)
    recorder("chorus", signals)
    return digitise(plan, traced.frame, signals, recorder)


def range_frame(
    plan: Plan, index: int, traced: TracedFrame, beamformed: BeamformedFrame, cloud: PointCloud | None = None
) -> Values:
    """The point cloud, and every stored value of the frame; cloud: its points, where these are made already."""
    plan, traced = plan.at(index), measured(plan, index, traced)
    values = in_slots(plan, _beamformed_values(plan, traced, beamformed, cloud))
    mark_stage("label")
    return values


def _traced_values(plan: Plan, traced: TracedFrame, direct: Direct) -> Values:
    """Stored values of paths and truth."""
    frame = traced.frame
    values = frame_values(plan, frame) | truth_values(traced.truth) | echo_values(traced.echoes, traced.arrivals)
    values |= link_budget_values(traced.budget, traced.isolated) | soundscape_values(plan, frame, traced.chorus)
    values |= clear_values(plan, traced.chorus, traced.echoes, direct, frame.moment.snaps)
    if "paths" in plan.products:
        values |= path_values(traced.arrivals, plan.sizes["path"], plan.sizes["sensor"])
    return values | estimate_truth(plan, frame, direct)


def _beamformed_values(
    plan: Plan, traced: TracedFrame, beamformed: BeamformedFrame, cloud: PointCloud | None
) -> Values:
    """All stored values, before targets get their slots; `plan` is that of the frame's sequence."""
    frame = traced.frame
    direct = heard_directly(plan, traced.arrivals, frame.moment.snaps)
    values = _traced_values(plan, traced, direct) | beamformed.values
    if beamformed.image is None or beamformed.estimates is None:
        mark_stage("collect")
        return values
    values |= source_estimate_values(beamformed.estimates)
    values |= emission_values(plan, direct, beamformed.estimates, beamformed.signals, frame.moment.snaps)
    if "image" in plan.products:
        values |= image_values(beamformed.image, plan.windows.direct_removed)
    mark_stage("collect")
    if "beams" in plan.products:
        values |= beam_values(plan, beamformed.beams, beamformed.image)
        mark_stage("resolve")
    if "range_image" in plan.products:
        values |= range_image_values(plan, range_image_of(plan, frame, beamformed), traced.truth)
        mark_stage("range image")
    if "cloud" in plan.products:
        cloud = (cloud_of(plan, frame, beamformed) if cloud is None else cloud).loudest(plan.sizes["point"])
        scattered = scattered_paths(plan, traced.arrivals, traced.reverberation)
        labels = point_labels(plan, frame, traced.arrivals, beamformed.estimates, cloud, scattered)
        values |= cloud_values(cloud, labels, len(frame.moment.bodies))
    return values


def values_at(plan: Plan, frame: Frame, arrivals: Arrivals | None = None) -> Values:
    """Every stored value of a frame that is at hand; `plan` is that of its sequence, arrivals as of `trace_at`."""
    if not plan.makes_sound:
        return silent_at(plan, frame, arrivals)
    traced = trace_at(plan, frame, arrivals)
    return range_frame(plan, frame.index, traced, beamform_frame(plan, frame.index, traced))


@in_one_thread
def render(recipe: Recipe | Plan, index: int) -> xr.DataTree:
    """Compute a frame of a recipe. Pure: the same frame is the same, bit for bit.

    Parameters
    ----------
    recipe: a recipe, or the plan of one, which saves planning it again.
    index: number of the frame, from 0.

    Returns
    -------
    A labelled DataTree: groups, names and units (attributes) as in a store, without the frame axis.

    Raises
    ------
    FieldError as `plan` does, IndexError for a frame that is not there.
    """
    resolved = recipe if isinstance(recipe, Plan) else plan(recipe)
    return frame_tree(resolved, index, values_at(*_checked(resolved, index)))
