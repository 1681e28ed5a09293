"""What the sonar hears and makes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import Columns
from sonarsynth.conventions import Floats, Ints


@dataclass(frozen=True, eq=False)
class Signals:
    """Pressure at each hydrophone, as the converter gives it."""

    pressure: npt.NDArray[
        np.float32
    ]  # (sensor, sample) Pa; as converted, a whole number of `quantum` where there is one
    start: float  # s: time of sample 0
    sampling_frequency: float  # Hz
    quantum: float  # Pa of one count; 0 without a converter
    clipped: int  # samples at full scale
    outside: int  # arrivals that fell outside the window: counted, never wrapped

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the pressure."""
        return np.shape(self.pressure)

    def segments(self) -> Iterable[SignalSegment]:
        """What has sound, in the order of time: all else is silent."""
        return [(0, self.pressure)]


SignalSegment = tuple[int, npt.NDArray[Any]]
"""The first sample of a segment of signals, and its pressure (sensor, sample) Pa."""
LateSegment = tuple[int, int, Callable[[npt.NDArray[Any], int], None]]
"""The first sample of a segment and the one after its last, and what adds it to pressure from a first sample on."""


class LateSignals(Signals):
    """Signals that are summed at the hydrophones when they are looked at. What is made before is small: made for some
    frames, one after the other, it stays in the caches of a core."""

    @classmethod
    def of(cls, segments: Sequence[LateSegment], shape: tuple[int, int], dtype: str, **columns: Any) -> LateSignals:
        """segments: in the order of time, none overlaps another; shape (sensor, sample), dtype: of sums; columns as in
        `Signals`."""
        late = object.__new__(cls)
        vars(late).update(late=segments, late_shape=shape, dtype=dtype, quantum=0.0, clipped=0, **columns)
        return late

    @property
    def shape(self) -> tuple[int, ...]:
        """As `Signals.shape`, without a sum."""
        return np.shape(self.pressure) if "pressure" in vars(self) else vars(self)["late_shape"]

    def segments(self) -> Iterable[SignalSegment]:
        """As `Signals.segments`, summed one by one."""
        if "pressure" in vars(self):
            yield from super().segments()
            return
        for first, stop, add in vars(self)["late"]:
            segment = np.zeros((self.shape[0], stop - first), vars(self)["dtype"])
            add(segment, first)
            yield first, segment

    def total(self) -> npt.NDArray[Any]:
        """Pressure (sensor, sample) in Pa, as it is summed."""
        total = np.zeros(self.shape, vars(self)["dtype"])
        for *_, add in vars(self)["late"]:
            add(total, 0)
        return total

    @cached_property
    def pressure(self) -> npt.NDArray[np.float32]:
        """(sensor, sample) Pa."""
        return self.total().astype(np.float32, copy=False)


REASONS = (
    "accepted",
    "nothing_heard",
    "array_tells_no_direction",
    "band_too_narrow",
    "not_one_wavefront",
    "not_resolved",
    "outside_the_water",
    "may_be_an_echo",
    "range_unknown",
    "cut_off",
)
"""Why a row of `SourceEstimates` is not accepted: `SourceEstimates.reason` is an index. Of "range_unknown" the position
alone is NaN: when and from where the pulse came is known; of all others nothing. What cuts off is an end of the record.
"""


