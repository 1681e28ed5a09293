"""What reverberation is heard against: the pulses that make it, and the noise that it drowns in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE
from sonarsynth.description import FieldError
from sonarsynth.equations.reverberation.bottom_strength import Angles
from sonarsynth.planning.listening_windows import frame_start
from sonarsynth.planning.measured.sampled_arrivals import context_of
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals.isolated_paths import sent_energy
from sonarsynth.signals.pulse_sums.reverberation_synthesis import spare_times
from sonarsynth.tracing.reverberation.families import ReverberationWindow, contrast_error, site_of
from sonarsynth.tracing.reverberation.reverberation_arrivals import reverberation_arrivals

if TYPE_CHECKING:
    from sonarsynth.planning.plans import Plan


GRAZING = np.sin(np.deg2rad(np.arange(5.0, 86.0, 5.0)))
"""Sines of the grazing angles at which strengths are compared."""


COUNTED = 0.1
"""Error of the contrast, at least, at which scatterers are counted for what they make it."""


@dataclass(frozen=True)
class ReverberationLevels:
    """What a frame has of reverberation."""

    families: tuple[tuple[str, int, float], ...]  # name, scatterers, dB re 1 uPa rms in the echo window
    left_out: tuple[tuple[str, float], ...]  # name, dB re all of it
    noise: float  # dB re 1 uPa: of a beam in the band
    edges: float  # dB: most that a strength changes from the centre of the band to its edges
    scatterers: int


@lru_cache(maxsize=4)
def reverberation_levels(plan: Plan) -> ReverberationLevels | None:
    """Of the first frame of the sequence of a plan; none where nothing scatters."""
    scene = plan.scene
    if scene.world.reverberation is None:
        return None
    frame = plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1]
    start = frame_start(plan, frame)
    try:
        scatterers = frame_scatterers(plan, frame, start)
    except ValueError as error:
        raise FieldError(("scene", "world", "reverberation"), str(error)) from None
    stop = start + plan.windows.samples / scene.sonar.sampling_frequency
    opens = max(stop - plan.windows.echo_duration, start)
    inside = (scatterers.delay >= opens) & (scatterers.delay < stop)
    power = np.bincount(scatterers.family[inside], scatterers.energy[inside], len(scatterers.families)) / (stop - opens)
    count = np.bincount(scatterers.family, minlength=len(scatterers.families))
    with np.errstate(divide="ignore"):
        level = 10.0 * np.log10(np.append(power, noise_power(scene) / plan.elements.count)) + 120.0
    counted = zip(scatterers.families, count.tolist(), level[:-1].tolist(), strict=True)
    families = tuple(row for row in counted if row[1])
    edges = _changes_within_band(plan)
    return ReverberationLevels(families, scatterers.left_out, float(level[-1]), edges, len(scatterers.delay))


def _changes_within_band(plan: Plan) -> float:
    """Most (dB) that backscattering strengths of boundaries change from the centre of the band to its edges."""
    described, band = plan.scene.world.reverberation, plan.scene.sonar.band
    back = Angles(GRAZING, GRAZING, np.full(len(GRAZING), -1.0))
    worst = 0.0
    for owner, law in (("bottom", described.bottom), ("surface", described.surface)) if described else ():
        if law is None:
            continue
        own = [law.checked_strength(back, site_of(owner, plan.medium, f)) for f in (band.low, band.centre, band.high)]
        if own[1].min() > 0.0:
            worst = max(worst, *(float(np.abs(10.0 * np.log10(x / own[1])).max()) for x in (own[0], own[2])))
    return worst


def noise_power(scene: Scene) -> float:
    """Power (Pa2) of ambient noise and electronics at a hydrophone in the band, by their density at its centre."""
    band, centre = scene.sonar.band, np.array([scene.sonar.band.centre])
    density = sum(float(noise.density(centre)[0]) for noise in scene.world.environment.noises)
    if scene.sonar.electronics is not None:
        density += REFERENCE_PRESSURE**2 * 10.0 ** (scene.sonar.electronics.level / 10.0)
    return density * (band.high - band.low)


@lru_cache(maxsize=16)
def _spread(plan: Plan) -> float:
    """How many times the error of the contrast is what scatterers that are alike would make it: counted in the first
    frame of the sequence of a plan, whose energies differ within cells and within steps of time."""
    frame, coarse = (
        plan.recipe.frame(plan.recipe.first_frame(plan.sequence))[1],
        max(COUNTED, plan.recipe.accuracy.speckle),
    )
    band = plan.scene.sonar.band
    arrivals = _scatterers(plan, frame, frame_start(plan, frame), coarse, 1.0)
    return contrast_error(arrivals, band.high - band.low) / coarse if len(arrivals.delay) else 1.0


def frame_scatterers(plan: Plan, frame: Frame, start: float) -> ReverberationArrivals:
    """The reverberation of a frame whose record begins at `start` (s); `plan` is that of its sequence. Raises
    ValueError where a boundary has no strength, or scatterers are too many."""
    return _scatterers(plan, frame, start, plan.recipe.accuracy.speckle, _spread(plan))


def _scatterers(plan: Plan, frame: Frame, start: float, speckle: float, spread: float) -> ReverberationArrivals:
    scene, snaps = plan.scene, frame.moment.snaps
    described = scene.world.reverberation
    assert described is not None
    context, sonar = context_of(plan, frame), scene.sonar
    stop = start + plan.windows.samples / sonar.sampling_frequency
    context = replace(context, receiver=context.receiver.at(0.5 * (start + stop)))  # what is heard is about there
    before, after = spare_times(plan.elements, sonar, context.receiver.speed(plan.medium), snaps)
    listening = ReverberationWindow(
        start - before,
        stop + after,
        sonar.band.high - sonar.band.low,
        speckle,
        spread,
        sent_energy(snaps, sonar),
        noise_power(scene) / plan.elements.count,
    )
    return reverberation_arrivals(described, context, listening, frame.seed, frame.key)
