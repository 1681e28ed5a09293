"""The stored schema: each variable with dimensions, type, units and meaning. The store is laid out from it alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sonarsynth.planning import Plan
from sonarsynth.products import FAMILIES
from sonarsynth.recipe import SPLITS
from sonarsynth.recipe.columns import columns

FORMAT_VERSION = "2"
"""Version of the layout of a store."""


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
_TRUTH = _group(
    "/truth",
    "truth",
    _v("sonar_position", ("frame", "xyz"), "float64", "m", "position of the array centre in the world"),
    _v("sonar_orientation", ("frame", "wxyz"), "float64", "1", "unit quaternion from the sonar frame to the world"),
    _v("target_position", (*_TARGET, "xyz"), "float64", "m", "position of the target's origin in the world"),
    _v(
        "target_orientation", (*_TARGET, "wxyz"), "float64", "1", "unit quaternion from the target's frame to the world"
    ),
    _v("target_velocity", (*_TARGET, "xyz"), "float64", "m s-1", "velocity of the target in the world"),
    _v("box", (*_TARGET, "corner", "xyz"), "float64", "m", "corners of the oriented bounding box, sonar frame"),
    _v("image_box", (*_TARGET, "bound"), "float64", "degree", "bounds of the visible part in azimuth and elevation"),
    _v("visible_fraction", _TARGET, "float64", "1", "share of the area facing the array that the array sees"),
    _v("echo_azimuth", _ECHO, "float64", "degree", "azimuth that the target's echoes come from, weighted by power"),
    _v("echo_elevation", _ECHO, "float64", "degree", "elevation that they come from: ghosts by surface and bed"),
    _v("echo_level", _ECHO, "float64", "dB", "level of the target's echoes re 1 uPa, of their energy in the band"),
    _v("snap_position", (*_SNAP, "xyz"), "float64", "m", "position of the snap in the world"),
    _v("snap_time", _SNAP, "float64", "s", "time of the snap after the instant of the frame"),
    _v("snap_level", _SNAP, "float64", "dB", "peak source level of the snap re 1 uPa at 1 m"),
    _v("target", _BEAMS, "int16", "1", "target that the beam points at", attributes=_NONE),
    _v("facet", _BEAMS, "int32", "1", "facet that the beam points at", attributes=_NONE),
    _v("range", _BEAMS, "float32", "m", "distance to the first surface in the beam's direction"),
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


def variables(plan: Plan) -> tuple[Variable, ...]:
    """The variables of a build: of the products asked for, and int16 pressure where a converter is described."""
    wanted = {"truth", *plan.products}
    if plan.products & {"image", "cloud"}:
        wanted.add("bearings")
    chosen = [v for v in VARIABLES if v.product in wanted]
    converter = plan.scene.sonar.converter
    if converter is not None and converter.bits <= 16:
        counts: dict[str, Any] = {
            "dtype": "int16",
            "fill": -(2**15),
            "attributes": (("scale_factor", converter.quantum),),
        }
        chosen = [replace(v, **counts) if (v.group, v.name) == ("/signals", "pressure") else v for v in chosen]
    return tuple(chosen)


def coordinates(plan: Plan) -> dict[tuple[str, str], tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Static variables of a store: {(group, name): (dims, values, attributes)}."""
    scene, sizes = plan.scene, plan.sizes
    names = [t.name for t in scene.world.targets]
    static: dict[tuple[str, str], tuple[tuple[str, ...], np.ndarray, dict[str, Any]]] = {}

    def add(
        groups: str, name: str, dims: tuple[str, ...], values: Any, units: str, long_name: str, **more: Any
    ) -> None:
        for group in groups.split():
            static[group, name] = (dims, np.asarray(values), {"units": units, "long_name": long_name, **more})

    beams = scene.sonar.beams
    add("/", "frame", ("frame",), np.arange(sizes["frame"]), "1", "frame of the dataset")
    on_grid = "/truth" + "".join(f" /{p}" for p in ("image", "cloud") if p in plan.products)
    degrees = {"comment": "as the sonar looks"}
    add(on_grid, "azimuth", ("azimuth",), np.rad2deg(beams.azimuth), "degree", "azimuth, port positive", **degrees)
    add(
        on_grid, "elevation", ("elevation",), np.rad2deg(beams.elevation), "degree", "elevation, up positive", **degrees
    )
    named = "/truth" + (" /bearings" if plan.products & {"image", "cloud"} else "")
    add(named, "xyz", ("xyz",), list("xyz"), "1", "axis")
    add("/truth", "wxyz", ("wxyz",), list("wxyz"), "1", "part of a unit quaternion, scalar first")
    add("/truth", "target_name", ("target",), np.array(names, dtype=np.str_), "1", "name of the target")
    bounds = ["azimuth_min", "azimuth_max", "elevation_min", "elevation_max"]
    add("/truth", "bound", ("bound",), bounds, "1", "which bound of the image box")
    add("/ledger", "echo", ("echo",), [*names, "direct"], "1", "target of the echo; direct: snap to array")
    add("/ledger", "family", ("family",), list(FAMILIES), "1", "path family: boundaries touched on the whole way")
    touched = "boundaries touched on the way from the target to the array"
    add("/truth", "family", ("family",), list(FAMILIES), "1", touched)
    if "signals" in plan.products:
        _add_sensors(plan, add)
    for column in columns(plan.recipe.spanned):
        static["/", column.name] = (("frame",), np.repeat(column.values, plan.recipe.steps), column.attributes)
    _add_meshes(plan, add)
    return static


