"""Every variable that a frame may have: its dimensions, type, units and meaning."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from sonarsynth.recipe import SPLITS


@dataclass(frozen=True)
class Variable:
    """One stored variable. Those with a `frame` axis are written frame by frame; unwritten ones read as `fill`."""

    group: str  # "/" or "/signals"
    name: str
    dims: tuple[str, ...]
    dtype: str
    units: str  # UDUNITS text; "1" where there is none
    long_name: str
    fill: float | int = float("nan")
    attributes: tuple[tuple[str, Any], ...] = ()
    product: str = "truth"  # which product of a build it belongs to


_BEAMS = ("frame", "elevation", "azimuth")
_SNAP = ("frame", "snap")
_TARGET = ("frame", "target")
_ECHO = (*_TARGET, "family")
_CELL = ("frame", "snap", "echo", "family")
_NONE = (("flag_values", [-1]), ("flag_meanings", "none"))


def _group(group: str, product: str, *rows: Variable) -> tuple[Variable, ...]:
    return tuple(replace(row, group=group, product=product) for row in rows)


def _comment(text: str) -> tuple[tuple[str, Any], ...]:
    return (("comment", text),)


def _v(name: str, dims: tuple[str, ...], dtype: str, units: str, long_name: str, **more: Any) -> Variable:
    if dtype[0] in "iu" and "fill" not in more:
        more["fill"] = -1
    return Variable("", name, dims, dtype, units, long_name, **more)


_ROOT = _group(
    "/",
    "truth",
    _v("trajectory", ("frame",), "int32", "1", "trajectory (sequence) of the frame"),
    _v("step", ("frame",), "int32", "1", "step of the frame along its trajectory"),
    _v("time", ("frame",), "float64", "s", "time of the frame since the start of its trajectory"),
    _v(
        "split",
        ("frame",),
        "int8",
        "1",
        "split of the dataset",
        attributes=(("flag_values", list(range(len(SPLITS)))), ("flag_meanings", " ".join(SPLITS))),
    ),
)
_SIGNALS = _group(
    "/signals",
    "signals",
    _v("pressure", ("frame", "sensor", "sample"), "float32", "Pa", "sound pressure at each hydrophone"),
    _v("start", ("frame",), "float64", "s", "time of sample 0 after the instant of the frame"),
    _v("clipped", ("frame",), "int32", "1", "samples at full scale of the converter"),
    _v("outside", ("frame",), "int32", "1", "arrivals outside the window: left out, counted"),
)
_IMAGE = _group(
    "/image",
    "image",
    _v("energy", _BEAMS, "float32", "Pa2 s", "energy of the beam in the echo window"),
    _v("start", ("frame",), "float64", "s", "start of the echo window after the instant of the frame"),
    _v("stop", ("frame",), "float64", "s", "end of the echo window after the instant of the frame"),
)
_CLOUD = _group(
    "/cloud",
    "cloud",
    _v("range", _BEAMS, "float32", "m", "distance of the point from the array centre"),
    _v("range_error", _BEAMS, "float32", "m", "predicted standard error of range"),
    _v("delay", _BEAMS, "float32", "s", "delay of the echo after the direct arrival of the snap"),
    _v("energy", _BEAMS, "float32", "Pa2 s", "energy of the beam of the point"),
    _v("x", _BEAMS, "float32", "m", "position of the point, forward, in the sonar frame"),
    _v("y", _BEAMS, "float32", "m", "position of the point, to port, in the sonar frame"),
    _v("z", _BEAMS, "float32", "m", "position of the point, up, in the sonar frame"),
)
_BEARINGS = _group(
    "/bearings",
    "bearings",
    _v(
        "time", _SNAP, "float64", "s", "arrival of the direct pulse at the array centre, after the instant of the frame"
    ),
    _v("time_error", _SNAP, "float64", "s", "predicted standard error of time"),
    _v("azimuth", _SNAP, "float64", "degree", "azimuth of the snap as the array hears it, port positive"),
    _v("azimuth_error", _SNAP, "float64", "degree", "predicted standard error of azimuth"),
    _v("elevation", _SNAP, "float64", "degree", "elevation of the snap as the array hears it, up positive"),
    _v("elevation_error", _SNAP, "float64", "degree", "predicted standard error of elevation"),
    _v("range_from_depth", _SNAP, "float64", "m", "distance at which the bearing meets the depth of the bed"),
    _v("range_from_depth_error", _SNAP, "float64", "m", "predicted standard error of range_from_depth"),
    _v("range_from_curvature", _SNAP, "float64", "m", "distance from the curvature of the wavefront"),
    _v("range_from_curvature_error", _SNAP, "float64", "m", "predicted standard error of range_from_curvature"),
    _v("position", (*_SNAP, "xyz"), "float64", "m", "position of the snap in the sonar frame"),
    _v("position_covariance", (*_SNAP, "xyz", "xyz_other"), "float64", "m2", "predicted covariance of position"),
    _v("residual", _SNAP, "float64", "s", "root mean square residual of the sensor delays"),
)
_INSTANT = _comment("at the instant of the frame; what is heard is of when sound met the target: position_at_echo")
_MEETING = _comment(
    "what echoes, images and points show is where the sound met the target; poses, boxes and beams of the truth are "
    "those of the instant of the frame. Sound by surface or bed meets it later. NaN where no direct path leads to it"
)
_TRUTH = _group(
    "/truth",
    "truth",
    _v("sonar_position", ("frame", "xyz"), "float64", "m", "position of the array centre in the world"),
    _v("sonar_orientation", ("frame", "wxyz"), "float64", "1", "unit quaternion from the sonar frame to the world"),
    _v(
        "target_position",
        (*_TARGET, "xyz"),
        "float64",
        "m",
        "position of the target's origin in the world at the instant of the frame",
        attributes=_INSTANT,
    ),
    _v(
        "position_at_echo",
        (*_SNAP, "target", "xyz"),
        "float64",
        "m",
        "position of the target's origin in the world when the sound of the snap, by the direct path, met it",
        attributes=_MEETING,
    ),
    _v(
        "meeting_time",
        (*_SNAP, "target"),
        "float64",
        "s",
        "time after the instant of the frame when the sound of the snap, by the direct path, met the target's origin",
        attributes=_MEETING,
    ),
    _v(
        "target_orientation",
        (*_TARGET, "wxyz"),
        "float64",
        "1",
        "unit quaternion from the target's frame to the world",
        attributes=_INSTANT,
    ),
    _v("target_velocity", (*_TARGET, "xyz"), "float64", "m s-1", "velocity of the target in the world"),
    _v(
        "box",
        (*_TARGET, "corner", "xyz"),
        "float64",
        "m",
        "corners of the oriented bounding box, sonar frame",
        attributes=_INSTANT,
    ),
    _v(
        "image_box",
        (*_TARGET, "bound"),
        "float64",
        "degree",
        "bounds of the visible part in azimuth and elevation",
        attributes=_INSTANT,
    ),
    _v("visible_fraction", _TARGET, "float64", "1", "share of the area facing the array that the array sees"),
    _v("echo_azimuth", _ECHO, "float64", "degree", "azimuth that the target's echoes come from, weighted by power"),
    _v("echo_elevation", _ECHO, "float64", "degree", "elevation that they come from: ghosts by surface and bed"),
    _v("echo_level", _ECHO, "float64", "dB", "level of the target's echoes re 1 uPa, of their energy in the band"),
    _v("snap_position", (*_SNAP, "xyz"), "float64", "m", "position of the snap in the world"),
    _v("snap_time", _SNAP, "float64", "s", "time of the snap after the instant of the frame"),
    _v("snap_level", _SNAP, "float64", "dB", "peak source level of the snap re 1 uPa at 1 m"),
    _v("target", _BEAMS, "int16", "1", "target that the beam points at", attributes=(*_NONE, *_INSTANT)),
    _v("facet", _BEAMS, "int32", "1", "facet that the beam points at", attributes=(*_NONE, *_INSTANT)),
    _v("range", _BEAMS, "float32", "m", "distance to the first surface in the beam's direction", attributes=_INSTANT),
    _v(
        "wavefront_error",
        ("frame",),
        "float64",
        "s",
        "largest error of wavefronts measured at probes over the aperture; NaN where one has no ray",
    ),
    _v(
        "amplitude_error",
        ("frame",),
        "float64",
        "1",
        "largest error of amplitudes measured at those probes, relative to the strongest echo",
    ),
)
LEDGER_COMMENT = (
    "received = source - transmission_loss_out + scattering - transmission_loss_in - absorption - boundary. Ratios of "
    "energies in the band of the sonar; of coherent paths the pressures are summed, of others the powers. Losses are "
    "means over the paths, weighted by power; scattering has what phases add or cancel."
)
"""Stored with each level of the ledger."""

_LEVELS = {
    "source_level": "peak source level of the snap re 1 uPa at 1 m",
    "transmission_loss_out": "spreading loss from snap to target (snap to array for the direct path)",
    "scattering": "scattering of all facets together: target strength",
    "transmission_loss_in": "spreading loss from target to array",
    "absorption_loss": "absorption along the whole path",
    "boundary_loss": "loss at surface and bed",
    "received_level": "level at the array centre re 1 uPa: peak of a snap of the energy in the band",
}
_LEDGER = _group(
    "/ledger",
    "truth",
    *(_v(name, _CELL, "float64", "dB", text, attributes=_comment(LEDGER_COMMENT)) for name, text in _LEVELS.items()),
    _v("paths", _CELL, "int32", "1", "number of paths"),
    _v("isolated_level", _CELL, "float64", "dB", "received level of the loudest path of the family alone, predicted"),
    _v(
        "measured_level",
        _CELL,
        "float64",
        "dB",
        "level of that path measured in its signals; NaN where none were made",
        attributes=_comment("the path alone, synthesised at one ideal hydrophone in the array centre"),
    ),
    _v("isolated_facet", _CELL, "int32", "1", "facet of that path in the mesh of its target", attributes=_NONE),
    _v(
        "error_bound",
        _CELL,
        "float64",
        "dB",
        "bound on the error of each level from the approximations made; NaN without one",
    ),
)

VARIABLES: tuple[Variable, ...] = (*_ROOT, *_SIGNALS, *_IMAGE, *_CLOUD, *_BEARINGS, *_TRUTH, *_LEDGER)
"""Every variable that a frame may have."""
