"""Recordings that cannot be used: each refused in one line that names the file, and the line and column."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from sonarsynth.equations.bubble import waveforms
from sonarsynth.sources.recordings import RecordingError, read_recording
from sonarsynth.sources.snap_models import RecordedSnap

ROWS = "0 0\n1e-6 0\n2e-6 5\n3e-6 1\n4e-6 0\n5e-6 0\n"


def refused(path: Path, text: str, **fields: Any) -> None:
    with pytest.raises(RecordingError, match=text) as error:
        read_recording(RecordedSnap(path=str(path), **fields))
    assert str(path) in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("", "has no rows"),
        ("# nothing\n", "has no rows"),
        ("time,pressure\n", "has no rows"),
        ("0 0\n1e-6 0\n2e-6 x\n", r"line 3, column 2: 'x' is not a finite number"),
        ("time, p\n0, 0\n1e-6, nan\n", r"line 3, column 2: 'nan' is not"),
        ("0 0\n1e-6 0\n2e-6 1 4\n", r"line 3: has 3 columns where the first row has 2"),
        ("0\n1\n0\n0\n0\n", r"line 1: has 1 columns, too few for time and pressure .* sampling_frequency"),
        ("0 0\n1e-6 0\n", "has 2 samples"),
        ("0 0\n1e-6 0\n2e-6 0\n3e-6 0\n4e-6 0\n", "is silent"),
        ("0 0\n1e-6 0\n2e-6 5\n3e-6 1\n4e-6 2\n", "is cut off"),
        ("0 0\n1e-6 0\n2e-6 5\n9e-6 1\n1e-5 0\n", r"line \d: time does not rise in even steps"),
        ("0 0\n0 0\n0 5\n0 1\n0 0\n", r"time does not rise"),
        ("3e-6 0\n2e-6 0\n1e-6 5\n0 1\n-1e-6 0\n", r"time does not rise"),
        (
            "time (min), pressure (psi)\n" + ROWS.replace(" ", ","),
            r"column 'pressure \(psi\)': unit 'psi' is not one of",
        ),
        ("0 0\n1e-6 1e308\n2e-6 1e999\n3e-6 0\n", r"line 3, column 2"),
        ("\0\0\0binary", "is not a finite|has no rows"),
    ],
)
def test_text_files(tmp_path: Path, content: str, text: str) -> None:
    path = tmp_path / "snap.csv"
    path.write_text(content)
    refused(path, text)


def test_good_rows_are_good(tmp_path: Path) -> None:
    path = tmp_path / "snap.csv"
    path.write_text(ROWS)
    assert read_recording(RecordedSnap(path=str(path))).zero == 2.0
    refused(path, "not in the recording, 0 to 5e-06 s", time=1.0)
    refused(path, "too few", channel=1)
    refused(path, "not finite", pascals=1e308)


def test_files_that_are_not_there_or_not_text(tmp_path: Path) -> None:
    refused(tmp_path / "none.csv", "no such file")
    refused(tmp_path, "is a directory")
    path = tmp_path / "snap.csv"
    path.write_bytes(b"\xff\xfe\x00\x81" * 40)
    refused(path, "is not a text file")


def test_damaged_wave_files(tmp_path: Path) -> None:
    path = tmp_path / "snap.wav"
    path.write_bytes(b"")
    refused(path, "cannot be read as WAV")
    path.write_bytes(b"RIFFxxxxWAVEjunk")
    refused(path, "cannot be read as WAV")
    wavfile.write(path, 250_000, np.zeros(50, np.int16))
    refused(path, "is silent")
    refused(path, "has no channel 3, only 1", channel=3)
    refused(path, "leave out sampling_frequency", sampling_frequency=1e5)
    whole = path.read_bytes()
    path.write_bytes(whole[:70])
    refused(path, "cannot be read as WAV|has 13 samples|is silent")
    path.write_bytes(whole[:24] + struct.pack("<I", 0) + whole[28:])
    refused(path, "sampling frequency of 0|is silent|cannot be read")
    wavfile.write(path, 250_000, np.array([0, 0, np.nan, 1, 0, 0], np.float32))
    refused(path, "not finite")


def test_too_coarse_for_its_waves() -> None:
    with pytest.raises(ValueError, match="too coarse for waves of 100000 Hz"):
        waveforms.recorded(np.zeros(4096), 10.0, 0.0, 1e5)
