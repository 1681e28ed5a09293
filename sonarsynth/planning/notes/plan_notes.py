"""What a user should know about a plan before it is built: the lines that `plan` and `build` print."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.conventions import depth
from sonarsynth.environment.sea import Profile
from sonarsynth.environment.sound_speed import kink
from sonarsynth.planning.choices import OF_BEAMS, OWN_VIEW
from sonarsynth.planning.measured.converter_levels import converter_notes
from sonarsynth.planning.measured.lost_echoes import lost_echoes
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.notes.formula_validity import validity
from sonarsynth.planning.notes.motion_rows import stretch_notes
from sonarsynth.planning.notes.population_notes import once, population_notes
from sonarsynth.planning.notes.source_notes import (
    assumed_speed_notes,
    cancelled_by_image,
    direction_notes,
    lobe_notes,
    off_the_bottom,
    out_of_band,
    steering_notes,
    unheard_scatterers,
    unlit,
    unlocated,
)
from sonarsynth.planning.notes.target_notes import (
    facet_notes,
    focus_notes,
    hiding_notes,
    law_notes,
    mirror_notes,
    overlap_notes,
    view_notes,
    where_laws_hold,
)
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.pulse_durations import SUPPORT, extreme_waveforms
from sonarsynth.products import SPLITS
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Scene
from sonarsynth.signals.filtered_pulse import LONGEST_TAIL, cut_tail

UNKNOWN = 0.1
"""Part of the water, at an end, that a profile may leave out without a word."""
NOTED = 8
"""Sequences that the notes on scenes are from, at most."""

SHARP, LEAST_SPAN = 0.5, 1e-3
"""Change of the gradient of the sound speed (1/s) that is called a kink; and over which depth (m) it is measured."""
REFLECTED_SNAP = (
    "reflections of the snap itself enter the image, and where they are far louder than echoes there are no points: "
    "scene.processing.cancelling removes them"
)
"""Said where nothing removes them: in `remus.yaml` with two bounces, all peaks are lobes of one."""


def notes(plan: Plan, looks: Sequence[SampledScene]) -> tuple[str, ...]:
    """The notes on a plan, in order of importance."""
    recipe, scene = plan.recipe, plan.scene
    lines: list[str] = []
    if plan.looked_at < recipe.frames:
        lines.append(
            f"the windows are based on {plan.looked_at} of {recipe.frames} frames and the ends of the variations; "
            "every other frame is checked when it is rendered, and fails if it does not fit"
        )
    lines += population_notes(recipe) + _shared(recipe, looks) + unlit(plan)
    lines += _several_snaps(plan)
    if scene.world.chorus is not None and plan.chorus is not None:
        reach, distant = plan.chorus, 0.0 if plan.distant_chorus is None else plan.distant_chorus.share
        level = reach.level - 10.0 * np.log10(1.0 - distant)
        beyond, heard = (distant, "Gaussian noise") if distant else (10.0 ** (reach.beyond / 10.0), "left out")
        lines.append(
            f"chorus: {scene.world.chorus.row()}: predicted {level:.0f} dB re 1 uPa rms in the band, "
            f"snaps within {reach.reach:.4g} m one by one (excess kurtosis {reach.kurtosis:.3g}), those beyond, "
            f"{100.0 * beyond:.2g} % of the power, {heard}"
        )
    cancelled = scene.processing.cancelling is not None
    if plan.propagation.bounces and not cancelled and plan.products & OF_BEAMS and plan.sizes["emission"]:
        lines.append(REFLECTED_SNAP)
    if plan.products & OF_BEAMS:
        lines += view_notes(noted(looks)) + steering_notes(noted(looks))
        lines += stretch_notes(noted(looks), recipe.accuracy.range_m)
    lines += lost_echoes(plan) + _accuracy(plan, looks) + off_the_bottom(scene) + cancelled_by_image(scene)
    lines += converter_notes(plan, looks)
    lines += out_of_band(scene) + unheard_scatterers(plan)
    if plan.sizes["emission"] and plan.products & OF_BEAMS:
        some = noted(looks)
        lines += unlocated(scene) or lobe_notes(some) + direction_notes(some) + assumed_speed_notes(some)
    for look in noted(looks):
        lines += facet_notes(plan, look) + hiding_notes(look) + mirror_notes(look) + overlap_notes(look)
        lines += focus_notes(look) if plan.products & OF_BEAMS else []
        lines += _extent(look.scene, look.profile)
        lines += _cut(look.scene, look.profile.uniform)
        lines += validity(look)
        lines += law_notes(look)
    return once(lines, recipe)


def _several_snaps(plan: Plan) -> list[str]:
    """What becomes of echoes of other snaps than the one that is the clock."""
    if not plan.windows.disturbed:
        return []
    line = (
        f"{plan.windows.disturbed} frames: another snap or its echoes fall into the echo window of the loudest: "
        "where other echoes do not tell which lit a point, its range_error is half of what that leaves open; images "
        "hold the echoes of both"
    )
    ranged = ", and range images have those of the other at wrong ranges, for their clock is the first source estimate"
    return [line + (ranged if "range_image" in plan.products else "")]


def noted(looks: Sequence[SampledScene]) -> list[SampledScene]:
    """The sequences that notes are from."""
    real = [look for look in looks if look.real]
    return real[:: -(-len(real) // NOTED)]


def stored_validity(recipe: Recipe, looks: Sequence[SampledScene]) -> tuple[str, ...]:
    """Where formulas and laws of the scenes hold and do not, one line each: as the store has them."""
    lines: list[str] = []
    for look in noted(looks):
        lines += [*where_laws_hold(look), *validity(look)]
    return once(lines, recipe)


def _extent(scene: Scene, profile: Profile) -> list[str]:
    """Where measured water ends before the real one."""
    bottom, first, last = scene.world.environment.depth, profile.depth[0], profile.depth[-1]
    written = scene.world.environment.sound_speed.measured
    if not written or max(first, bottom - last) <= UNKNOWN * bottom:
        return []
    extent = f"at {first:g} m only" if first == last else f"from {first:g} to {last:g} m"
    return [f"the sound speed is given {extent}, but the water is {bottom:g} m deep: it is held constant beyond"]


def _shared(recipe: Recipe, looks: Sequence[SampledScene]) -> list[str]:
    """What sequences of different splits have in common, so that one tells of the other."""
    if recipe.splits is None:
        return []
    counts = np.bincount(recipe.spanned.split, minlength=len(SPLITS))
    empty = [name for name, share, n in zip(SPLITS, recipe.splits.shares, counts, strict=True) if share and not n]
    few = "the only sequence" if recipe.sequences == 1 else f"any of the {recipe.sequences} sequences"
    lines = [f"splits: {' and '.join(empty)} will not have {few}: more repeats, or a grid, give more"] if empty else []
    splits_by_value: dict[str, dict[object, set[int]]] = {"target poses": {}, "snap positions": {}}
    for look in looks:
        if look.real:
            split, world = recipe.split(look.frames[0].index), look.scene.world
            trajectory = look.scene.trajectory
            poses = tuple((t.motion, trajectory.start, trajectory.interval) for t in world.targets)
            still = (s for s in world.sources if not s.mounted)
            snaps = tuple(tuple(s.position_at(world.environment.depth).tolist()) for s in still)
            for name, value in (("target poses", poses), ("snap positions", snaps)):
                if value:  # scenes without any have nothing in common
                    splits_by_value[name].setdefault(value, set()).add(split)
    for name, splits in splits_by_value.items():
        count = sum(len(members) > 1 for members in splits.values())
        if count:
            lines.append(f"{count} sets of {name} occur in more than one split: vary them, or see splits.undivided")
    return lines


def _cut(scene: Scene, uniform: bool) -> tuple[str, ...]:
    """Which snaps fall so slowly, once a path turns their phase, that the windows cut them."""
    if uniform and not scene.physics.tracing.bounces:
        return ()
    tails = [cut_tail(w, scene.sonar.antialias, SUPPORT) for w in extreme_waveforms(scene)]
    if max(tails, default=0.0) <= 10.0 * SUPPORT:
        return ()
    return (
        f"after a phase-shifting reflection a snap decays slowly: it is cut {LONGEST_TAIL:g} s from its collapse, at "
        f"{max(tails):.1g} of its peak (a snap without net impulse, or a high-pass filter, helps)",
    )


def _accuracy(plan: Plan, looks: Sequence[SampledScene]) -> list[str]:
    """Where the accuracy of the recipe costs a lot, or what the scene chooses does not keep within it."""
    lines, allowed, errors, count = [], plan.recipe.accuracy, plan.errors, plan.choices.subarrays
    if count > 1 and errors.uncut > 0.0:
        lines.append(
            f"accuracy.signal {allowed.signal:g} needs {count} subarrays, each traced by itself: with one the error is "
            f"{errors.uncut:.3g}{_kink_in_array(plan, looks)}"
        )
    if plan.choices.occlusion == "sensors" and plan.scene.physics.occlusion == "auto":
        needs = f"accuracy.signal {allowed.signal:g} needs the targets' occlusion from each hydrophone"
        why = f"the error is {errors.uncut:.2g}" if np.isfinite(errors.uncut) else "the error is larger"
        if allowed.signal < OWN_VIEW:
            why = f"what is hidden from a few alone errs by up to {OWN_VIEW:g} at these"
        elif errors.uncut <= allowed.signal:
            needs = f"accuracy.signal {allowed.signal:g} may need the targets' occlusion from each hydrophone"
            why += " in the sequences measured, and may be more in the others"
        lines.append(f"{needs}: with that from the array centre {why} (scene.physics.occlusion)")
    if np.hypot(np.nan_to_num(errors.expansion), np.nan_to_num(errors.synthesis)) > allowed.signal:
        lines.append(
            f"signal errors are {errors.expansion:.2g} (paths over the array) and {errors.synthesis:.2g} (synthesis): "
            f"accuracy.signal allows {allowed.signal:g}, but the recipe fixes the method (scene.physics)"
        )
    tolerance = 20.0 * np.log10(1.0 + allowed.signal)
    if plan.absorption_error > tolerance:
        lines.append(
            f"all paths share the absorption spectrum at their mean depth: up to {plan.absorption_error:.2g} dB off at "
            f"the ends of the band, where accuracy.signal allows {tolerance:.2g} dB"
        )
    if errors.ranging > allowed.range_m:
        lines.append(
            f"range errors are {errors.ranging:.2g} m{_why_ranges_err(plan.scene, looks)}: accuracy.range_m allows "
            f"{allowed.range_m:g}, but the recipe requests '{plan.choices.placing.kind}' (scene.processing.placing)"
        )
    if errors.image > allowed.image_db:
        lines.append(
            f"beams out of focus have errors of {errors.image:.2g} dB: accuracy.image_db allows "
            f"{allowed.image_db:g}; use more scene.processing.beamforming.subarrays, or kind dense"
        )
    return lines


def _kink_in_array(plan: Plan, looks: Sequence[SampledScene]) -> str:
    """Why one expansion fails where the sound speed has a kink within the array: rays to its parts bend differently."""
    reach = plan.elements.aperture
    for look in looks:
        middle = float(depth(look.frames[0].sonar_pose.position))
        if kink(look.profile, middle, reach) > SHARP:
            nodes = look.profile.depth[np.abs(look.profile.depth - middle) < reach]
            at = float(nodes[np.argmax([kink(look.profile, node, LEAST_SPAN) for node in nodes])])
            return f", for the sound speed has a kink at {at:g} m, within the array: move one of the two"
    return ""


def _why_ranges_err(scene: Scene, looks: Sequence[SampledScene]) -> str:
    """What the closed form of ranges leaves out of the water: bent rays, or only that it assumes another speed."""
    if not all(look.profile.uniform for look in looks):
        return " where rays bend"
    assumed = scene.sonar.assumed_sound_speed
    speed = max((float(look.profile.speed[0]) for look in looks), key=lambda real: abs(real - assumed))
    return f", for sound travels at {speed:g} m/s and scene.sonar.assumed_sound_speed is {assumed:g} m/s"
