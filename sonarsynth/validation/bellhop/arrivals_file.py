"""Arrivals as Bellhop writes them (`.arr` of a run 'A'): delays, angles and amplitudes of eigenrays.

Porter (2011), "The BELLHOP manual and user's guide", arrivals files; the form with `'2D'` in its first line, and the
one before it, whose first line has the numbers of depths and ranges.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description import named_files

MAX_BYTES: Final = 1 << 26
COLUMNS: Final = 8
"""Amplitude, phase, delay (real, imaginary), angles at source and receiver, bounces at top and bottom."""

LARGEST: Final = np.array([1e6, 1e6, 1e6, 1e6, 360.0, 360.0, 1e6, 1e6])
"""Of each column: more is a damaged file."""

LEAST_LOSS: Final = -200.0
"""dB."""


class ArrivalsError(ValueError):
    """A file of arrivals that cannot be read: one line that names it."""


@dataclass(frozen=True, eq=False)
class BellhopArrivals:
    """The arrivals at one receiver, from one source.

    source_depth, receiver_depth and distance in m, frequency in Hz.
    """

    frequency: float
    source_depth: float
    receiver_depth: float
    distance: float  # m, horizontal
    delay: Floats  # (arrival,) s
    loss: Floats  # (arrival,) dB: transmission loss, absorption within
    phase: Floats  # (arrival,) rad
    launch: Floats  # (arrival,) rad, up positive
    arrival: Floats  # (arrival,) rad, direction of travel, up positive
    surface: Ints  # (arrival,) reflections
    bottom: Ints  # (arrival,)


def read_arrivals(path: Path) -> ArrivalsFile:
    """A file of arrivals. Raises ArrivalsError in one line where it cannot be read, or is cut off."""
    with named_files.errors_as(ArrivalsError, path):
        data = named_files.read(path, MAX_BYTES)
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError:
        raise ArrivalsError(f"{path}: is not a text file: arrivals in binary (run 'a') are not read") from None
    head, _, body = text.lstrip().partition("\n")
    if re.match(r"['\"]3D", head):
        raise ArrivalsError(f"{path}: is of BELLHOP3D, which is not read")
    plane = re.match(r"['\"]2D", head) is not None
    try:
        numbers = _Numbers(path, np.array((body if plane else text).split(), float))
    except ValueError as error:
        raise ArrivalsError(f"{path}: is no file of arrivals ({str(error)[:60]})") from None
    frequency = float(numbers.take(1)[0])
    if plane:
        axes = [numbers.take(numbers.take(1)[0]) for _ in range(3)]
    else:
        axes = [numbers.take(count) for count in numbers.take(3).tolist()]
    if not all(len(axis) and np.isfinite(axis).all() for axis in axes) or not frequency > 0:
        raise ArrivalsError(f"{path}: has no frequency, source, receiver or range")
    return ArrivalsFile(path, frequency, axes, numbers.values[numbers.at :])


@dataclass(frozen=True, eq=False)
class ArrivalsFile:
    """A file of arrivals: from each source to each receiver depth and range."""

    path: Path
    frequency: float  # Hz
    axes: list[Floats]  # m: depths of sources, depths of receivers, ranges
    rest: Floats  # the numbers after these

    def nearest(self, *wanted: float) -> tuple[float, float, float]:
        """The depth of a source, depth of a receiver and range in the file that are nearest to these (m)."""
        source, receiver, distance = (float(axis[i]) for axis, i in zip(self.axes, self._indices(wanted), strict=True))
        return source, receiver, distance

    def at(self, *wanted: float) -> BellhopArrivals:
        """The arrivals of the source and the receiver that are nearest to these (m). Raises ArrivalsError."""
        amplitude, phase, delay, lost, launch, arrival, surface, bottom = self._rows(self._indices(wanted)).T
        with np.errstate(divide="ignore", invalid="ignore"):
            loss = -20.0 * np.log10(np.abs(amplitude)) - 20.0 / np.log(10.0) * 2.0 * np.pi * self.frequency * lost
        if (loss < LEAST_LOSS).any():
            raise ArrivalsError(f"{self.path}: holds arrivals that are louder than any")
        ends = (-np.deg2rad(launch), -np.deg2rad(arrival))  # Bellhop's are down positive
        counts = (surface.astype(np.int64), bottom.astype(np.int64))
        return BellhopArrivals(self.frequency, *self.nearest(*wanted), delay, loss, np.deg2rad(phase), *ends, *counts)

    def _indices(self, wanted: tuple[float, ...]) -> list[int]:
        return [int(np.argmin(np.abs(axis - value))) for axis, value in zip(self.axes, wanted, strict=True)]

    def _rows(self, wanted: list[int]) -> Floats:
        """Rows (arrival, column) of a source, a receiver depth and a range."""
        numbers, sizes = _Numbers(self.path, self.rest), [len(axis) for axis in self.axes]
        for source in range(sizes[0]):
            numbers.take(1)  # the most that any receiver has
            for depth in range(sizes[1]):
                for distance in range(sizes[2]):
                    rows = numbers.take(COLUMNS * numbers.take(1)[0]).reshape(-1, COLUMNS)
                    if [source, depth, distance] == wanted:
                        if not (np.isfinite(rows).all() and (np.abs(rows) <= LARGEST).all()):
                            raise ArrivalsError(f"{self.path}: holds numbers that are of no arrival")
                        return rows
        raise AssertionError("the nearest are among them")


@dataclass
class _Numbers:
    """Numbers of a file, taken one after the other."""

    path: Path
    values: Floats
    at: int = 0

    def take(self, count: float) -> Floats:
        """The next so many. Raises ArrivalsError where there are not as many."""
        if not (count >= 0 and count == np.floor(count) and self.at + count <= len(self.values)):
            raise ArrivalsError(f"{self.path}: is cut off, or is no file of arrivals of Bellhop")
        self.at += int(count)
        return self.values[self.at - int(count) : self.at]