@dataclass(frozen=True, eq=False)
class SourceEstimates:
    """Where the sonar thinks each snap was, as measured from its direct pulse or as known from its trigger: one row a
    snap, the loudest direct pulse first; NaN where none was found.

    Rows of what was found come first, then those of pulses that were refused, `reason` says why. Standard errors are
    predicted from the data and the instrument alone (one sigma). Which true snap a row comes from is a label:
    `labels.estimate_labels`.
    """

    time: Floats  # (estimate,) s: arrival at the array centre of the peak of the pulse's envelope in the band
    time_error: Floats  # (estimate,) s
    azimuth: Floats  # (estimate,) rad, sonar frame, of the arriving wave as it is heard, whatever else is known
    azimuth_error: Floats  # (estimate,) rad
    elevation: Floats  # (estimate,) rad
    elevation_error: Floats  # (estimate,) rad
    range_from_depth: Floats  # (estimate,) m: where the bearing meets the known depth of the bottom
    range_from_depth_error: Floats  # (estimate,) m
    range_from_curvature: Floats  # (estimate,) m: from the curvature of the wavefront
    range_from_curvature_error: Floats  # (estimate,) m
    position: Floats  # (estimate, xyz) m, sonar frame: of the wavefront, and of the bottom's depth where it was used
    position_covariance: Floats  # (estimate, xyz, xyz) m2
    position_by_speed: Floats  # (estimate, xyz) s: dS/dc, c the assumed sound speed, whose error the covariance holds
    residual: Floats  # (estimate,) s: root mean square residual of the sensor delays
    bottom_used: (
        Ints  # (estimate,) 1 where the depth of the bottom entered the position, 0 where it did not, -1 without one
    )
    reason: Ints  # (estimate,) index into REASONS
    pressure: Floats  # (estimate,) Pa: peak of the envelope at the array centre; also of what may be an echo
    as_snap_time: Floats  # (estimate,) s: `time`; of what may be an echo, as if it were a snap
    as_snap_position: Floats  # (estimate, xyz) m: the same of `position`
    as_snap_covariance: Floats  # (estimate, xyz, xyz) m2: the same of `position_covariance`


@dataclass(frozen=True, eq=False)
class EnergyImage:
    """Energy in each steered direction, in the echo window."""

    energy: npt.NDArray[np.float32]  # (elevation, azimuth) Pa2 s: a plane wave of pressure p gives int p2 dt
    azimuth: Floats  # (azimuth,) rad, ascending
    elevation: Floats  # (elevation,) rad, ascending
    start: float  # s: the echo window that was imaged
    stop: float  # s
    remainder: float = float("nan")  # share of the loudest beam that may be left of the direct pulse, once taken out


@dataclass(frozen=True, eq=False)
class PointCloud(Columns):
    """Where the echoes of a frame come from: a list of points, in the order of their beams. Sonar frame.

    Predicted errors are one standard error, of where each echo was made (`clouds.range_error`); where several snaps may
    have lit it, those of ranges hold that (`illumination`).
    """

    position: npt.NDArray[np.float32]  # (point, xyz) m
    range: npt.NDArray[np.float32]  # (point,) m from the array centre
    range_error: npt.NDArray[np.float32]  # (point,) m, predicted standard error
    azimuth: Floats  # (point,) rad, port positive
    azimuth_error: Floats  # (point,) rad, predicted standard error
    elevation: Floats  # (point,) rad
    elevation_error: Floats  # (point,) rad
    delay: npt.NDArray[np.float32]  # (point,) s after the direct arrival
    energy: npt.NDArray[np.float32]  # (point,) Pa2 s: of the echo, or of its beam, as it was picked
    snr: npt.NDArray[np.float32]  # (point,) dB: power of the echo's peak over the mean power of noise in its beam
    overflow: int = 0  # points that were left out: the faintest
    estimate: Ints | int = 0  # (point,) the row of `SourceEstimates` that it is placed by

    def __len__(self) -> int:
        """Number of points."""
        return len(self.range)

    def loudest(self, count: int) -> PointCloud:
        """At most so many points, those of most energy, in the order in which they are; the others are counted."""
        if len(self) <= count:
            return self
        rows = np.sort(np.argsort(-self.energy, kind="stable")[:count])
        return replace(self.select(rows), overflow=self.overflow + len(self) - count)


def no_points() -> PointCloud:
    """A cloud without points."""
    none, angle = np.zeros(0, np.float32), np.zeros(0)
    return PointCloud(np.zeros((0, 3), np.float32), none, none, angle, angle, angle, angle, none, none, none)
