"""CLEAN: an image as a sum of point echoes, each with the point-spread pattern of the array."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Bools, Decibels, Floats, Number, PositiveMetres, direction
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.kernels.fourier_sums import waves
from sonarsynth.imaging.delay_and_sum.auto_beamformer import AutoBeamforming
from sonarsynth.imaging.delay_and_sum.focused import FocusedDelayAndSum
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar

MAIN_LOBE = 0.05
"""The main lobe of a point's image is the connected part around its peak above this share of the peak; side lobes of a
full aperture are lower."""

DIRECTIONS = 35
"""Directions of point echoes within 25 dB in a frame of `remus.yaml`, and in one of `tank.yaml`."""

Place = tuple[int, int]
"""Row (elevation) and column (azimuth) of a beam."""


@description
class Clean(Steering):
    """Deconvolution of the delay-and-sum image with the point-spread pattern of the array at the focus.

    Each step subtracts, at the brightest beam, the share `gain` of it times the image of a point echo there with the
    mean spectrum of the sensors. At the end the main lobes of all these points are added to what is left. Energies add
    up for echoes whose delays differ by more than the inverse of the band; echoes at one delay interfere, which the
    image of one point does not hold, and some of their side lobes stay. The image of a point is computed once for each
    direction, and each takes as long as an image.

    Echoes are picked from beams of delay and sum.
    Source: Hogbom (1974), Astron. Astrophys. Suppl. 15, 417; in acoustics, CLEAN-PSF in Sijtsma (2007), Int. J.
    Aeroacoustics 6, 357.
    """

    kind: Literal["clean"] = "clean"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    gain: Annotated[Number, Gt(0), Le(1)] = 0.3
    """Share of a peak that a step takes away."""
    depth: Annotated[Decibels, Gt(0)] = 25.0
    """It stops when all that is left is this far below the brightest beam of the first image."""
    steps: Annotated[int, Ge(1), Le(100_000)] = 500
    """Steps at most."""

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: an image for each direction that something is taken from."""
        return DIRECTIONS * FocusedDelayAndSum(subarrays=(2, 2)).cost(size)

    def row(self) -> str:
        """Its kind, and how far down it goes."""
        return f"{self.kind}, to {self.depth:g} dB"

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`."""
        plain = AutoBeamforming(focus=self.focus, shading=self.shading).chosen(elements, sonar)
        power = snapshots.power(weights(elements, self.shading))
        amplitude = np.sqrt(power / power.sum()) if power.any() else power

        def point(beam: Place) -> Floats:
            u = direction(sonar.beams.azimuth[beam[1]], sonar.beams.elevation[beam[0]])
            delay = focus_delay(elements.position, u, self.focus, sonar.assumed_sound_speed)
            wave = (amplitude * waves(snapshots.frequency, delay)).astype(np.complex64)
            return plain.energies(snapshots.having(wave), elements, sonar)

        dirty = plain.energies(snapshots, elements, sonar)
        return cleaned(dirty, point, self.gain, self.depth, self.steps)


def cleaned(dirty: Floats, point: Callable[[Place], Floats], gain: float, depth: float, steps: int) -> Floats:
    """The image (elevation, azimuth) of an energy image of point echoes without their side lobes, not below zero.

    `point(beam)` is the image of an echo of energy one in that beam; gain, depth (dB) and steps as for `Clean`.
    """
    residual, components = dirty.copy(), dict[Place, float]()
    images = dict[Place, Floats]()
    least = dirty.max() * 10.0 ** (-depth / 10.0)
    for _ in range(steps):
        row, column = np.unravel_index(np.argmax(residual), residual.shape)
        beam = int(row), int(column)
        if not residual[beam] > least:  # silence, and what is no number, too
            break
        if beam not in images:
            images[beam] = point(beam)
        share = gain * residual[beam] / images[beam][beam]
        residual -= share * images[beam]
        components[beam] = components.get(beam, 0.0) + share
    for beam, energy in components.items():
        residual += energy * np.where(main_lobe(images[beam], beam), images[beam], 0.0)
    return np.maximum(residual, 0.0)


def main_lobe(image: Floats, beam: Place) -> Bools:
    """The beams around `beam` in which the image (elevation, azimuth) of a point there stays above `MAIN_LOBE`."""
    from scipy.ndimage import label

    lobes, _ = label(image >= MAIN_LOBE * image[beam])
    return np.asarray(lobes == lobes[beam])
