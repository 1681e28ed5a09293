"""Waveforms in files of instruments, WAV and HDF5: one channel, checked, since the files come from anywhere."""

from __future__ import annotations

import io
import warnings
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.file_formats import hdf5_files
from sonarsynth.description.named_files import FileError

RATES: Final = ("sampling_frequency", "sampling_rate", "sample_rate", "samplerate", "fs")
"""Attributes of a dataset, or of a group or file that holds it, that say how many samples a second it has."""
MOST_BYTES: Final = 1 << 30
MOST_NUMBERS: Final = 1 << 28
"""Of all channels of an HDF5 together."""


def is_hdf5(data: bytes) -> bool:
    """Whether the bytes are those of an HDF5 file."""
    return data[:8] == hdf5_files.SIGNATURE


def waveform(
    data: bytes,
    channel: int = 0,
    *,
    sampling_frequency: float | None = None,
    dataset: str | None = None,
    limit: int = MOST_NUMBERS,
    long: bool = False,
    longest: int | None = None,
) -> tuple[float, Floats]:
    """Sampling frequency (Hz) and numbers (sample,) of a channel, from 0, of a file in HDF5 or else in WAV.

    The full scale of whole numbers in a WAV is 1. Numbers of an HDF5 are as they stand, times the attribute
    `scale_factor` and plus `add_offset` where there are such; of a table the longer side is time. sampling_frequency:
    for an HDF5 that does not say it; dataset: of an HDF5 of several, of at most `limit` numbers; long: a recording of
    the sea, of which a WAV that ends before its header says (of a recorder that was switched off) is taken as far as it
    goes; longest: samples that are taken, at most. Raises FileError, whose text does not name the file.
    """
    if is_hdf5(data):
        rate, values = _hdf5(data, channel, sampling_frequency, dataset, limit, longest)
    elif sampling_frequency is not None:
        raise FileError("a WAV has its own sampling frequency: leave out sampling_frequency")
    elif dataset is not None:
        raise FileError("is no HDF5: leave out dataset")
    else:
        rate, values = _wav(data, channel, long, longest)
    if not 0 < rate < np.inf:
        raise FileError(f"has a sampling frequency of {rate} Hz")
    if not np.isfinite(values).all():
        raise FileError("holds numbers that are not finite")
    return rate, values


def _wav(data: bytes, channel: int, long: bool, longest: int | None) -> tuple[float, Floats]:
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", "Chunk .* not understood")
            if long:
                warnings.filterwarnings("ignore", "Reached EOF prematurely")
            rate, samples = wavfile.read(io.BytesIO(data))
    except Exception as error:  # whatever a damaged file may bring
        text = " ".join(str(error).split())[:120]
        raise FileError(f"cannot be read as WAV ({type(error).__name__}: {text})") from None
    if not samples.size:
        raise FileError("holds no samples")
    values = _column(samples.reshape(len(samples), -1), channel, longest)
    if samples.dtype == np.uint8:
        values = (values - 128.0) / 128.0
    elif samples.dtype.kind == "i":
        values /= -float(np.iinfo(samples.dtype).min)
    return float(rate), values


def _hdf5(
    data: bytes,
    channel: int,
    sampling_frequency: float | None,
    dataset: str | None,
    limit: int,
    longest: int | None,
) -> tuple[float, Floats]:
    numbers, attributes = hdf5_files.read_dataset(data, dataset, limit)
    if numbers.ndim not in (1, 2) or not numbers.size:
        raise FileError(f"its dataset has the shape {numbers.shape}, and is no waveform")
    table = numbers.reshape(len(numbers), -1)
    values = _column(table if len(table) >= table.shape[1] else table.T, channel, longest)
    own = next((attributes[name] for name in RATES if name in attributes), None)
    if own is None and sampling_frequency is None:
        raise FileError(f"has no attribute {RATES[0]}: give the sampling_frequency")
    if own is not None and sampling_frequency is not None:
        raise FileError(f"has its own sampling frequency, {own:g} Hz: leave out sampling_frequency")
    rate = float(own if own is not None else sampling_frequency or 0.0)
    return rate, values * attributes.get("scale_factor", 1.0) + attributes.get("add_offset", 0.0)


def _column(columns: np.ndarray, channel: int, longest: int | None) -> Floats:
    if channel >= columns.shape[1]:
        raise FileError(f"has no channel {channel}, only {columns.shape[1]} (from 0)")
    return columns[:longest, channel].astype(float)
