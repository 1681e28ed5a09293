"""What the converter makes of what a sonar hears: snaps beyond its full scale, noise and echoes of too few counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, depth, evenly
from sonarsynth.environment.noise import NoiseField
from sonarsynth.planning.measured.sampled_arrivals import behind_baffle, context_of, reception_of
from sonarsynth.planning.measured.sampled_frames import SampledScene
from sonarsynth.planning.plans import Plan
from sonarsynth.receiver.sensor_errors import drawn_errors
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals import channel_errors
from sonarsynth.signals.auto_synthesis import DEFAULT_ERROR, deposit_for
from sonarsynth.signals.electronics import ElectronicNoise
from sonarsynth.tracing.arrivals import trace

HEARD: Final = 8
"""Frames whose snaps are heard, at most, to see whether they clip."""
ECHOES_HEARD: Final = 3
"""Frames whose echoes are heard, at most, to see how many counts they have."""
DITHER: Final = 0.5
"""Root mean square of noise, in counts, from which on a converter adds noise and nothing else."""
NOISE_PEAK: Final = 4.0
"""Over its rms, what one sample of Gaussian noise in 16 000 exceeds: a frame has more samples than that."""
FEW_COUNTS: Final = 8.0
"""Peaks of echoes without such noise, in counts, under which a plan says so: at 7 the image of frame 32 of remus.yaml
is 0.12 dB rms off within 20 dB of its brightest beam, at 1.8 it is 0.8 dB off."""


def converter_notes(plan: Plan, looks: Sequence[SampledScene]) -> list[str]:
    """What of the sound of a recipe does not fit the counts of its converter."""
    if plan.scene.sonar.converter is None:
        return []
    frames = [frame for look in looks if look.real for frame in look.frames if frame.moment.snaps]
    return _levels(plan, frames) + _noise(plan.scene) + _coarse_echoes(plan, frames)


def _levels(plan: Plan, frames: Sequence[Frame]) -> list[str]:
    """In how many frames the direct pulses of snaps exceed full scale, and by how much at most; or are under half a
    count."""
    converter = plan.scene.sonar.converter
    assert converter is not None
    heard = [frames[n] for n in evenly(len(frames), HEARD)] if frames else []
    peaks = np.array([peak(plan, frame, False) for frame in heard])
    faint, over = peaks < 0.5 * converter.quantum, 20.0 * np.log10(np.maximum(peaks, 1e-300) / converter.full_scale)
    if faint.any() and not _dithered(plan.scene):
        return [
            f"snaps are under half a count of the converter in {np.count_nonzero(faint)} of {len(heard)} frames that "
            "were heard, without noise that carries them over it: nothing is recorded (scene.sonar.converter)"
        ]
    if not np.any(over > 0.0):
        return []
    return [
        f"snaps clip in {np.count_nonzero(over > 0.0)} of {len(heard)} frames that were heard, by up to "
        f"{over.max():.1f} dB: signals and levels are then too low (scene.sonar.converter.full_scale)"
    ]


def noise_counts(scene: Scene) -> float:
    """Noise of a scene with a converter in its band, counts rms; of what is the same at all times."""
    sonar, noises = scene.sonar, list[NoiseField](scene.world.environment.noises)
    noises += [ElectronicNoise(sonar.electronics)] if sonar.electronics is not None else []
    assert sonar.converter is not None
    if not noises:
        return 0.0
    f = np.linspace(sonar.band.low, sonar.band.high, 256)
    return float(np.sqrt(np.trapezoid(sum(noise.density(f) for noise in noises), f))) / sonar.converter.quantum


def _dithered(scene: Scene) -> bool:
    """Whether other sound carries snaps and echoes over the steps of the converter."""
    world = scene.world
    other = world.chorus is not None or world.noise_sources or world.reverberation is not None
    return bool(other) or noise_counts(scene) >= DITHER


def _noise(scene: Scene) -> list[str]:
    """Whether noise exceeds full scale, or counts are too coarse for it: with less than half a count, rounding is no
    noise of its own and takes most of it (Widrow & Kollar 2008, Quantization Noise)."""
    converter, counts = scene.sonar.converter, noise_counts(scene)
    assert converter is not None
    if counts * converter.quantum > converter.full_scale / NOISE_PEAK:
        rms, full = (
            20.0 * np.log10(p / REFERENCE_PRESSURE) for p in (counts * converter.quantum, converter.full_scale)
        )
        return [
            f"noise of {rms:.0f} dB re 1 uPa in the band exceeds the full scale of the converter, {full:.0f} dB, in "
            f"its peaks ({NOISE_PEAK:g} times its rms): it clips in every frame (scene.sonar.converter.full_scale)"
        ]
    if not 0.0 < counts < DITHER or scene.world.chorus is not None:
        return []
    levels = (20.0 * np.log10(p * converter.quantum / REFERENCE_PRESSURE) for p in (counts, 1.0))
    return [
        "noise of {:.0f} dB re 1 uPa in the band is under half a count of the converter, {:.0f} dB: it is mostly "
        "rounded to nothing, and faint echoes with it (scene.sonar.converter)".format(*levels)
    ]


def _coarse_echoes(plan: Plan, frames: Sequence[Frame]) -> list[str]:
    """In how many frames echoes have few counts or none, where no other sound carries them over the steps."""
    converter = plan.scene.sonar.converter
    assert converter is not None
    if _dithered(plan.scene):
        return []
    echoing = [frame for frame in frames if frame.moment.bodies]
    heard = [echoing[n] for n in evenly(len(echoing), ECHOES_HEARD)] if echoing else []
    counts = np.array([peak(plan, frame, True) for frame in heard]) / converter.quantum
    counts = counts[counts > 0.0]
    few, quantum = counts[counts < FEW_COUNTS], f"{converter.quantum:.2g} Pa"
    if not few.size:
        return []
    lost = few < 0.5
    what = f"echoes peak at {few.min():.2g} to {few.max():.2g} counts of the converter ({quantum} each)"
    where = f"in {few.size} of {counts.size} frames that were heard, without noise that carries them over its steps"
    then = "nothing of them is recorded" if lost.all() else "images and points of them err by its rounding"
    then += "" if lost.all() or not lost.any() else f", and {np.count_nonzero(lost)} record nothing of them"
    return [f"{what} {where}: {then} (scene.sonar.converter)"]


def peak(plan: Plan, frame: Frame, echoes: bool) -> float:
    """Largest pressure (Pa) of the echoes of a frame at any hydrophone, or of its direct pulses without any; without
    noise and chorus. `plan` is of any sequence."""
    plan = plan.at(frame.index)
    sonar, context = plan.scene.sonar, context_of(plan, frame)
    arrivals = trace(context if echoes else replace(context, bodies=(), laws=()), plan.propagation)
    heard = behind_baffle(arrivals.select(~arrivals.direct) if echoes else arrivals, sonar)
    signals = deposit_for(DEFAULT_ERROR).signals(heard, frame.moment.snaps, reception_of(plan, frame))
    if sonar.sensor_errors is not None:
        drawn = drawn_errors(sonar.sensor_errors, plan.elements.count, frame.seed, frame.key)
        speed = float(plan.profile.at(depth(frame.sonar_pose.position)))
        signals = channel_errors.respond(signals, drawn, speed)
    return float(np.abs(signals.pressure).max(initial=0.0))
