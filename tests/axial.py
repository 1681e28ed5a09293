"""The image of a lattice with the focusing delays of its axis."""

from __future__ import annotations

from sonarsynth.imaging.delay_and_sum.lattice_image import lattice_image, steered_zones
from sonarsynth.receiver import Band

BAND = Band(low=25e3, high=85e3)


def axial_energies(spectra, array, weight, frequencies, beams, speed, focus):
    """Sum over bins of |B|^2 (elevation, azimuth) of spectra (sensor, bin)."""
    zones = steered_zones(array, "uniform", beams, focus, speed, BAND, "axis")
    return lattice_image(spectra, array, weight, frequencies, beams, zones)
