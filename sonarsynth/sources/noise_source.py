"""Things that sound all the time from one place, at rest or moving: ships, whales, dolphins, an earthquake. They are
heard, but light nothing."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, MinLen
from pydantic import model_validator

from sonarsynth.conventions import Floats, Number, PositiveHertz, PositiveMetres, Seconds
from sonarsynth.description import BY_KIND, description, named_files
from sonarsynth.description.file_formats import waveform_files
from sonarsynth.environment.noise import Noise
from sonarsynth.equations.noise.filters import TAPS, windowed_sinc
from sonarsynth.geometry.motion import Motion
from sonarsynth.sources.pulse_model import Stamp
from sonarsynth.sources.recordings import RecordingError


@description
class NoiseRecording:
    """What a WAV or HDF5 file holds, again and again, brought to 1 m."""

    kind: Literal["noise_recording"] = "noise_recording"
    path: str
    """Path of the file, relative to the recipe."""
    distance: PositiveMetres = 1.0
    """From the source to the hydrophone that recorded it: the pressure is brought to 1 m as 1/r."""
    pascals: Annotated[Number, Gt(0)] = 1.0
    """Pressure (Pa) of the number 1 in the file; the full scale of a WAV of whole numbers is 1."""
    sampling_frequency: PositiveHertz | None = None
    """For an HDF5 without an attribute of that name."""
    dataset: str | None = None
    """Of an HDF5 ("/group/dataset"); left out: the only one that there is."""
    channel: Annotated[int, Ge(0)] = 0
    """Channel of the file, from 0."""
    start: Seconds = 0.0
    """Time of the recording that is played at time 0 of the motions."""

    def segment(self, time: float, step: float, samples: int) -> Floats:
        """Pressure (sample,) in Pa at 1 m at a time (s) and every `step` (s) after it, as the source plays it: a
        windowed sinc, without what is above half the rate of the samples. Raises RecordingError where the file cannot
        be read."""
        rate, pressure = _read(self, named_files.stamp(self.path))
        position = (time + self.start + step * np.arange(samples)) * rate
        cut = min(1.0, 1.0 / (step * rate))
        reach = int(np.ceil(0.5 * TAPS / cut))
        first = np.floor(position).astype(int)
        pressures = np.zeros(samples)
        for tap in range(1 - reach, reach + 1):
            away = cut * (position - first - tap)
            pressures += windowed_sinc(away) * pressure[(first + tap) % pressure.size]
        return cut * pressures


@lru_cache(maxsize=4)
def _read(recording: NoiseRecording, changed: Stamp) -> tuple[float, Floats]:
    """Sampling frequency (Hz), and the pressure (sample,) at 1 m."""
    with named_files.errors_as(RecordingError, recording.path):
        data = named_files.read(recording.path, waveform_files.MOST_BYTES)
        rate, values = waveform_files.waveform(
            data,
            recording.channel,
            sampling_frequency=recording.sampling_frequency,
            dataset=recording.dataset,
            long=True,
        )
    if values.size < 2:
        raise RecordingError(f"{recording.path}: holds one sample")
    return rate, values * (recording.pascals * recording.distance)


@description
class NoiseSource:
    """A source of noise at one place. Its paths are those of the recipe, direct and reflected; hydrophones hear each as
    one wave, curved as it is, bodies shade it, and it is alike in all directions."""

    name: Annotated[str, MinLen(1)]
    """Name, for people."""
    motion: Motion
    """Where it is: in each frame at one place, whose sound is heard in the middle of the record. Recordings are played
    faster as it approaches (Doppler)."""
    sound: Annotated[Noise | NoiseRecording, BY_KIND]
    """What it sounds like at 1 m: a spectrum, whose level is re 1 uPa2/Hz at 1 m, drawn anew in each frame; or a
    recording."""

    @model_validator(mode="after")
    def _check(self) -> NoiseSource:
        if not isinstance(self.sound, NoiseRecording) and self.sound.directions is not None:
            raise ValueError("sound from one place has no directions: leave out directions")
        return self
