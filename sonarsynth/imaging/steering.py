"""The base of all beamformers: beams steered in any direction, of which images and range profiles are made."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, direction
from sonarsynth.description.method import FrameSize, Method, returned
from sonarsynth.equations.arrays.beams import beam_spectra
from sonarsynth.imaging.delay_and_sum.lattice_beams import LatticeBeams
from sonarsynth.imaging.image_window import Shading, energy_image, snapshots_of, weights
from sonarsynth.products import BeamSpectra, EnergyImage, Signals, Snapshots
from sonarsynth.receiver import Elements, Sonar

BEAMS_AT_ONCE = 512


class Steering(Method):
    """Delay and sum with `focus` and `shading`: a method that is added overrides `steer` or `energies`."""

    separable: ClassVar[bool] = True
    """Whether beams of a lattice are made by rows and columns, focused in every direction as on the axis."""
    focus: float | None = None
    """Range (m) at which the array is focused; none: plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture."""

    def __init_subclass__(cls) -> None:
        """Raises TypeError for a method that would be delay and sum under another name."""
        own = {name for of in cls.__mro__[: cls.__mro__.index(Steering)] for name in vars(of)}
        if own.isdisjoint({"energies", "steer", "separable"}):
            raise TypeError(f"{cls.__name__} has neither energies nor steer")

    def beams(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> BeamSpectra:
        """Beams of a window of the signals, computed when their energies or spectra are asked for."""
        steered, image = self.steered(snapshots, elements, sonar), partial(self._image, snapshots, elements, sonar)
        if type(self).steered is not Steering.steered:
            return BeamSpectra(snapshots, image, partial(self._checked_spectra, steered, len(snapshots.frequency)))
        return BeamSpectra(snapshots, image, steered, partial(self.beams, elements=elements, sonar=sonar))

    def _checked_spectra(
        self, steered: Callable[[Floats], npt.NDArray[np.complex64]], bins: int, direction: Floats
    ) -> npt.NDArray[np.complex64]:
        """What the function that `steered` returns makes of directions (beam, xyz), once it has the shape of beams."""
        beams: npt.NDArray[np.complex64] = returned(self, "steered", steered(direction), (len(direction), bins))
        return beams

    def _image(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """The energies, once they have the shape of an image."""
        shape, energy = (sonar.beams.elevations, sonar.beams.azimuths), self.energies(snapshots, elements, sonar)
        return np.asarray(returned(self, "energies", energy, shape))

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """Energy (elevation, azimuth) in Pa2 s of the beams of the sonar's grid: sum over bins of |B|^2.

        Raises ValueError when no element is live, or when the method cannot take the array.
        """
        grid = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None])
        return self.energies_in(snapshots, elements, sonar, grid.reshape(-1, 3)).reshape(grid.shape[:2])

    def energies_in(self, snapshots: Snapshots, elements: Elements, sonar: Sonar, direction: Floats) -> Floats:
        """Energy (beam,) in Pa2 s of beams in `direction` (beam, xyz). Raises ValueError as `energies`."""
        energy = np.empty(len(direction))
        for low in range(0, len(direction), BEAMS_AT_ONCE):
            block = slice(low, low + BEAMS_AT_ONCE)
            beams = self.steer(snapshots, elements, sonar, direction[block])
            returned(self, "steer", beams, (len(direction[block]), len(snapshots.frequency)), unknown=True)
            energy[block] = np.sum(np.abs(beams).astype(float) ** 2, axis=1)
        return np.asarray(snapshots.unit * energy)

    def steered(
        self, snapshots: Snapshots, elements: Elements, sonar: Sonar
    ) -> Callable[[Floats], npt.NDArray[np.complex64]]:
        """A function from directions (beam, xyz), sonar frame, to the spectra (beam, bin) in Pa of beams there."""
        frequency, focus, c = snapshots.frequency, self.focus, sonar.assumed_sound_speed
        gain = weights(elements, self.shading)
        if elements.on_lattice and self.separable:
            return LatticeBeams(partial(getattr, snapshots, "spectra"), frequency, elements, gain, c, focus)
        return partial(beam_spectra, snapshots.spectra, frequency, elements.position, gain, sound_speed=c, focus=focus)

    def steer(
        self, snapshots: Snapshots, elements: Elements, sonar: Sonar, direction: Floats
    ) -> npt.NDArray[np.complex64]:
        """Spectra (beam, bin) in Pa of beams in `direction` (beam, xyz), sonar frame."""
        return self.steered(snapshots, elements, sonar)(direction)

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of one image: every beam steered by itself."""
        sums = 2e-9 * size.sensors**0.5 if size.on_lattice and self.separable else 6.5e-10 * size.sensors
        return sums * size.beams * size.bins

    def image(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> EnergyImage:
        """Image of the window from start to stop (s, clock of the signals) on the sonar's beam grid.

        Raises ValueError as `snapshots_of` and `energies`.
        """
        energy = self.energies(snapshots_of(signals, sonar, start, stop), elements, sonar)
        return energy_image(energy, sonar, start, stop)
