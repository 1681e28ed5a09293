"""Fewer layers of sound speed that stand for a measured profile, as few as the accuracy of the signals allows.

Below the bottom nothing is needed. Above it, nodes are those of the coarsest polyline within a height of the profile
(Ramer 1972, Computer Graphics and Image Processing 1, 244), with the speeds that are nearest to it in the mean square,
so that the mean slowness of what is passed stays. The height is lowered until paths differ by no more than is allowed,
measured over the ways out to the bodies, back, and straight in.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Bools, Floats, evenly
from sonarsynth.environment.profiles import nearest
from sonarsynth.environment.sea import Profile
from sonarsynth.planning.measured.ray_bending import difference_of_paths, ways
from sonarsynth.propagation import Propagation
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame

FEW: Final = 40
"""Nodes of a profile that costs little as it is."""
SHARE: Final = 0.2
"""Of the error allowed to signals that fewer layers may take."""
HEIGHTS: Final = (0.3, 0.1, 0.03, 0.01, 0.003, 1e-3, 3e-4)
"""m/s: how far a polyline may be off before its speeds are fitted, tried in turn."""
COARSE: Final = 0.1
"""m/s: the same at depths that no ray passes."""
ROOM: Final = 3.0
"""m by which rays may be higher or deeper than what they join."""
SAMPLED: Final = 17
"""Frames of a sequence that are looked at, at most."""
WORTHWHILE: Final = 0.8
"""Of the nodes, that may be left for the thinner profile to be taken."""


def thinned(model: Propagation, recipe: Recipe, sequence: int, profile: Profile) -> tuple[Profile, float]:
    """A profile of fewer nodes for a sequence, and the error of the signals that it makes in frames along it, relative.

    Nothing is left out where the recipe asks for no error. The profile is returned as it is where it has few nodes,
    or where every thinner one errs by more (micro-layers that make rays of their own are kept so).
    """
    scene, signal = recipe.scene_of(sequence), 0.0 if recipe.accuracy.exact else recipe.accuracy.signal
    bottom = scene.world.environment.depth
    above = _above(profile, bottom) if scene.world.environment.sound_speed.measured else profile
    if len(above.depth) <= FEW or signal == 0.0 or not model.bends:
        return above, 0.0
    frames = tuple(sampled(recipe, sequence))
    low, high = (0.0, bottom) if model.bounces else _passed(frames, bottom)
    passed = (above.depth >= low) & (above.depth <= high)
    coarse = polyline(above.depth, above.speed, COARSE)
    for height in HEIGHTS:
        retained = np.where(passed, polyline(above.depth, above.speed, min(height, COARSE)), coarse)
        node = above.depth[retained]
        if len(node) > WORTHWHILE * len(above.depth):
            break
        fewer = Profile(node, nearest(node, above.depth, above.at), profile.notes)
        error = difference_of_paths((model, fewer), (model, above), scene, frames)
        if error <= SHARE * signal:
            return fewer, error
    return above, 0.0


def sampled(recipe: Recipe, sequence: int) -> list[Frame]:
    """Frames along a sequence, its first and last among them."""
    return [recipe.frame(recipe.first_frame(sequence) + n)[1] for n in evenly(recipe.steps(sequence), SAMPLED)]


def _passed(frames: tuple[Frame, ...], bottom: float) -> tuple[float, float]:
    """Depths (m) that rays pass between the snaps, the bodies and the array of some frames, with room to bend."""
    places = [np.concatenate(ways(frame, bottom)) for frame in frames]
    z = -np.concatenate([*places, [[0.0, 0.0, frame.sonar_pose.position[2]] for frame in frames]])[:, 2]
    return float(z.min()) - ROOM, float(z.max()) + ROOM


def _above(profile: Profile, bottom: float) -> Profile:
    """The same down to the first node at or below the bottom."""
    count = int(np.searchsorted(profile.depth, bottom, side="left")) + 1
    if count >= len(profile.depth) or bottom < profile.depth[0]:
        return profile
    return Profile(profile.depth[:count], profile.speed[:count], profile.notes)


def polyline(depth: Floats, speed: Floats, height: float) -> Bools:
    """(node,) the nodes, ends among them, of a polyline that is nowhere off a profile by more than a height (m/s)."""
    retained = np.zeros(len(depth), bool)
    retained[[0, -1]] = True
    jumps = np.flatnonzero(np.diff(depth) == 0.0)
    retained[jumps] = retained[jumps + 1] = True
    ends = np.flatnonzero(retained)
    spans = list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
    while spans:
        first, last = spans.pop()
        if last - first < 2 or depth[last] == depth[first]:
            continue
        inside = slice(first + 1, last)
        line = np.interp(depth[inside], depth[[first, last]], speed[[first, last]])
        off = np.abs(speed[inside] - line)
        worst = int(np.argmax(off))
        if off[worst] > height:
            middle = first + 1 + worst
            retained[middle] = True
            spans += [(first, middle), (middle, last)]
    return retained
