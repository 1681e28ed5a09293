"""`auto` made concrete: the cheapest choices that keep within the accuracy of a recipe.

The error of signals is spent in three parts, whose squares add up: paths that are too faint, the synthesis, and paths
that are expanded over the array (or parts of it) from its middle. The first two have bounds; the third is measured, in
a few frames at a few hydrophones that are traced by themselves.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.conventions import Floats, Ints, evenly, scattered
from sonarsynth.description.method import Demand
from sonarsynth.planning.choices import OF_BEAMS, OWN_VIEW, Choices
from sonarsynth.planning.measured.image_errors import SAFETY, beamformer
from sonarsynth.planning.measured.ray_bending import ranging_error
from sonarsynth.planning.measured.sampled_arrivals import pressures, sampled_arrivals
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Errors, Plan
from sonarsynth.receiver import Elements
from sonarsynth.receiver.subarrays import subarray, subarrays
from sonarsynth.recipe import Accuracy
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals import Synthesis
from sonarsynth.signals.auto_synthesis import deposit_for
from sonarsynth.state import OcclusionPoint
from sonarsynth.tracing.occlusion.sensor_occlusion import rim

FAINT, SYNTHESIS, EXPANSION = 0.1, 0.4, 0.5
"""Shares of the square of the error allowed to signals: of paths left out, of the synthesis, of expansions."""
HEARD_AT = 6
"""Hydrophones spread through the array that are traced by themselves to measure what expansions err by; in one frame
those farthest out as well, where that is most."""
SMALL_ARRAY = 24
"""Hydrophones of an array all of which are, in that frame."""
SEEN_AT = 64
"""Hydrophones, at most, whose views of the targets are compared with that of the middle of the array."""
MEASURED = 3
"""Frames of a dataset that expansions are measured in."""
FAINTER_MEASURED = 1e-3
"""Where errors are measured, so much less power is left out of echoes: that errs by 3 % as much."""
LARGE_MESH_FACETS = 1_000_000
"""Facets over which errors are measured in one frame only, at half as many hydrophones."""
WORTHWHILE_GAIN = 0.7
"""Each hydrophone's own view of the targets is taken where it errs by less than this part of the error without."""
FAINTER = 0.1
"""Where faint echoes make the error, so much less of their power is left out, before the array is cut."""
FAINT_REACH = 2.0
"""Faint echoes add at most this many times their bound to an error: the bound is on the mean."""
DEGREE_TOLERANCE = 0.03
"""Error of the synthesis that errors are measured with, over what is allowed."""


_CHOSEN: OrderedDict[str, tuple[Choices, Errors]] = OrderedDict()
KEPT = 16
"""Plans whose choices this process remembers: a recipe that is read again, frame by frame, is not measured again."""


def choose(plan: Plan, looks: Sequence[SampledScene]) -> Plan:
    """A plan whose windows are laid, with its choices made. Nothing in them depends on how fast this machine is."""
    try:
        key = plan.digest, sorted(plan.products), tuple(frame.index for look in looks for frame in look.frames)
    except (OSError, ValueError):  # a file that is not there, which what reads it says better
        return _choose(plan, looks)
    name = repr(key)
    if name not in _CHOSEN:
        chosen = _choose(plan, looks)
        _CHOSEN[name] = chosen.choices, chosen.errors
    choices, errors = _CHOSEN[name]
    while len(_CHOSEN) > KEPT:
        _CHOSEN.popitem(last=False)
    return replace(plan, choices=choices, errors=errors)


def _choose(plan: Plan, looks: Sequence[SampledScene]) -> Plan:
    scene, accuracy = plan.scene, plan.recipe.accuracy
    if not plan.products:  # nothing is traced
        return plan
    sampled = _measured_in(looks, 1 if _facets(scene) > LARGE_MESH_FACETS else MEASURED)
    bent = [
        max((ranging_error(look.scene, look.profile, look.frames, shape=shape) for look in sampled), default=0.0)
        for shape in (False, True)
    ]
    allowed, band = np.sqrt(SYNTHESIS) * accuracy.cheap, scene.sonar.band
    synthesis, synthesis_error = scene.physics.synthesis.resolve(
        Demand(allowed, accuracy.exact, lambda method: 0.0, plan.elements, bandwidth=band.high - band.low)
    )
    placing, placing_error = scene.processing.placing.resolve(
        Demand(accuracy.range_m, accuracy.exact, lambda method: bent[0], plan.elements, bending=bent[1])
    )
    picking, _ = scene.processing.picking.resolve(Demand(np.inf, accuracy.exact, lambda method: 0.0, plan.elements))
    choices = Choices(
        subarrays=1,
        negligible=_negligible(scene, accuracy),
        synthesis=synthesis,
        picking=picking,
        placing=placing,
    )
    chosen = replace(plan, choices=choices)
    indices = [look.frames[0].index for look in sampled]
    cut = _subarrays(chosen, indices)
    imaged = bool(plan.products & OF_BEAMS)
    beamforming, image_error = beamformer(chosen, indices) if imaged else (choices.beamforming, 0.0)
    return replace(
        chosen,
        choices=replace(
            choices,
            subarrays=cut.parts,
            occlusion=cut.occlusion,
            beamforming=beamforming,
            negligible=cut.faint * choices.negligible,
        ),
        errors=Errors(cut.error, cut.uncut, synthesis_error, placing_error, image_error),
    )


