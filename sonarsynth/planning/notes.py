"""What a user should know about a plan before it is built: the lines that `plan` and `build` print."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.planning.looks import Look
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.sources import standing_off
from sonarsynth.planning.validity import validity
from sonarsynth.planning.windows import SUPPORT, extreme_waveforms
from sonarsynth.recipe import Recipe
from sonarsynth.scattering import Kirchhoff
from sonarsynth.scattering.notes import concave_note, small_note
from sonarsynth.scene import Scene
from sonarsynth.sonar import elements
from sonarsynth.synthesis.pulse import LONGEST_TAIL, cut_tail
from sonarsynth.world.casting import enclosing
from sonarsynth.world.environment import Profile
from sonarsynth.world.refinement import longest_edge
from sonarsynth.world.sound_speed import Cast, Tabulated, TemperatureSalinity

NEAR = 4.0
"""Distances, over the radius of the aperture, under which facets should be finer (measured: 2 to 5 % at 2.3)."""
COARSE = 0.1
"""Facets longer than this (m) are noted: range errors of points are a few centimetres."""


UNKNOWN = 0.1
"""Part of the water, at an end, that a profile may leave out without a word."""
NOTED = 8
"""Sequences that the notes on scenes are from, at most."""


def notes(made: Plan, looks: Sequence[Look]) -> tuple[str, ...]:
    """The notes on a plan, in order of importance."""
    recipe, scene = made.recipe, made.scene
    found: list[str] = []
    if made.looked_at < recipe.frames:
        found.append(
            f"{made.looked_at} of {recipe.frames} frames were looked at for the windows, and the ends of the "
            "variations; each other frame is checked when it is rendered, and set aside where it does not fit"
        )
    found += _shared(recipe, looks)
    if made.windows.disturbed:
        found.append(
            f"{made.windows.disturbed} frames: another snap or its echoes fall into the echo window of the loudest one"
        )
    cancelled = scene.processing.cancelling is not None
    if made.propagation.bounces and not cancelled and made.products & {"image", "cloud"} and made.sizes["snap"]:
        found.append("the snap's own reflections enter the image: processing.cancelling takes them out before")
    found += _accuracy(made) + list(_behind(recipe)) + off_the_bottom(scene)
    real = [look for look in looks if look.real]
    for look in real[:: -(-len(real) // NOTED)]:
        found += _extent(look.scene, look.profile)
        found += _cut(look.scene, look.profile.uniform)
        found += validity(look.scene, look.profile)
        found += _meshes(look.scene, look.profile)
        found += _near(look)
    return tuple(dict.fromkeys(found))


def _extent(scene: Scene, profile: Profile) -> list[str]:
    """Where measured water ends before the real one."""
    bed, first, last = scene.world.environment.depth, profile.depth[0], profile.depth[-1]
    written = isinstance(scene.world.environment.sound_speed, (Tabulated, TemperatureSalinity, Cast))
    if not written or max(first, bed - last) <= UNKNOWN * bed:
        return []
    known = f"at {first:g} m only" if first == last else f"from {first:g} to {last:g} m"
    return [f"the sound speed is given {known}, of {bed:g} m of water: beyond, it stays as it is there"]


def _shared(recipe: Recipe, looks: Sequence[Look]) -> list[str]:
    """What sequences of different splits have in common, so that one tells of the other."""
    if recipe.splits is None:
        return []
    found = []
    held: dict[str, dict[object, set[int]]] = {"target poses": {}, "snap positions": {}}
    for look in looks:
        if look.real:
            split, world = recipe.split(look.frames[0].index), look.scene.world
            trajectory = look.scene.trajectory
            poses = tuple((t.motion, trajectory.start, trajectory.interval) for t in world.targets)
            snaps = tuple((s.position, s.height) for s in world.shrimp)
            held["target poses"].setdefault(poses, set()).add(split)
            held["snap positions"].setdefault(snaps, set()).add(split)
    for what, splits in held.items():
        count = sum(len(some) > 1 for some in splits.values())
        if count:
            found.append(f"{count} sets of {what} are the same in several splits: vary them, or see splits.undivided")
    return found


def _cut(scene: Scene, uniform: bool) -> tuple[str, ...]:
    """Which snaps fall so slowly, once a path turns their phase, that the windows cut them."""
    if uniform and not scene.physics.tracing.bounces:
        return ()
    tails = [cut_tail(w, scene.sonar.antialias, SUPPORT) for w in extreme_waveforms(scene)]
    if max(tails, default=0.0) <= 10.0 * SUPPORT:
        return ()
    return (
        f"turned in phase by a path, a snap falls off slowly: it is cut {LONGEST_TAIL:g} s from its collapse, at "
        f"{max(tails):.1g} of its peak (no net impulse, or a filter without the lowest frequencies, helps)",
    )


def _accuracy(made: Plan) -> list[str]:
    """Where the accuracy of the recipe costs a lot, or what the scene chooses does not keep within it."""
    found, allowed, errors, parts = [], made.recipe.accuracy, made.errors, made.choices.subarrays
    if parts > 1 and errors.whole > 0.0:
        found.append(
            f"accuracy.signal {allowed.signal:g} takes {parts} subarrays, each traced by itself: one would err by "
            f"{errors.whole:.2g}"
        )
    if made.choices.visibility == "hydrophones" and made.scene.physics.visibility == "auto":
        found.append(
            f"accuracy.signal {allowed.signal:g} takes each hydrophone's own view of the targets: that from the middle "
            f"of the array errs by {errors.whole:.2g}"
        )
    if np.hypot(np.nan_to_num(errors.expansion), np.nan_to_num(errors.synthesis)) > allowed.signal:
        found.append(
            f"signals err by {errors.expansion:.2g} (paths over the array) and {errors.synthesis:.2g} (synthesis): "
            f"accuracy.signal allows {allowed.signal:g}, but the scene says how they are made (scene.physics)"
        )
    if errors.ranging > allowed.range_m:
        found.append(
            f"ranges err by {errors.ranging:.2g} m where rays bend: accuracy.range_m allows {allowed.range_m:g}, but "
            f"the scene asks for '{made.choices.ranging.kind}' (scene.processing.ranging)"
        )
    if errors.image > allowed.image_db:
        found.append(
            f"beams err by {errors.image:.2g} dB where the focus is not theirs: accuracy.image_db allows "
            f"{allowed.image_db:g}; more scene.processing.beamforming.zones, or kind dense"
        )
    return found


def off_the_bottom(scene: Scene) -> list[str]:
    """Which shrimp the sonar does not find where it may look for them."""
    if not (names := standing_off(scene)) or scene.processing.locating.on_bottom is False:
        return []
    told = scene.processing.locating.on_bottom is True
    then = "the sonar takes it for being there" if told else "snaps are located by their wavefronts alone"
    return [f"{', '.join(names)}: not on the bottom; {then} (scene.processing.locating.on_bottom)"]


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


def _near(look: Look) -> list[str]:
    """Which coherent targets come so near that a facet is not in one direction from all hydrophones."""
    nearest = NEAR * elements(look.scene.sonar.array).aperture
    found = []
    for number, (target, law) in enumerate(zip(look.scene.world.targets, look.scene.laws, strict=True)):
        if not isinstance(law, Kirchhoff):
            continue
        distances = [np.inf]
        for frame in look.frames:
            centre, radius = enclosing(frame.moment.bodies[number])
            distances.append(float(np.linalg.norm(centre - frame.sonar_pose.position)) - radius)
        if min(distances) < nearest:
            found.append(
                f"{target.name}: nearer than {nearest:.2g} m, where the echo may be some per cent off at the rim of "
                "the array: facets have one direction to all hydrophones (shape.edge: a quarter wavelength helps)"
            )
    return found


def _meshes(scene: Scene, profile: Profile) -> list[str]:
    """What meshes stand for: how coarse they are, what was repaired, what the law leaves out."""
    found: list[str] = []
    for target, law, mesh in zip(scene.world.targets, scene.laws, scene.meshes, strict=True):
        said = list(mesh.notes)
        if isinstance(law, Kirchhoff):
            longest = float(profile.speed.max()) / scene.sonar.band.low
            said += [line for line in (small_note(mesh, longest), concave_note(mesh)) if line]
        elif (edge := longest_edge((mesh.vertices, mesh.faces))) > COARSE:
            said.append(f"facets up to {edge:.2g} m long, each echoing from its middle: set shape.edge to refine")
        found += [f"{target.name}: {line}" for line in said]
    return found
