"""What SONAR-netCDF4 asks of receive beams: directions, widths and samples of hydrophones and of steered beams."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.detection import beam_widths

if TYPE_CHECKING:
    import xarray as xr


class ReceiveBeams(NamedTuple):
    """A group of beams: hydrophones, which hear all directions, or steered beams."""

    names: list[str]
    azimuth: Floats  # (beam,) rad
    elevation: Floats  # (beam,) rad
    azimuth_width: Floats  # (beam,) degree, half power
    elevation_width: Floats  # (beam,) degree
    interval: float  # s
    units: str
    long_name: str
    length: int  # samples
    samples: Callable[[int], tuple[np.ndarray, float]]  # of a frame: (beam, sample), and the time of the first (s)


def receive_beams(tree: xr.DataTree) -> Iterator[ReceiveBeams]:
    """The groups of beams of a store: hydrophones where it has signals; steered beams, against delay or of an image.
    Raises FieldError for an attribute that no build writes."""
    if "signals" in tree.children:
        signals = tree["signals"].dataset
        zeros = np.zeros(signals.sizes["sensor"])
        names = [f"hydrophone {n}" for n in range(len(zeros))]
        interval = 1.0 / float(signals["sampling_frequency"])

        def pressure(frame: int) -> tuple[np.ndarray, float]:
            ping = signals.isel(frame=frame)
            return np.asarray(ping["pressure"].values, np.float32), float(ping["start"])

        wide = zeros + 360.0
        length = signals.sizes["sample"]
        yield ReceiveBeams(names, zeros, zeros, wide, wide, interval, "Pa", "Sound pressure", length, pressure)
    if not {"beams", "image"} & set(tree.children):
        return
    steered = tree["beams" if "beams" in tree.children else "image"].dataset
    azimuth, elevation = np.meshgrid(steered["azimuth"].values, steered["elevation"].values)
    names = [f"azimuth {a:.6g} elevation {e:.6g}" for a, e in zip(azimuth.ravel(), elevation.ravel(), strict=True)]
    axis = np.deg2rad(azimuth.ravel()), np.deg2rad(elevation.ravel())
    interval, units, meaning = float("nan"), "Pa2 s", "Energy in the echo window"
    if "delay" in steered.dims:
        units, meaning = "dB", "Level of the beam re 1 uPa"
        if steered.sizes["delay"] > 1:
            interval = float(np.diff(steered["delay"].values[:2])[0])

    def values(frame: int) -> tuple[np.ndarray, float]:
        ping = steered.isel(frame=frame)
        data = np.asarray(ping["level" if "delay" in steered.dims else "energy"].values, np.float32)
        return data.reshape(len(names), -1), float(ping["start"])

    said = 1.0 if "aperture_rms" in tree.attrs else np.nan  # an old store does not say how wide and high the array is
    wide, high = said * np.rad2deg(beam_widths(tree, *axis))
    yield ReceiveBeams(
        names,
        *axis,
        wide,
        high,
        interval,
        units,
        meaning,
        steered.sizes.get("delay", 1),
        values,
    )
