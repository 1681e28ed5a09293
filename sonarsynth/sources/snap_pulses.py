"""The pulse at 1 m of every described snap: one function, whatever the model."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, waveforms
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.equations.bubble.snap_pressure import Bubble
from sonarsynth.sources.recordings import Stamp, read_recording, stamp
from sonarsynth.sources.shrimp import LogarithmicBubble, SnapModel
from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation

CUT = 3.0
"""Standard deviations at which a variation is cut."""


class Waveform(NamedTuple):
    """What snaps that sound alike have in common: the key of all that is kept of a pulse."""

    model: SnapModel  # a bubble at its depth
    width: float  # p(t/width)
    stamp: Stamp | None  # of the file that it comes from


class Scales(NamedTuple):
    """How snaps differ from their model: p(t) becomes gain p(t/width)."""

    gain: Floats  # (snap,)
    width: Floats  # (snap,)


def waveform(model: SnapModel, width: float = 1.0) -> Waveform:
    """The waveform of a described snap that lasts `width` times as long. Raises ValueError for a file that is gone."""
    return Waveform(model, width, stamp(model) if isinstance(model, RecordedSnap) else None)


def at_depth(model: SnapModel, depth: float) -> SnapModel:
    """The snap of a shrimp at this depth (m), if it has none of its own."""
    if isinstance(model, KellerMiksis) and model.depth is None:
        return replace(model, depth=max(depth, 0.0))
    return model


def pulse(model: SnapModel, depth: float, highest: float) -> Pulse:
    """The pulse (Pa at 1 m) of a snap at a depth (m), for waves up to `highest` (Hz); time 0 is the collapse.

    Its `peak` is what a source level is of: the largest pressure before any filter, or behind that of `level_below`.

    Raises ValueError in one line where the model has none: a bubble that does not collapse or collapses too fast for
    its equation, a file that cannot be read.
    """
    match model:
        case LogarithmicBubble():
            return waveforms.logarithmic(Bubble(model.a, model.k, model.m, model.q, model.density), highest)
        case KellerMiksis():
            return _keller_miksis(model, depth, highest)
        case RecordedSnap():
            recording = read_recording(model)
            return waveforms.recorded(recording.pressure, recording.sampling_frequency, recording.zero, highest)
        case Ricker():
            return waveforms.ricker(model.frequency, model.peak, highest)
        case Gabor():
            return waveforms.gabor(model.frequency, model.cycles, model.peak, highest)


def _keller_miksis(model: KellerMiksis, depth: float, highest: float) -> Pulse:
    found = collapse(model, depth)
    made = bubble_pulse.pulse(found, highest, model.fade)
    if model.level_below is None:
        return made
    return replace(made, peak=bubble_pulse.peak_below(found, model.level_below, model.fade))


def cavity(model: KellerMiksis, depth: float) -> Cavity:
    """The bubble of a described snap at its own depth, or else at this one (m), as the equations take it."""
    where = depth if model.depth is None else model.depth
    ambient = bubble_collapse.ambient_pressure(where, model.density, surface=model.surface_pressure)
    core = (
        bubble_collapse.hard_core(model.radius, model.gas_pressure, ambient, model.core_ratio)
        if model.core_ratio
        else 0.0
    )
    return Cavity(
        radius=model.radius,
        gas_pressure=model.gas_pressure,
        ambient_pressure=ambient,
        vapour_pressure=model.vapour_pressure,
        surface_tension=model.surface_tension,
        viscosity=model.viscosity,
        density=model.density,
        sound_speed=model.sound_speed,
        exponent=model.exponent,
        core=core,
    )


def collapse(model: KellerMiksis, depth: float) -> Collapse:
    """The solved bubble of a described snap. Raises ValueError where it does not collapse, or faster than
    `largest_mach`."""
    found = bubble_collapse.collapse(cavity(model, depth), model.rebounds)
    if found.flag in {bubble_collapse.SETTLED, bubble_collapse.SINGULAR}:
        raise ValueError(f"the bubble has no snap: {found.reason}")
    if found.mach > model.largest_mach:
        raise ValueError(
            f"the wall reaches {found.mach:.3g} times the speed of sound, over largest_mach {model.largest_mach:.3g}: "
            "first-order theory does not hold; more gas_pressure slows it"
        )
    return found


def scales(variation: SnapVariation, generator: np.random.Generator, snaps: int) -> Scales:
    """Gain and width of snaps, from two numbers of the stream each, whatever the variation: one that is 0 changes no
    other."""
    from scipy.special import ndtr, ndtri

    edge = float(ndtr(-CUT))
    normal = ndtri(edge + (1.0 - 2.0 * edge) * generator.random((snaps, 2)))
    return Scales(10.0 ** (variation.level * normal[:, 0] / 20.0), np.exp(variation.width * normal[:, 1]))


def largest_scales(variation: SnapVariation) -> tuple[float, float]:
    """Bounds on the gain and the width, for laying out windows; the smallest are their inverses."""
    return float(10.0 ** (CUT * variation.level / 20.0)), float(np.exp(CUT * variation.width))
