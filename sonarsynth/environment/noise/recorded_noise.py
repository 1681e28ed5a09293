"""Noise of the spectrum of a recording, or the recording itself."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt
from pydantic import model_validator

from sonarsynth.conventions import Floats, Number, PositiveHertz, Seconds
from sonarsynth.description import description, named_files
from sonarsynth.description.file_formats import waveform_files
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField

SEGMENT, FEWEST = 4096, 4
"""Samples of a segment of the spectrum at most, and segments at least."""
SHORTEST, LONGEST = 256, 1 << 25
"""Samples of a recording at least, and those of its beginning that the spectrum is of, at most."""


@description
class RecordedNoise(NoiseField):
    """A recording of the sea (WAV or HDF5): Gaussian noise of its power spectral density, or its samples, played.

    The spectrum is by Welch's method, of 2^25 samples of the beginning at most. Samples are played again and again,
    2 ms at a time, each stretch a plane wave from one of the directions: in the middle of the array hydrophones hear
    the recording itself, farther off the same sound earlier or later, with the mean coherence of the directions. Its
    snaps come with it: beside a chorus, or snaps of the recipe, there are both. Beyond half its sampling frequency
    there is nothing.
    """

    kind: Literal["recording"] = "recording"
    path: str
    """Path of the file, relative to the recipe."""
    pascals: Annotated[Number, Gt(0)] = 1.0
    """Pressure (Pa) of the number 1 in the file; the full scale of a WAV of whole numbers is 1."""
    sampling_frequency: PositiveHertz | None = None
    """For an HDF5 without an attribute of that name."""
    dataset: str | None = None
    """Of an HDF5 ("/group/dataset"); left out: the only one that there is."""
    channel: Annotated[int, Ge(0)] = 0
    """Channel of the file, from 0."""
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`: one hydrophone does not tell where its sound came from."""
    play: Literal["spectrum", "samples"] = "spectrum"
    """What is kept of it; samples need `directions`."""
    start: Seconds = 0.0
    """Time of the recording that is played at time 0 of the motions."""

    @model_validator(mode="after")
    def _check(self) -> RecordedNoise:
        if self.play == "samples" and self.directions is None:
            raise ValueError("samples come from somewhere: give `directions`, such as {kind: isotropic}")
        return self

    @property
    def played(self) -> bool:
        """As `NoiseField.played`."""
        return self.play == "samples"

    def row(self) -> str:
        """As `Method.row`."""
        return "samples of a recording" if self.played else self.kind

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`: straight lines between the bins of the spectrum. Raises ValueError for a file that
        cannot be read, is silent or too short."""
        bins, density, _ = self._spectrum()
        return np.asarray(np.interp(frequency, bins, density, right=0.0))

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        frequency, _, used = self._spectrum()
        last = float(frequency[-1])
        lines = []
        if high > last:
            lines.append(f"the recording {self.path} is of 0 to {last:.6g} Hz, the band of {low:.6g} to {high:.6g} Hz")
        if used is not None:
            lines.append(f"of the recording {self.path} the spectrum of the first {used:.4g} s is used")
        return tuple(lines)

    def _spectrum(self) -> tuple[Floats, Floats, float | None]:
        with named_files.errors_as(ValueError, self.path):
            return _spectrum_of(self, named_files.stamp(self.path))


@lru_cache(maxsize=8)
def _spectrum_of(noise: RecordedNoise, changed: tuple[int, int]) -> tuple[Floats, Floats, float | None]:
    """Frequencies (bin,) in Hz, the power spectral density (bin,) there in Pa2/Hz, and of how much of the recording it
    is (s), where it is not of all. Raises FileError."""
    from scipy.signal import welch

    rate, values = waveform_files.waveform(
        named_files.read(noise.path, waveform_files.MOST_BYTES),
        noise.channel,
        sampling_frequency=noise.sampling_frequency,
        dataset=noise.dataset,
        long=True,
        longest=LONGEST + 1,
    )
    used = LONGEST / rate if values.size > LONGEST else None
    values = values[:LONGEST]
    if values.size < SHORTEST:
        raise named_files.FileError(f"has {values.size} samples; the spectrum of noise needs {SHORTEST}")
    size = min(SEGMENT, values.size // FEWEST)
    with np.errstate(over="ignore", invalid="ignore"):  # judged below
        frequency, density = welch(values * noise.pascals, rate, nperseg=size)
    if not 0.0 < float(density[1:].max()) < np.inf:
        raise named_files.FileError("is silent, or louder than numbers can say")
    return frequency, density, used
