"""What a scene needs: autos made concrete, windows, sizes, predicted cost; what is left out and its bound."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from sonarsynth.planning.checks import check_methods, check_positions, check_windows, read_inputs
from sonarsynth.planning.costs import left_out, stages
from sonarsynth.planning.notes import notes
from sonarsynth.planning.plans import PRODUCTS, Omission, Plan, Stage, Windows
from sonarsynth.planning.windows import lay_windows
from sonarsynth.recipe import Recipe
from sonarsynth.sonar import elements
from sonarsynth.tracing import AutoTracing, Refracted, Straight

__all__ = ["PRODUCTS", "Omission", "Plan", "Stage", "Windows", "chosen_products", "lay_windows", "plan"]

SHARD_BYTES = 64e6
"""A shard holds about this much of the largest array, and at most SHARD_FRAMES frames."""
SHARD_FRAMES = 8


def plan(recipe: Recipe, products: Iterable[str] = PRODUCTS) -> Plan:
    """Resolve a recipe: check the scene at every frame, make every choice, and predict sizes and cost.

    Raises FieldError, naming the field, for a body above the surface or in the bed, a sonar or shrimp out of the
    water, a snap that cannot be made, a missing or broken file, or methods that cannot serve the scene; ValueError for
    an unknown product. No frame is rendered.
    """
    if not isinstance(recipe, Recipe):
        raise TypeError(f"a recipe is planned, not a {type(recipe).__name__}: sonarsynth.load reads one from a file")
    products = chosen_products(products)
    scene = recipe.scene
    profile = read_inputs(scene)
    check_methods(scene, products)
    check_positions(scene, recipe)
    tracing = scene.physics.tracing
    if isinstance(tracing, AutoTracing):
        propagation: Straight | Refracted = tracing.resolve(profile)
    else:
        propagation = tracing
    windows = lay_windows(recipe, profile)
    check_windows(scene, windows)
    sizes = _sizes(recipe, windows)
    frame_bytes = sizes["sensor"] * sizes["sample"] * (2 if scene.sonar.converter else 4)
    shard = int(np.clip(SHARD_BYTES // max(frame_bytes, 1), 1, SHARD_FRAMES))
    made = Plan(recipe, products, profile, propagation, windows, sizes=sizes, shard_frames=shard)
    return replace(made, stages=stages(made), left_out=left_out(made), warnings=notes(made))


def chosen_products(names: Iterable[str]) -> frozenset[str]:
    """Products by name, one or several. Raises ValueError for a name that is none."""
    chosen = frozenset([names] if isinstance(names, str) else names)
    unknown = sorted(chosen - set(PRODUCTS))
    if unknown:
        raise ValueError(f"'{unknown[0]}' is not a product; known: {', '.join(PRODUCTS)}")
    return chosen


def _sizes(recipe: Recipe, windows: Windows) -> dict[str, int]:
    scene = recipe.scene
    beams = scene.sonar.beams
    snaps = sum(len(s.snap_times) for s in scene.world.shrimp)
    return {
        "frame": recipe.frames,
        "sensor": elements(scene.sonar.array).count,
        "sample": windows.samples,
        "elevation": beams.elevations,
        "azimuth": beams.azimuths,
        "target": len(scene.world.targets),
        "snap": snaps,
    }
