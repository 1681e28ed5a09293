"""What every beamformer can do: steer beams in any direction, from which images and range profiles are made."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Method
from sonarsynth.equations.arrays.beams import beam_spectra, first_and_spacing, lattice_beam_spectra
from sonarsynth.equations.arrays.gates import gate_samples
from sonarsynth.imaging.image_window import Shading, weights, window_spectra
from sonarsynth.products import BeamSpectra, Signals
from sonarsynth.receiver import Elements, Sonar


class Steering(Method):
    """A beamformer, as far as it is not its own: delay and sum with its `focus` and `shading`."""

    separable: ClassVar[bool] = True
    """Whether beams of a lattice are made by rows and columns, focused in every direction as on the axis."""
    focus: float | None = None
    """Range (m) at which the array is focused; none: plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture."""

    def beams(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> BeamSpectra:
        """Beams of the window from start to stop (s), made when they are asked for. Raises ValueError as `image`."""
        frequency, spectra, _ = window_spectra(signals, sonar, start, stop)
        rate = signals.sampling_frequency
        first, count = gate_samples(start, stop, signals.start, rate, signals.pressure.shape[1])

        def steered(direction: Floats) -> npt.NDArray[np.complex64]:
            return self.steer(spectra, frequency, direction, elements, sonar)

        _, spacing = first_and_spacing(frequency)
        return BeamSpectra(frequency, spacing, signals.start + first / rate, count, rate, steered)

    def steer(
        self,
        spectra: npt.NDArray[np.complex64],
        frequency: Floats,
        direction: Floats,
        elements: Elements,
        sonar: Sonar,
    ) -> npt.NDArray[np.complex64]:
        """Spectra (beam, bin) in `direction` (beam, xyz) of those of the sensors (sensor, bin) at evenly spaced
        frequencies (bin,) Hz."""
        focus, c = self.focus, sonar.assumed_sound_speed
        gain = weights(elements, self.shading)
        if not (elements.on_lattice and self.separable):
            return beam_spectra(spectra, frequency, elements.position, gain, direction, c, focus)
        return lattice_beam_spectra(
            spectra,
            frequency,
            elements.column,
            elements.row,
            (elements.columns, elements.rows),
            pitch=elements.pitch,
            gain=gain,
            directions=direction,
            sound_speed=c,
            focus=focus,
        )