def _facets(scene: Scene) -> int:
    return sum(len(mesh.faces) for mesh in scene.meshes)


def _measured_in(looks: Sequence[SampledScene], count: int) -> list[SampledScene]:
    """Frames of the dataset to measure in, one a look: of different sequences, and along them."""
    real = [look for look in looks if look.real]
    chosen = [real[n] for n in evenly(len(real), count)]
    if len(chosen) < count or count == 1:
        frames = chosen[0].frames
        return [replace(chosen[0], frames=(frames[n],)) for n in evenly(len(frames), count)]
    return [replace(look, frames=(look.frames[n * (len(look.frames) - 1) // 2],)) for n, look in enumerate(chosen)]


def _negligible(scene: Scene, accuracy: Accuracy) -> float:
    if scene.physics.dynamic_range != "auto":
        return float(10.0 ** (-scene.physics.dynamic_range / 10.0))
    return 0.0 if accuracy.exact else FAINT * accuracy.cheap**2


@dataclass(frozen=True)
class _ArrayModel:
    """How paths reach the hydrophones."""

    parts: int  # that the array is cut into
    occlusion: OcclusionPoint
    error: float  # of signals
    uncut: float = np.nan  # the same, where the array is not cut and its middle sees for all
    faint: float = 1.0  # factor on the power that is left out of echoes


def _subarrays(plan: Plan, indices: Sequence[int]) -> _ArrayModel:
    """The fewest parts of the array that will do. Where one part will not, or there are sequences that nothing is
    measured in, each hydrophone's own view of the targets is tried first, then fainter echoes."""
    physics, count = plan.scene.physics, plan.elements.count
    occlusion: OcclusionPoint = "centre" if physics.occlusion == "auto" else physics.occlusion
    if physics.occlusion == "auto" and plan.recipe.accuracy.signal < OWN_VIEW:
        occlusion = "sensors"
    if physics.subarrays == "sensors" or (physics.subarrays == "auto" and plan.recipe.accuracy.exact):
        return _ArrayModel(count, "centre", 0.0)
    middle = len(indices) // 2  # of these frames: the one that is looked at most closely
    measures = [PerSensorReference.of(plan, index, outermost=n == middle) for n, index in enumerate(indices)]
    allowed = np.sqrt(EXPANSION) * plan.recipe.accuracy.signal / SAFETY
    fixed = physics.subarrays != "auto"
    first = min(physics.subarrays, count) if physics.subarrays != "auto" else 1
    stop_at = np.inf if fixed else allowed
    uncut = error = _worst(measures, first, occlusion, stop_at)
    if occlusion == "centre" and physics.occlusion == "auto" and first == 1 and error <= allowed:
        uncut = error = max(error, *(measure.own_views() for measure in measures))
    unseen = plan.recipe.sequences > len(measures)  # in which another body may stand in the way
    if occlusion == "centre" and physics.occlusion == "auto" and (error > allowed or unseen):
        better = _worst(measures, first, "sensors", stop_at)
        if better < WORTHWHILE_GAIN * error:
            occlusion, error = "sensors", better
    if fixed:
        return _ArrayModel(first, occlusion, error)
    if error <= allowed:
        return _ArrayModel(1, occlusion, error, uncut)
    return replace(_finer(plan, measures, occlusion, error, allowed), uncut=uncut)


def _finer(
    plan: Plan, measures: Sequence[PerSensorReference], occlusion: OcclusionPoint, error: float, allowed: float
) -> _ArrayModel:
    """The fewest parts, a power of two, that err by no more than is allowed, of an array that errs by more as a
    whole."""
    count, auto = plan.elements.count, plan.scene.physics.dynamic_range == "auto"
    faintest = FAINT_REACH * np.sqrt(FAINT) * plan.recipe.accuracy.cheap if auto else 0.0
    # Cubics err by the fourth power of the width of parts, the square of their number: no fewer will do.
    n, fewest = 0, max(int(np.log2(error / allowed) / 2.0), 1)
    while 2**n < count:
        error = _worst(measures, 2**n, occlusion, allowed) if n else error
        if error <= allowed:
            return _ArrayModel(2**n, occlusion, error)
        if error <= allowed + faintest and auto:
            less = _worst(measures, 2**n, occlusion, allowed, FAINTER)
            if less <= allowed:
                return _ArrayModel(2**n, occlusion, less, faint=FAINTER)
        n = max(n + 1, fewest)
    return _ArrayModel(count, "centre", 0.0)


def _worst(
    measures: Sequence[PerSensorReference],
    count: int,
    occlusion: OcclusionPoint,
    allowed: float,
    faint: float = 1.0,
) -> float:
    """Largest error of signals in some frames, or the first that is more than is allowed."""
    worst = 0.0
    for measure in measures:
        worst = max(worst, measure.error(count, occlusion, faint))
        if worst > allowed:
            break
    return worst


@dataclass(frozen=True, eq=False)
class PerSensorReference:
    """A frame at a few hydrophones, each traced by itself: what expansions are measured against."""

    plan: Plan
    frame: Frame
    sensor: Ints  # (heard,)
    exact: tuple[Floats, Floats]  # echoes, and direct arrivals (heard, sample) Pa

    @staticmethod
    def of(plan: Plan, index: int, *, outermost: bool = False) -> PerSensorReference:
        """Trace a frame to some hydrophones one by one, and synthesise what each hears; outermost: to those farthest
        out as well, or to all of a small array."""
        plan = plan.at(index)
        frame = plan.recipe.frame(index)[1]
        if _facets(plan.scene) > LARGE_MESH_FACETS:
            sensor = heard_at(plan.elements, HEARD_AT // 2)
        else:
            sensor = _with_outermost(plan.elements) if outermost else heard_at(plan.elements)
        every = replace(plan, choices=replace(plan.choices, negligible=FAINTER_MEASURED * plan.choices.negligible))
        rows = []
        for channel in sensor:
            single = subarray(plan.elements, np.array([channel]))
            arrivals = sampled_arrivals(every, frame, single)
            rows.append(pressures(plan, frame, arrivals, single.elements, _measuring(plan)))
        return PerSensorReference(
            plan, frame, sensor, (np.vstack([r[0] for r in rows]), np.vstack([r[1] for r in rows]))
        )

    def error(self, count: int, occlusion: OcclusionPoint = "centre", faint: float = 1.0) -> float:
        """Relative error of echoes or direct arrivals, the larger, where the array is cut into so many parts; faint:
        factor on the power that is left out of echoes."""
        chosen = self.plan.choices
        negligible = faint * chosen.negligible
        choices = replace(chosen, subarrays=count, occlusion=occlusion, negligible=negligible)
        plan = replace(self.plan, choices=choices)
        received = tuple(np.zeros_like(x) for x in self.exact)
        for part in subarrays(self.plan.elements, count):
            rows = np.flatnonzero(np.isin(self.sensor, part.sensor))
            if len(rows):
                own = np.searchsorted(part.sensor, self.sensor[rows])
                arrivals = sampled_arrivals(plan, self.frame, part).for_sensors(own, part.elements.count)
                of_part = pressures(plan, self.frame, arrivals, part.elements.select(own), _measuring(plan))
                for out, pressure in zip(received, of_part, strict=True):
                    out[rows] = pressure
        sizes = [float(np.linalg.norm(x)) for x in self.exact]
        errors = [float(np.linalg.norm(a - b)) for a, b in zip(received, self.exact, strict=True)]
        return max((e / size for e, size in zip(errors, sizes, strict=True) if size > 0.0), default=0.0)

    def own_views(self) -> float:
        """Error of signals, relative, where the middle of the array sees targets for all hydrophones: at `SEEN_AT` of
        them, since the shadow of a limb may cross a part of the array alone."""
        plan = replace(self.plan, choices=replace(self.plan.choices, occlusion="sensors"))
        rows = heard_at(plan.elements, SEEN_AT)
        seen = sampled_arrivals(plan, self.frame).for_sensors(rows, plan.elements.count)
        if not seen.occluded.any():
            return 0.0
        few = plan.elements.select(rows)
        own, middle = (pressures(plan, self.frame, a, few, _measuring(plan)) for a in (seen, seen.seen_from_centre))
        sizes = [(float(np.linalg.norm(a - b)), float(np.linalg.norm(a))) for a, b in zip(own, middle, strict=True)]
        return max((error / size for error, size in sizes if size > 0.0), default=0.0)


def heard_at(elements: Elements, most: int = HEARD_AT) -> Ints:
    """Live hydrophones spread through an array, by golden ratio, ascending."""
    live = np.flatnonzero(elements.gain)
    return live[scattered(min(most, len(live)), len(live), 0.309017)]  # half a step on: not the very first


def _with_outermost(elements: Elements) -> Ints:
    """Those of `heard_at` and the live hydrophones that are farthest out, ascending; all of a small array."""
    live = np.flatnonzero(elements.gain)
    return live if len(live) <= SMALL_ARRAY else np.union1d(heard_at(elements), np.intersect1d(rim(elements), live))


def _measuring(plan: Plan) -> Synthesis:
    """The synthesis that measures."""
    band = plan.scene.sonar.band
    return deposit_for(DEGREE_TOLERANCE * plan.recipe.accuracy.cheap, band.high - band.low)
