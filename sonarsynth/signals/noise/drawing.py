"""Which way noise of given directions is drawn: on a lattice by FFT, elsewhere as plane waves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.environment.noise.directions import NoiseDirections
from sonarsynth.geometry import Pose
from sonarsynth.receiver import Elements, Sonar, stop_frequency
from sonarsynth.signals.noise import lattice_noise, random_waves
from sonarsynth.signals.noise.lattice_noise import TORUS, PeriodicField, lattice_of, periodic_field

WAVE_SECONDS = 12e-9
"""Of one core to draw one wave of the periodic field in one bin."""
LOWEST = 0.02
"""Of the highest frequency: below, the lattice is one point."""
SMALL = 64
"""Hydrophones of a lattice for which plane waves cost less."""


def field_on_lattice(
    directions: NoiseDirections, elements: Elements, pose: Pose, sonar: Sonar, sound_speed: float
) -> PeriodicField | None:
    """The periodic field that is drawn, over all that passes the filter of the sonar; None where plane waves are."""
    if directions.toward is not None or not elements.on_lattice or elements.count < SMALL:
        return None
    passed = sonar.antialias
    low, high = passed.edges[0] - 0.5 * passed.transition, stop_frequency(passed)
    up = pose.turn_to_body([0.0, 0.0, 1.0])
    lattice = lattice_of(elements, up, sound_speed, sonar.behind)
    return periodic_field(directions, lattice, max(low, LOWEST * high), high)


def draw(
    directions: NoiseDirections,
    elements: Elements,
    pose: Pose,
    sonar: Sonar,
    frequency: Floats,
    sound_speed: float,
    random: np.random.Generator,
) -> npt.NDArray[np.complex64]:
    """Spectra (sensor, bin) at frequencies (bin,) Hz: of noise of 1 Pa2/Hz at a point, the mean power of the real part,
    and of the imaginary part, is what a face hears of it: 1 at most."""
    field = field_on_lattice(directions, elements, pose, sonar, sound_speed)
    if field is None:
        return random_waves.draw(directions, elements, pose, sonar.behind, frequency, sound_speed, random)
    return lattice_noise.draw(field, elements, frequency, random)


def coherence_error(
    directions: NoiseDirections, elements: Elements, pose: Pose, sonar: Sonar, sound_speed: float
) -> tuple[float, str]:
    """What the coherence of what is drawn errs by, at most, and how it is drawn in a few words.

    Plane waves are right on average: their error is the scatter of one bin.
    """
    if directions.toward is not None:
        return 0.0, "one plane wave"
    field = field_on_lattice(directions, elements, pose, sonar, sound_speed)
    if field is None:
        count = random_waves.waves(elements.count)
        scatter = f"beams scatter {random_waves.beam_scatter(elements.count):.2f} times as in Gaussian noise"
        return float(1.0 / np.sqrt(count)), f"{count} plane waves in each bin, {scatter}"
    return field.error, f"periodic field of {field.powers.shape[1]} x {field.powers.shape[2]} waves"


def seconds(directions: NoiseDirections, elements: Elements, samples: int) -> float:
    """Seconds that a frame takes on one core of the machine that costs are measured on."""
    bins = samples // 2
    if directions.toward is not None:
        return bins * elements.count * random_waves.SECONDS
    if elements.on_lattice and elements.count >= SMALL:
        return bins * 4.0 * elements.columns * elements.rows * TORUS[1] ** 2 * WAVE_SECONDS
    return bins * elements.count * random_waves.waves(elements.count) * random_waves.SECONDS
