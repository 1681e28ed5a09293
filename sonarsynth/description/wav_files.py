"""WAV files, read and checked: they come from anywhere."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import named_files
from sonarsynth.description.named_files import FileError

MOST_BYTES = 1 << 30


def read_wav(path: Path | str, channel: int = 0, most: int = MOST_BYTES) -> tuple[float, Floats]:
    """Sampling frequency (Hz) and numbers (sample,) of a channel, from 0, of a WAV file of at most so many bytes; the
    full scale of whole numbers is 1. Raises FileError, whose text does not name the file."""
    from scipy.io import wavfile

    data_bytes = io.BytesIO(named_files.read(path, most))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", "Chunk .* not understood")
            rate, data = wavfile.read(data_bytes)
    except Exception as error:  # whatever a damaged file may bring
        text = " ".join(str(error).split())[:120]
        raise FileError(f"cannot be read as WAV ({type(error).__name__}: {text})") from None
    if not rate > 0:
        raise FileError(f"has a sampling frequency of {rate} Hz")
    if not data.size:
        raise FileError("holds no samples")
    columns = data.reshape(len(data), -1)
    if channel >= columns.shape[1]:
        raise FileError(f"has no channel {channel}, only {columns.shape[1]} (from 0)")
    values = columns[:, channel].astype(float)
    if data.dtype == np.uint8:
        values = (values - 128.0) / 128.0
    elif data.dtype.kind == "i":
        values /= -float(np.iinfo(data.dtype).min)
    if not np.isfinite(values).all():
        raise FileError("holds numbers that are not finite")
    return float(rate), values
