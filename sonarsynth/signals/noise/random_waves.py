"""Noise of given directions in any array: each bin is a sum of plane waves whose directions are drawn for that bin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.environment.noise.directions import NoiseDirections
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.noise.wave_directions import drawn
from sonarsynth.geometry import Pose
from sonarsynth.receiver import Elements

FEWEST, MOST = 256, 1024
"""Fewest and most plane waves in a bin: eight for each hydrophone, so that each beam holds several."""
TOGETHER = 1 << 18
"""Phases of waves at hydrophones that are computed at once."""
SECONDS = 15e-9
"""Of one core for the phase of one wave at one hydrophone."""


def waves(sensors: int) -> int:
    """How many plane waves there are in a bin."""
    return int(np.clip(8 * sensors, FEWEST, MOST))


def beam_scatter(sensors: int) -> float:
    """Standard deviation of the energy of a beam in one bin over that of Gaussian noise, where a beam hears one wave in
    as many as there are sensors: sqrt(1 + sensors/waves). Of 64, 256 and 1024 sensors half a wavelength apart it is
    1.06, 1.12 and 1.40; of the energy in many bins as much, for each has waves of its own."""
    return float(np.sqrt(1.0 + sensors / waves(sensors)))


def draw(
    directions: NoiseDirections,
    elements: Elements,
    pose: Pose,
    behind: float,
    frequency: Floats,
    sound_speed: float,
    random: np.random.Generator,
) -> npt.NDArray[np.complex64]:
    """Spectra (sensor, bin) at frequencies (bin,) Hz, as `lattice_noise.draw` gives them; behind: what is left of
    the pressure of waves from behind.

    Waves come as often from each direction as the intensity is, all equally loud: on average over bins and frames the
    cross spectral density is exact, and each point hydrophone's spectrum is Gaussian.
    """
    wave_number = 2.0 * np.pi * frequency / sound_speed
    if directions.toward is not None:
        toward = pose.turn_to_body(directions.toward)
        sent = random.standard_normal((2, frequency.size))
        face = element_directivity(frequency, toward, elements.face, sound_speed) * (behind if toward[0] < 0.0 else 1.0)
        turns = np.outer(elements.position @ toward, wave_number).astype(np.float32)
        return np.asarray(np.exp(1j * turns) * ((sent[0] + 1j * sent[1]) * face), np.complex64)
    out = np.empty((elements.count, frequency.size), np.complex64)
    count = waves(elements.count)
    many = max(TOGETHER // (count * elements.count), 1)
    for first in range(0, frequency.size, many):
        bins = slice(first, first + many)
        draws = [(random.random((count, 2)), random.standard_normal((count, 2))) for _ in frequency[bins]]
        even, normal = (np.stack(column) for column in zip(*draws, strict=True))
        toward = pose.turn_to_body(drawn(directions.intensity, directions.edges, even))  # (bin, wave, xyz)
        amplitude = (normal[..., 0] + 1j * normal[..., 1]) / np.sqrt(count)
        amplitude *= element_directivity(frequency[bins, None], toward, elements.face, sound_speed)
        amplitude *= np.where(toward[..., 0] < 0.0, behind, 1.0)
        along = np.swapaxes(toward @ elements.position.T, 1, 2)  # (bin, sensor, wave)
        turns = (wave_number[bins, None, None] * along).astype(np.float32)
        phasors = np.empty(turns.shape, np.complex64)
        phasors.real, phasors.imag = np.cos(turns), np.sin(turns)  # the exponential takes ten times as long
        out[:, bins] = (phasors @ amplitude.astype(np.complex64)[..., None])[..., 0].T
    return out
