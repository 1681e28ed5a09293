"""What a focused lattice gets wrong, measured on waves from the focus, and into how many subarrays it is cut."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.arrays.beams import beam_spectra
from sonarsynth.equations.kernels.fourier_sums import waves
from sonarsynth.imaging.delay_and_sum.lattice_image import lattice_image, steered_zones
from sonarsynth.imaging.delay_and_sum.zones import Subarrays, cuts
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.receiver import Elements, Sonar

ALLOWED = 0.1
"""dB that the image of a source may err by where nobody says into how many subarrays to cut."""

BINS = 64
"""Frequencies of the band that waves have."""

WITHIN, COMPARED = 20.0, 250
"""dB under the brightest beam, down to which beams are compared; and how many are, at most."""


def focus_error(elements: Elements, shading: Shading, sonar: Sonar, focus: float | None, subarrays: Subarrays) -> float:
    """Largest error (dB) of the images of sources at the focus (m), over beams within 20 dB of their peak.

    Sources, one at a time, with a flat spectrum over the band: in the quadrant above and to port, at the corner of the
    picture, in the middles of its edges and half-way there. subarrays as for `FocusedDelayAndSum`.
    """
    weight, beams, speed = weights(elements, shading), sonar.beams, sonar.assumed_sound_speed
    zones = steered_zones(elements, beams, focus, speed, subarrays)
    frequency = np.linspace(sonar.band.low, sonar.band.high, BINS)
    u = direction(beams.azimuth, beams.elevation[:, None])
    rows, columns = (n // 2 + np.array([0, (n - n // 2) // 2, n - 1 - n // 2]) for n in u.shape[:2])

    def error(source: Floats) -> float:
        late = focus_delay(elements.position, source, focus, speed)
        wave = waves(frequency, late).astype(np.complex64)
        image = lattice_image(wave, elements, weight, frequency, beams, zones)
        bright = np.nonzero(image >= image.max() * 10.0 ** (-WITHIN / 10.0))
        row, column = (index[:: -(-len(index) // COMPARED)] for index in bright)
        exact = beam_spectra(wave, frequency, elements.position, weight, u[row, column], speed, focus)
        return float(np.max(np.abs(10.0 * np.log10(image[row, column] / np.sum(np.abs(exact) ** 2, axis=1)))))

    return max(error(source) for source in u[np.ix_(rows, columns)].reshape(-1, 3))


@lru_cache(maxsize=64)
def subarrays_for(elements: Elements, shading: Shading, sonar: Sonar, focus: float | None) -> Subarrays | None:
    """The fewest subarrays whose `focus_error` is allowed, None if all are too few; kept from frame to frame."""
    ways = cuts(elements, focus)
    return next((cut for cut in ways if focus_error(elements, shading, sonar, focus, cut) <= ALLOWED), None)
