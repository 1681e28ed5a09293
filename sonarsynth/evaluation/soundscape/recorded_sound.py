"""A recording of the sea, cut into blocks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from sonarsynth.conventions import Floats
from sonarsynth.description import named_files
from sonarsynth.description.file_formats import waveform_files
from sonarsynth.equations.noise.filters import response
from sonarsynth.evaluation.soundscape.sound import BLOCK, FEWEST_BLOCKS, SHORTEST, Sound
from sonarsynth.receiver import Sonar
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.sources.recordings import RecordingError

MOST_SAMPLES = 1 << 25
"""Of a recording: the rest is not looked at."""


@dataclass(frozen=True)
class SeaRecording:
    """A recording of the sea in a file (WAV or HDF5), and what the file does not say."""

    path: Path | str
    pascals: float | None = None  # of the number 1 in the file, the full scale of a WAV of whole numbers; None: unknown
    channel: int = 0
    dataset: str | None = None  # of an HDF5 of several
    sampling_frequency: float | None = None  # Hz, of an HDF5 that does not say it


def recorded_sound(recording: SeaRecording, sonar: Sonar) -> Sound:
    """A channel of a recording behind the filter of a sonar, as far as it goes. Raises RecordingError."""
    path, pascals = recording.path, recording.pascals
    with named_files.errors_as(RecordingError, path):
        rate, values = waveform_files.waveform(
            named_files.read(path, waveform_files.MOST_BYTES),
            recording.channel,
            sampling_frequency=recording.sampling_frequency,
            dataset=recording.dataset,
            long=True,
            longest=MOST_SAMPLES + 1,
        )
    notes = [] if pascals is not None else ["levels of the recording are relative: its sensitivity is not given"]
    if len(values) > MOST_SAMPLES:
        values = values[:MOST_SAMPLES]
        notes.append(f"of the recording the first {len(values) / rate:.3g} s are measured")
    size = min(int(BLOCK * rate), len(values) // FEWEST_BLOCKS)
    if size < SHORTEST:
        raise RecordingError(
            f"{path}: has {len(values)} samples, too few for {FEWEST_BLOCKS} blocks of {SHORTEST} or more"
        )
    if not np.ptp(values) > 0.0:
        raise RecordingError(f"{path}: is silent")
    if 0.5 * rate <= sonar.band.low:
        raise RecordingError(f"{path}: is sampled at {rate:g} Hz: it holds nothing of the band of the sonar")
    if 0.5 * rate < sonar.band.high:
        notes.append(f"the recording ends at {0.5e-3 * rate:g} kHz, within the band of the sonar: its levels are lower")
    filtered = _filtered(values * (pascals or 1.0), rate, sonar)
    if not np.abs(filtered).max() > 1e-12 * np.abs(values).max() * (pascals or 1.0):
        raise RecordingError(f"{path}: is silent in the band of the sonar")
    blocks = filtered[: len(filtered) // size * size].reshape(-1, 1, size).astype(np.float32)
    band = (sonar.band.low, min(sonar.band.high, 0.5 * rate))
    return Sound(blocks, rate, np.zeros((1, 3)), True, band, calibrated=pascals is not None, notes=tuple(notes))


def _filtered(values: Floats, rate: float, sonar: Sonar) -> Floats:
    """Samples (sample,) behind the filter of the sonar."""
    length = next_fast_len(len(values) + int(0.01 * rate), real=True)
    grid = np.linspace(0.0, 0.5 * rate, 8193)
    gain = np.interp(rfftfreq(length, 1.0 / rate), grid, response(grid, fir(sonar.antialias)))
    return np.asarray(irfft(rfft(values - values.mean(), length) * gain, length)[: len(values)])
