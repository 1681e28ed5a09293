"""What reverberation is heard against: the pulses that make it, and the noise that it drowns in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.planning.measured.sampled_arrivals import receiver_of
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals.filtered_pulse import snap_gains
from sonarsynth.signals.isolated_paths import energy_in_slices
from sonarsynth.signals.pulse_sums.reverberation_synthesis import spare_times
from sonarsynth.state import Emission
from sonarsynth.tracing.reverberation.reverberation_arrivals import (
    Listening,
    ReverberationArrivals,
    reverberation_arrivals,
)

if TYPE_CHECKING:
    from sonarsynth.planning.plans import Plan


def sent_energy(snaps: tuple[Emission, ...], scene: Scene) -> Floats:
    """Energy (snap,) in Pa2 s of each pulse in the band at 1 m."""
    slices = [float(energy_in_slices(snap.waveform, scene.sonar, 1).sum()) for snap in snaps]
    return np.asarray(2.0 * snap_gains(snaps) ** 2 * np.array(slices).reshape(len(snaps)))


def noise_power(scene: Scene) -> float:
    """Power (Pa2) of ambient noise and electronics at a hydrophone in the band, by their density at its centre."""
    band, centre = scene.sonar.band, np.array([scene.sonar.band.centre])
    density = sum(float(noise.density(centre)[0]) for noise in scene.world.environment.noises)
    if scene.sonar.electronics is not None:
        density += REFERENCE_PRESSURE**2 * 10.0 ** (scene.sonar.electronics.level / 10.0)
    return density * (band.high - band.low)


def frame_scatterers(plan: Plan, frame: Frame, start: float) -> ReverberationArrivals:
    """The reverberation of a frame whose record begins at `start` (s); `plan` is that of its sequence. Raises
    ValueError where a boundary has no strength, or scatterers are too many."""
    scene, snaps = plan.scene, frame.moment.snaps
    described = scene.world.reverberation
    assert described is not None
    receiver, sonar = receiver_of(plan, frame), scene.sonar
    before, after = spare_times(plan.elements, sonar, receiver.speed(plan.medium), snaps)
    listening = Listening(
        start - before,
        start + plan.windows.samples / sonar.sampling_frequency + after,
        sonar.band.high - sonar.band.low,
        plan.recipe.accuracy.speckle,
        sent_energy(snaps, scene),
        noise_power(scene) / plan.elements.count,
    )
    return reverberation_arrivals(described, snaps, plan.medium, receiver, listening, frame.seed, frame.key)
