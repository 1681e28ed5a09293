"""What a scene needs: autos made concrete, windows, sizes, predicted cost; what is left out and its bound."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from sonarsynth.planning.choices import ALL_PRODUCTS, OF_BEAMS, PRODUCTS, Choices, choices_from
from sonarsynth.planning.choosing import choose
from sonarsynth.planning.costs import machine_factor, stages
from sonarsynth.planning.listening_windows import frame_start, listening_windows
from sonarsynth.planning.measured.path_counts import room_for_paths
from sonarsynth.planning.measured.ray_bending import propagation
from sonarsynth.planning.measured.sampled_arrivals import arrivals_of, behind_baffle, context_of, receiver_of, survey_of
from sonarsynth.planning.measured.sampled_frames import SampledScene, check_alike, sample_frames
from sonarsynth.planning.notes.omissions import left_out
from sonarsynth.planning.notes.plan_notes import notes, stored_validity
from sonarsynth.planning.notes.product_checks import check_located, check_methods, check_windows
from sonarsynth.planning.notes.scene_checks import check_frame, read_inputs
from sonarsynth.planning.plan_tables import Stage
from sonarsynth.planning.plans import Plan, Windows
from sonarsynth.receiver import elements
from sonarsynth.recipe import Recipe, must_be_recipe
from sonarsynth.recipe.scene import Frame
from sonarsynth.recipe.sequence_checks import check_spanned, most_emissions
from sonarsynth.threads import in_one_thread

__all__ = [
    "OF_BEAMS",
    "PRODUCTS",
    "Choices",
    "Plan",
    "Windows",
    "arrivals_of",
    "behind_baffle",
    "check_unsampled_frame",
    "choices_from",
    "chosen_products",
    "context_of",
    "frame_start",
    "plan",
    "receiver_of",
    "survey_of",
]

SHARD_BYTES = 128e6
"""A shard holds about this much before compression, and at most so many frames:"""
SHARD_FRAMES = 8
MANY_FRAMES = 256
"""Frames of a shard of a large dataset of short frames: a shard costs some 20 ms, whatever it holds, and 100 files."""
SHARDS = 64
"""Shards of a dataset, at least, for there to be more than SHARD_FRAMES frames in one."""
SHARD_SECONDS = 20.0
"""Seconds that such a shard takes at most, by counts of work: those of the machine that costs were measured on."""
STRANGERS = 4
"""Snaps that the sonar looks at besides those of the recipe, where there is a chorus."""
COSTED = 5
"""Sequences over which the predicted cost is averaged."""


@in_one_thread
def plan(recipe: Recipe, products: Iterable[str] = PRODUCTS, choices: Choices | None = None) -> Plan:
    """Resolve a recipe: check the scene at every frame, make every choice, and predict sizes and cost.

    No frame is rendered. Of a dataset of more than sampled_frames.MAX_SAMPLED_FRAMES frames, so many are looked at;
    each other one is checked when it is rendered.

    Parameters
    ----------
    recipe: what is resolved.
    products: what is stored besides the truth, of `ALL_PRODUCTS`.
    choices: those that another plan of the same recipe made (default: the cheapest that keep within its accuracy).

    Returns
    -------
    The plan; printed, it is a table.

    Raises
    ------
    FieldError, naming the field, for a body above the surface or in the bottom, a sonar or shrimp out of the water, a
    snap that cannot be made, a missing or broken file, or methods that cannot serve the scene; ValueError for an
    unknown product.
    """
    must_be_recipe(recipe, "planned")
    products = chosen_products(products)
    check_spanned(recipe.spanned)
    with recipe.spanned.naming(0):
        scene = recipe.scene_of(0)
        profile = read_inputs(scene)
        check_methods(scene, products)
    looks = sample_frames(recipe)
    for look in looks:
        if look.real:
            with recipe.spanned.naming(recipe.sequence(look.frames[0].index)):
                for frame in look.frames:
                    check_located(look.scene, frame, products)
    ends = (looks[0].frames[0], looks[0].frames[-1])
    paths = propagation(scene, profile, ends, recipe.accuracy.signal)
    windows = listening_windows(recipe, looks)
    check_windows(scene, windows)
    sizes = _sizes(recipe, windows)
    resolved = Plan(recipe, products, profile, paths, windows, sizes=sizes)
    resolved = choose(resolved, looks) if choices is None else replace(resolved, choices=choices)
    if "paths" in products:
        resolved = replace(resolved, sizes=sizes | {"path": room_for_paths(resolved, looks)})
    resolved = replace(resolved, stages=_mean_stages(resolved, looks))
    resolved = replace(resolved, shard_frames=_shard_frames(resolved), validity=stored_validity(recipe, looks))
    return replace(resolved, left_out=left_out(resolved), warnings=notes(resolved, looks))


def _shard_frames(resolved: Plan) -> int:
    """Frames of a shard: the same on every machine, so that a build can go on elsewhere."""
    frame_bytes = sum(stage.bytes for stage in resolved.stages)
    seconds = max(sum(stage.seconds for stage in resolved.stages) / machine_factor(), 1e-6)
    many = min(SHARD_SECONDS / seconds, resolved.recipe.frames / SHARDS, MANY_FRAMES)
    frames = max(2 ** int(np.log2(max(many, 1.0))), SHARD_FRAMES)
    return int(np.clip(SHARD_BYTES // max(frame_bytes, 1), 1, frames))


def _mean_stages(resolved: Plan, looks: Sequence[SampledScene]) -> tuple[Stage, ...]:
    """The stages, with the mean cost over a few sequences."""
    real = [look.frames[0].index for look in looks if look.real]
    chosen = real[:: -(-len(real) // COSTED)]
    rows = [stages(resolved.at(index)) for index in chosen]
    spent = [(stage, stage.seconds / len(rows)) for row in rows for stage in row]
    named = {stage.stage: stage for stage, _ in reversed(spent)}  # parts of the noise may vary
    order = dict.fromkeys(stage.stage for stage, _ in spent)
    return tuple(replace(named[name], seconds=sum(s for stage, s in spent if stage.stage == name)) for name in order)


def chosen_products(names: Iterable[str]) -> frozenset[str]:
    """Products by name, one or several; none, or "truth", for truth alone. Raises ValueError for another name."""
    chosen = frozenset([names] if isinstance(names, str) else names) - {"truth"}
    unknown = sorted(chosen - set(ALL_PRODUCTS))
    if unknown:
        raise ValueError(f"'{unknown[0]}' is not a product; known: {', '.join((*ALL_PRODUCTS, 'truth'))}")
    return chosen


def _sizes(recipe: Recipe, windows: Windows) -> dict[str, int]:
    scene = recipe.scene_of(0)
    beams = scene.sonar.beams
    snaps = most_emissions(recipe.spanned)
    ranges = {} if scene.sonar.ranges is None else {"range": scene.sonar.ranges.count}
    return ranges | {
        "frame": recipe.frames,
        "sensor": elements(scene.sonar.array).count,
        "sample": windows.samples,
        "elevation": beams.elevations,
        "azimuth": beams.azimuths,
        "target": len(recipe.target_names),
        "emission": snaps,
        "estimate": snaps + (STRANGERS if scene.world.chorus is not None else 0),
        "point": min(scene.processing.max_points, beams.elevations * beams.azimuths),
    }


def check_unsampled_frame(plan: Plan, frame: Frame) -> None:
    """Check a frame that was not looked at when its dataset was planned; `plan` is that of its sequence.

    Raises FieldError where something is out of the water, or the frame does not fit in the windows.
    """
    if not np.isfinite(plan.windows.start[frame.index]):
        with plan.recipe.spanned.naming(plan.sequence):
            check_alike(plan.recipe.described, plan.scene)
            check_frame(plan.scene, frame)
            check_located(plan.scene, frame, plan.products)
            frame_start(plan, frame)