def _add_meshes(plan: Plan, add: Any) -> None:
    """The mesh of each target in its group; where its shape varies, its meshes in groups 0, 1, ... of that."""
    meshes = plan.recipe.meshes
    for target, some in zip(plan.scene.world.targets, meshes, strict=True):
        for n, (_, mesh) in enumerate(some):
            group = f"/targets/{target.name}" + (f"/{n}" if len(some) > 1 else "")
            add(group, "vertices", ("vertex", "xyz"), mesh.vertices, "m", "vertices in the target's frame")
            add(group, "faces", ("face", "corner"), mesh.faces, "1", "vertex indices of each facet, outward")
    if any(len(some) > 1 for some in meshes):
        numbers = np.repeat(plan.recipe.mesh_numbers().astype(np.int32), plan.recipe.steps, axis=0)
        add("/truth", "mesh", _TARGET, numbers, "1", "which mesh the target has: its group under /targets/<name>")


def _add_sensors(plan: Plan, add: Any) -> None:
    sensors, rate = plan.elements, plan.scene.sonar.sampling_frequency
    add("/signals", "position", ("sensor", "xyz"), sensors.position, "m", "element positions in the sonar frame")
    add("/signals", "gain", ("sensor",), sensors.gain, "1", "element gain: 0 for a dead element")
    time = np.arange(plan.sizes["sample"]) / rate
    add("/signals", "time", ("sample",), time, "s", "time of each sample after the start of the window")
    add("/signals", "sampling_frequency", (), rate, "Hz", "sampling frequency")


def attributes(plan: Plan) -> dict[str, Any]:
    """Root attributes of a store that any builder of this plan writes the same."""
    recipe = plan.recipe
    return {
        "title": recipe.title,
        "Conventions": "CF-1.11",
        "sonarsynth_format": FORMAT_VERSION,
        "licence": recipe.licence,
        "seed": recipe.seed,
        "recipe_digest": plan.digest,
        "band_low": plan.scene.sonar.band.low,
        "band_high": plan.scene.sonar.band.high,
        "assumed_sound_speed": plan.scene.sonar.assumed_sound_speed,
        "aperture_radius": plan.elements.aperture,
        "choices": plan.choices.as_json(),
        "frames_conventions": (
            "World: x east, y north, z up, z = 0 mean surface. Sonar and target frames: x forward, y port, z up. "
            "Quaternions (w, x, y, z) from body to world. Levels re 1 uPa, source levels at 1 m."
        ),
    }
