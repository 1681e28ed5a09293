"""CLEAN: an image taken apart into point echoes, by what the array makes of one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Bools, Decibels, Floats, Number, PositiveMetres, direction
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.imaging.delay_and_sum.auto_beamformer import AutoBeamforming
from sonarsynth.imaging.delay_and_sum.focused import FocusedDelayAndSum
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar

MAIN_LOBE = 0.05
"""Share of its peak above which a point's image is its main lobe, as far as that hangs together: side lobes of a full
aperture are lower."""

DIRECTIONS = 35
"""In which a frame of the remus recipe, and one of the tank, has point echoes to 25 dB."""

Place = tuple[int, int]
"""Row (elevation) and column (azimuth) of a beam."""


@description
class Clean(Steering):
    """Deconvolution of the delay-and-sum image with the point-spread pattern of the array at the focus.

    Again and again `gain` of the brightest beam, times the image of a point echo there of the mean spectrum of the
    sensors, is taken away; it is put back without its side lobes and grating lobes, and what is left over is added.
    Energies add up for echoes whose delays differ by more than the inverse of the band; echoes at one delay interfere,
    which the image of a point knows nothing of, and leave some of their side lobes. The images of points are made as
    the image is, once a direction: an extended target takes as long as so many images.

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
    """Share of a peak that is taken away at once."""
    depth: Annotated[Decibels, Gt(0)] = 25.0
    """The work stops where nothing is left that is less than this under the brightest beam."""
    steps: Annotated[int, Ge(1), Le(100_000)] = 500
    """Times that something is taken away, at most."""

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
            wave = (amplitude * np.exp(-2j * np.pi * snapshots.frequency * delay[:, None])).astype(np.complex64)
            return plain.energies(replace(snapshots, spectra=wave), elements, sonar)

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
