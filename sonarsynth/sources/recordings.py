"""Recorded waveforms: read from CSV, text, WAV and HDF5 files, checked, brought to 1 m."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import UNITS, Floats, Number, PositiveHertz, PositiveMetres, Seconds
from sonarsynth.description import description, named_files
from sonarsynth.description.file_formats import waveform_files
from sonarsynth.equations.bubble import waveforms
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.sources.pulse_model import PulseModel, Stamp

MOST_SAMPLES = 1 << 18
"""A longer file is a recording of the sea, not of a snap."""

MOST_NUMBERS = 1 << 23
"""Of all channels together."""

MOST_BYTES = 1 << 26

QUIET = 1e-2
"""What a recording may be at its ends, relative to its peak: a step there is heard at all frequencies."""


class RecordingError(ValueError):
    """A recording that cannot be used: one line that names the file, and the line and column where there is one."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A snap as recorded, at 1 m."""

    pressure: Floats  # (sample,) Pa
    sampling_frequency: float  # Hz
    zero: float  # sample of the collapse, a fraction too


@description
class RecordedSnap(PulseModel):
    """A recorded waveform: CSV or text (time and pressure, or pressure alone), WAV or HDF5."""

    kind: Literal["recorded_snap"] = "recorded_snap"
    path: str
    """Path of the file, relative to the recipe."""
    distance: PositiveMetres = 1.0
    """From the snap to the hydrophone that recorded it: the pressure is brought to 1 m as 1/r."""
    pascals: Annotated[Number, Gt(0)] = 1.0
    """Pressure (Pa) of the number 1 in the file; the full scale of a WAV of whole numbers is 1."""
    sampling_frequency: PositiveHertz | None = None
    """For a file without times, or an HDF5 without an attribute of that name; others have their own."""
    dataset: str | None = None
    """Of an HDF5 ("/group/dataset"); left out: the only one that there is."""
    channel: Annotated[int, Ge(0)] = 0
    """Channel of a WAV or an HDF5, or the column of pressure after the time, from 0."""
    time: Seconds | None = None
    """Time of the collapse, on the file's own clock (of WAV and HDF5 from 0); left out: of the largest pressure."""
    fade: Annotated[Number, Ge(0), Le(0.5)] = 0.0
    """Part of the recording that fades in, and that fades out: for one that is not quiet at its ends."""

    @property
    def file(self) -> Stamp:
        """As `PulseModel.file`."""
        return stamp(self)

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`. Raises RecordingError where the file has none."""
        recording = read_recording(self)
        return waveforms.recorded(recording.pressure, recording.sampling_frequency, recording.zero, highest)


def read_recording(snap: RecordedSnap) -> Recording:
    """The recording of a described snap (its path relative to the working directory), kept until the file changes.

    Raises RecordingError in one line that names the file, and the line and column where there is one.
    """
    return _recording(snap, stamp(snap))


def stamp(snap: RecordedSnap) -> Stamp:
    """What changes when the file does: when it was written, and its size. Raises RecordingError without a file."""
    with named_files.errors_as(RecordingError, snap.path):
        return named_files.stamp(snap.path)


@lru_cache(maxsize=32)
def _recording(snap: RecordedSnap, changed: Stamp) -> Recording:
    path = Path(snap.path)
    data = _bytes(path)
    instrument = waveform_files.is_hdf5(data) or path.suffix.lower() in {".wav", ".wave"}
    start, rate, values = (_instrument if instrument else _text)(path, data, snap)
    if not 4 <= values.size <= MOST_SAMPLES:
        raise RecordingError(f"{path}: has {values.size} samples; a snap has 4 to {MOST_SAMPLES}")
    with np.errstate(over="ignore", invalid="ignore"):
        p = values * (snap.pascals * snap.distance)
    peak = float(np.abs(p).max())
    if not 0 < peak < np.inf:
        raise RecordingError(f"{path}: " + ("is silent" if peak == 0 else "holds numbers that are not finite"))
    if snap.fade:
        p = p * _gate(p.size, snap.fade)
    loud = max(abs(p[0]), abs(p[-1])) / peak
    if loud > QUIET:
        raise RecordingError(
            f"{path}: is cut off: at an end it is {loud:.2g} of its peak; record more of it, or set fade"
        )
    zero = float(np.argmax(np.abs(p))) if snap.time is None else (snap.time - start) * rate
    if not 0 <= zero <= p.size - 1:
        end = start + (p.size - 1) / rate
        raise RecordingError(f"{path}: time {snap.time:.6g} s is not in the recording, {start:.6g} to {end:.6g} s")
    p.flags.writeable = False
    return Recording(p, rate, zero)


def _gate(size: int, fraction: float) -> Floats:
    """A raised cosine at either end, from 0."""
    u = np.arange(size) / (fraction * (size - 1))
    rise = np.sin(0.5 * np.pi * np.clip(u, 0.0, 1.0)) ** 2
    return np.asarray(rise * rise[::-1], float)


def _instrument(path: Path, data: bytes, snap: RecordedSnap) -> tuple[float, float, Floats]:
    """Start (s), sampling frequency (Hz) and numbers (sample,) of a WAV or an HDF5."""
    rate, name = snap.sampling_frequency, snap.dataset
    with named_files.errors_as(RecordingError, path):
        sound = waveform_files.waveform(data, snap.channel, sampling_frequency=rate, dataset=name, limit=MOST_NUMBERS)
        return 0.0, *sound


def _text(path: Path, data: bytes, snap: RecordedSnap) -> tuple[float, float, Floats]:
    rows, lines, names = _rows(path, data)
    timed = snap.sampling_frequency is None
    column = snap.channel + timed
    if rows.shape[1] <= column:
        wanted = "time and pressure (a file of pressures alone needs sampling_frequency)" if timed else "pressure"
        raise RecordingError(f"{path}, line {lines[0]}: has {rows.shape[1]} columns, too few for {wanted}")
    values = rows[:, column] * _unit(path, names, column, "Pa")
    if snap.sampling_frequency is not None:
        return 0.0, snap.sampling_frequency, values
    time = rows[:, 0] * _unit(path, names, 0, "s")
    step = (time[-1] - time[0]) / max(time.size - 1, 1)
    uneven = np.flatnonzero(~(np.abs(time - (time[0] + step * np.arange(time.size))) <= 0.05 * step))
    if step <= 0 or uneven.size:
        line = lines[uneven[0] if uneven.size else -1]
        raise RecordingError(f"{path}, line {line}: time does not rise in even steps (of {step:.6g} s)")
    return float(time[0]), float(1.0 / step), values


def _rows(path: Path, data: bytes) -> tuple[Floats, list[int], list[str]]:
    """Numbers (row, column), the number of each one's line, and the names of the columns where the file has them."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise RecordingError(f"{path}: is not a text file") from None
    written = [(i, s) for i, s in enumerate(text.splitlines(), start=1) if s.strip() and s.lstrip()[0] not in "#%"]
    if len(written) > MOST_SAMPLES + 1:
        raise RecordingError(f"{path}: has more than {MOST_SAMPLES} rows: cut it to the snap")
    cells = [(i, _cells(s)) for i, s in written]
    names = cells.pop(0)[1] if cells and not any(_number(c) is not None for c in cells[0][1]) else []
    if not cells:
        raise RecordingError(f"{path}: has no rows of numbers")
    width = len(cells[0][1])
    rows = np.empty((len(cells), width))
    for k, (i, row) in enumerate(cells):
        if len(row) != width:
            raise RecordingError(f"{path}, line {i}: has {len(row)} columns where the first row has {width}")
        for j, cell in enumerate(row):
            number = _number(cell)
            if number is None or not np.isfinite(number):
                raise RecordingError(f"{path}, line {i}, column {j + 1}: {cell[:40]!r} is not a finite number")
            rows[k, j] = number
    return rows, [i for i, _ in cells], names


def _bytes(path: Path) -> bytes:
    with named_files.errors_as(RecordingError, path):
        return named_files.read(path, MOST_BYTES)


def _cells(line: str) -> list[str]:
    return [c.strip().strip('"') for c in re.split(r"[,;\t]", line)] if re.search(r"[,;\t]", line) else line.split()


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _unit(path: Path, names: list[str], column: int, symbol: str) -> float:
    """Size of the unit in a column's name, in brackets ("time (us)"); 1 where it names none."""
    if not (match := re.search(r"[(\[]\s*(.*?)\s*[)\]]", names[column] if column < len(names) else "")):
        return 1.0
    if match[1] not in UNITS[symbol]:
        units = ", ".join(UNITS[symbol])
        raise RecordingError(f"{path}, column '{names[column]}': unit '{match[1]}' is not one of {units}")
    return UNITS[symbol][match[1]]
