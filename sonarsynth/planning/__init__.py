"""What a scene needs: autos made concrete, windows, sizes, predicted cost; what is left out and its bound."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from sonarsynth.planning.checks import check_methods, check_positions, check_windows, read_inputs
from sonarsynth.planning.costs import left_out, stages
from sonarsynth.planning.plans import PRODUCTS, Omission, Plan, Stage, Windows
from sonarsynth.planning.validity import validity
from sonarsynth.planning.windows import SUPPORT, extreme_waveforms, lay_windows
from sonarsynth.recipe import Recipe
from sonarsynth.scattering.targets import Target
from sonarsynth.sonar import elements
from sonarsynth.synthesis.pulse import LONGEST_TAIL, cut_tail
from sonarsynth.tracing import AutoTracing, Refracted, Straight
from sonarsynth.world.meshes import Mesh
from sonarsynth.world.refinement import longest_edge

__all__ = ["PRODUCTS", "Omission", "Plan", "Stage", "Windows", "chosen_products", "lay_windows", "plan"]

SHARD_BYTES = 64e6
"""A shard holds about this much of the largest array, and at most SHARD_FRAMES frames."""
SHARD_FRAMES = 8
COARSE = 0.1
"""Facets longer than this (m) are noted: range errors of points are a few centimetres."""


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
    notes: tuple[str, ...] = ()
    if windows.disturbed:
        notes += (
            f"{windows.disturbed} frames: another snap or its echoes fall into the echo window of the loudest one",
        )
    cancelled = scene.processing.cancelling is not None
    if made.propagation.bounces and not cancelled and products & {"image", "cloud"} and sizes["snap"]:
        notes += ("the snap's own reflections enter the image: processing.cancelling takes them out before",)
    notes += validity(scene, profile)
    notes += _cut(recipe, profile.uniform)
    notes += _behind(recipe)
    notes += _coarse(recipe)
    notes += tuple(f"{t.name}: {note}" for t, mesh in _meshes(recipe) for note in mesh.notes)
    return replace(made, stages=stages(made), left_out=left_out(made), warnings=notes)


def _cut(recipe: Recipe, uniform: bool) -> tuple[str, ...]:
    """Which snaps fall so slowly, once a path turns their phase, that the windows cut them."""
    scene = recipe.scene
    if uniform and not scene.physics.tracing.bounces:
        return ()
    tails = [cut_tail(w, scene.sonar.antialias, SUPPORT) for w in extreme_waveforms(scene)]
    if max(tails, default=0.0) <= 10.0 * SUPPORT:
        return ()
    return (
        f"turned in phase by a path, a snap falls off slowly: it is cut {LONGEST_TAIL:g} s from its collapse, at "
        f"{max(tails):.1g} of its peak (no net impulse, or a filter without the lowest frequencies, helps)",
    )


def _behind(recipe: Recipe) -> tuple[str, ...]:
    """Which snaps of the first and last frame come from behind the array."""
    found = []
    for step in sorted({0, recipe.frames - 1}):
        frame = recipe.frame(step)[1]
        count = sum(bool(frame.sonar_pose.to_body(snap.position)[0] < 0) for snap in frame.moment.snaps)
        if count:
            found.append(
                f"frame {step}: {count} snaps come from behind the array, which takes them for their mirror images"
            )
    return tuple(found)


def chosen_products(names: Iterable[str]) -> frozenset[str]:
    """Products by name, one or several. Raises ValueError for a name that is none."""
    chosen = frozenset([names] if isinstance(names, str) else names)
    unknown = sorted(chosen - set(PRODUCTS))
    if unknown:
        raise ValueError(f"'{unknown[0]}' is not a product; known: {', '.join(PRODUCTS)}")
    return chosen


def _coarse(recipe: Recipe) -> tuple[str, ...]:
    """Notes on targets whose echoes come from the middles of facets longer than COARSE: not of coherent facets."""
    plain = [pair for pair, law in zip(_meshes(recipe), recipe.scene.laws, strict=True) if law.kind != "kirchhoff"]
    longest = ((t.name, longest_edge((m.vertices, m.faces.astype(np.int64)))) for t, m in plain)
    return tuple(
        f"{name}: facets up to {edge:.2g} m long, each echoing from its middle: set shape.edge to refine"
        for name, edge in longest
        if edge > COARSE
    )


def _meshes(recipe: Recipe) -> list[tuple[Target, Mesh]]:
    return list(zip(recipe.scene.world.targets, recipe.scene.meshes, strict=True))


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
