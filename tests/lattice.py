"""Images of a lattice, and the delays that its zones state."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging.delay_and_sum.lattice_image import lattice_image, steered_zones
from sonarsynth.imaging.delay_and_sum.zones import lens, quadrant, zones_of
from tests.dense import dense_energies


def lattice_energies(spectra, array, weight, frequencies, beams, speed, focus, cut=(1, 1)):
    """Sum over bins of |B|^2 (elevation, azimuth) of spectra (sensor, bin)."""
    zones = steered_zones(array, beams, focus, speed, cut)
    return lattice_image(spectra, array, weight, frequencies, beams, zones)


def stated_delays(array, beams, speed, focus, cut=(1, 1)):
    """Where in the picture each beam of the quadrant (row, column) is, and the delays (row, column, sensor) that it
    takes there by the zones' own account; then the same of its three mirror images."""
    glass, u = lens(array, focus, speed, cut), quadrant(beams)
    for up in (-1, 1):
        for port in (-1, 1):
            i = (beams.elevations - (up < 0)) // 2 + up * np.arange(len(u))
            j = (beams.azimuths - (port < 0)) // 2 + port * np.arange(u.shape[1])
            towards = direction(beams.azimuth[j], beams.elevation[i][:, None]).reshape(-1, 3)
            delay = focus_delay(array.position, towards, None, speed).reshape(len(i), len(j), -1)
            y, z = port * array.position[:, 1], up * array.position[:, 2]
            for zone in zones_of(beams):
                for column in range(zone.columns.start, zone.columns.stop):
                    for row in range(len(u)):
                        delay[row, column] += _stated(glass, zone.centre, y, z, u[row, column])
            yield np.ix_(i, j), delay


def stated_energies(spectra, array, weight, frequencies, beams, speed, focus, cut=(1, 1)):
    """As `lattice_energies`, in float64: where beams are their own mirror images, the mean of these."""
    energy, count = np.zeros((2, beams.elevations, beams.azimuths))
    for where, delay in stated_delays(array, beams, speed, focus, cut):
        exact = dense_energies(spectra, delay.reshape(-1, array.count), weight, frequencies)
        energy[where] += exact.reshape(delay.shape[:2])
        count[where] += 1
    return energy / count


def _stated(glass, centre, y, z, u):
    """What a zone adds (sensor,) to the delays of a plane wave at y, z (sensor,) m, for a beam of its quadrant."""
    middle_y, middle_z = glass.middle(y, z)
    middle = glass.bulge(middle_y, middle_z, u) - glass.bulge(middle_y, middle_z, centre)
    rise = (z - middle_z) * glass.slope_along_z(y, middle_z, np.array([centre[0], u[1]]))
    across = (y - middle_y) * glass.slope_along_y(middle_y, middle_z, u, centre)
    return glass.even_bulge(y, middle_z, z - middle_z, centre) + middle + rise + across
