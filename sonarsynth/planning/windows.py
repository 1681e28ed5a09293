"""When each frame listens: the sample window and the echo window, from geometry alone."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.description import FieldError
from sonarsynth.planning.plans import Windows
from sonarsynth.recipe import Recipe
from sonarsynth.scene import Frame
from sonarsynth.sonar import elements
from sonarsynth.synthesis import pulse_support
from sonarsynth.world.environment import Profile

MARGIN = 0.1e-3
"""Seconds added at both ends of every window. Covers what straight rays leave out of an arrival time: under 2 us at
20 m in a gradient of 4 per second. Arrivals that still fall outside are counted in `/signals/outside`."""

SUPPORT = 1e-7
"""The sample window holds every pulse down to this part of its peak; so long after the direct one begin the echoes."""
ECHO_SUPPORT = 1e-4
"""The echo window holds every echo down to this part of its peak: its feet, under -80 dB, are cut."""


def lay_windows(recipe: Recipe, profile: Profile) -> Windows:
    """The sample window and the echo window that hold every direct arrival and echo of every frame.

    From geometry alone: the delay of each facet's echo along straight lines at the slowness averaged over the depths
    between its ends, and the support of the filtered snap.
    """
    scene = recipe.scene
    sonar = scene.sonar
    across = elements(sonar.array).aperture / profile.speed.min()  # of a wave, from the centre to the edge
    before, after = _support(recipe, SUPPORT) + across
    echo_before, echo_after = _support(recipe, ECHO_SUPPORT) + across
    spans = np.array([_span(recipe.frame(i)[1], profile) for i in range(recipe.frames)])
    direct, last_direct, first_echo, last_echo = spans.T
    gate = scene.processing.echo_window
    earliest = np.nanmin(first_echo - direct, initial=np.inf) - echo_before - MARGIN
    latest = np.nanmax(last_echo - direct, initial=-np.inf) + echo_after + MARGIN
    if not (np.isfinite(earliest) and np.isfinite(latest)):  # nothing echoes: listen for a moment after the snap
        earliest, latest = after, after + 2e-3
    start = gate.start if gate.start is not None else max(earliest, after)
    stop = gate.stop if gate.stop is not None else max(latest, start + 1e-3)
    if stop <= start:
        raise FieldError(("scene", "processing", "echo_window", "stop"), f"must be after start ({start:g} s)")
    rate = sonar.sampling_frequency
    first = np.floor((direct - before - MARGIN) * rate) / rate
    whole = np.fmax(last_direct, last_echo) + after + MARGIN  # NaN where nothing echoes
    last = np.maximum(whole, direct + stop + MARGIN)
    samples = int(np.ceil(np.max(last - first) * rate)) + 1
    return Windows(first, samples, direct, float(start), float(stop))


def _support(recipe: Recipe, tolerance: float) -> Floats:
    """Longest time (s) before and after its collapse that any filtered snap exceeds `tolerance` of its peak."""
    chosen = recipe.scene.sonar.antialias
    supports = [pulse_support(s.snap, chosen, tolerance) for s in recipe.scene.world.shrimp]
    return np.asarray(np.max(supports or [(0.0, 0.0)], axis=0))


def _span(frame: Frame, profile: Profile) -> tuple[float, float, float, float]:
    """First and last direct arrival, first and last echo (s) of a frame at the array centre; NaN where none."""
    array = frame.sonar_pose.position
    snaps = frame.moment.snaps
    if not snaps:
        return 0.0, 0.0, np.nan, np.nan
    direct = [s.time + _straight_time(profile, s.position, array) for s in snaps]
    echoes = [
        s.time + _straight_time(profile, s.position, points) + _straight_time(profile, points, array)
        for s in snaps
        for points in (b.pose.to_world(b.mesh.centroid) for b in frame.moment.bodies)
    ]
    if not echoes:
        return float(min(direct)), float(max(direct)), np.nan, np.nan
    return (
        float(min(direct)),
        float(max(direct)),
        float(min(e.min() for e in echoes)),
        float(max(e.max() for e in echoes)),
    )


def _straight_time(profile: Profile, a: Floats, b: Floats) -> Floats:
    """Travel time (...) along straight lines a to b (..., xyz): distance times the mean slowness between them."""
    if profile.uniform:
        return np.asarray(np.linalg.norm(a - b, axis=-1) / profile.speed[0])
    grid = np.unique(np.concatenate([profile.depth, np.linspace(0.0, max(depth(a).max(), depth(b).max()) + 1.0, 200)]))
    slowness = 1.0 / profile.at(grid)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(grid))])
    za, zb = depth(a), depth(b)
    level_ray = np.abs(za - zb) < 1e-6
    rise = np.where(level_ray, 1.0, zb - za)
    mean = (np.interp(zb, grid, integral) - np.interp(za, grid, integral)) / rise
    return np.asarray(np.linalg.norm(a - b, axis=-1) * np.where(level_ray, 1.0 / profile.at(za), mean))
