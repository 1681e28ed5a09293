"""Variables that all frames share: coordinates, meshes, and the sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.planning import OF_BEAMS, Plan
from sonarsynth.products import DIRECT, FAMILIES
from sonarsynth.recipe.varied_columns import columns

_BOUNDS = (
    ("bound", ["azimuth_min", "azimuth_max", "elevation_min", "elevation_max"], "which bound of a box in angles"),
    ("side", ["x0", "y0", "x1", "y1"], "which side of a box in pixels: x along azimuth, y along elevation"),
)


def coordinates(plan: Plan) -> dict[tuple[str, str], tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Static variables of a store: {(group, name): (dims, values, attributes)}."""
    scene, sizes = plan.scene, plan.sizes
    names = list(plan.recipe.target_names)
    static: dict[tuple[str, str], tuple[tuple[str, ...], np.ndarray, dict[str, Any]]] = {}

    def add(
        groups: str, name: str, dims: tuple[str, ...], values: Any, units: str, long_name: str, **more: Any
    ) -> None:
        for group in groups.split():
            static[group, name] = (dims, np.asarray(values), {"units": units, "long_name": long_name, **more})

    beams = scene.sonar.beams
    add("/", "frame", ("frame",), np.arange(sizes["frame"]), "1", "frame of the dataset")
    on_grid = " ".join(["/truth/beams", *(f"/{name}" for name in ("image", "beams") if name in plan.products)])
    degrees = {"comment": "as the sonar looks"}
    by_azimuth = on_grid + " /range_image" * ("range_image" in plan.products)
    add(by_azimuth, "azimuth", ("azimuth",), np.rad2deg(beams.azimuth), "degree", "azimuth, port positive", **degrees)
    add(
        on_grid, "elevation", ("elevation",), np.rad2deg(beams.elevation), "degree", "elevation, up positive", **degrees
    )
    estimates = " /source_estimates" if plan.products & OF_BEAMS else ""
    add("/truth" + estimates, "xyz", ("xyz",), list("xyz"), "1", "axis")
    add("/truth", "wxyz", ("wxyz",), list("wxyz"), "1", "part of a unit quaternion, scalar first")
    add("/truth/targets", "target", ("target",), np.array(names, dtype=np.str_), "1", "name of the target")
    for name, values, description in _BOUNDS:
        add("/truth/targets", name, (name,), values, "1", description)
    if plan.products:
        add(
            "/link_budget",
            "target",
            ("target",),
            [*names, DIRECT],
            "1",
            f"target of the echoes; {DIRECT}: snap to array",
        )
        add(
            "/link_budget",
            "family",
            ("family",),
            list(FAMILIES),
            "1",
            "family of paths: boundaries touched",
        )
        touched = "boundaries touched on the way from the target to the array"
        add("/truth/targets", "family", ("family",), list(FAMILIES), "1", touched)
    if "beams" in plan.products:
        add(
            "/beams",
            "delay",
            ("delay",),
            plan.beam_delays,
            "s",
            "time after the start of the window, steps of 1/bandwidth",
        )
    _add_ranges(plan, add)
    if "signals" in plan.products:
        _add_sensors(plan, add)
    for column in columns(plan.recipe.spanned):
        static["/", column.name] = (("frame",), np.repeat(column.values, plan.recipe.spanned.steps), column.attributes)
    _add_meshes(plan, add)
    return static


def _add_ranges(plan: Plan, add: Any) -> None:
    """Ranges of the cells of range images."""
    if "range_image" in plan.products and (grid := plan.scene.sonar.ranges) is not None:
        add("/range_image", "range", ("range",), grid.range, "m", "range from the middle of the array")


def _add_meshes(plan: Plan, add: Any) -> None:
    """The mesh of each target in its group; where there are several, in groups 0, 1, ... of that."""
    groups = np.array(plan.recipe.mesh_groups, dtype=np.str_)
    add("/truth/targets", "group", ("target",), groups, "1", "group of the target's meshes, under /targets")
    for name, meshes in plan.recipe.meshes.items():
        for n, mesh in enumerate(meshes):
            group = f"/targets/{name}" + (f"/{n}" if len(meshes) > 1 else "")
            add(group, "vertices", ("vertex", "xyz"), mesh.vertices, "m", "vertices in the target's frame, at scale 1")
            add(group, "faces", ("face", "corner"), mesh.faces, "1", "vertex indices of each facet, outward")


def _add_sensors(plan: Plan, add: Any) -> None:
    sensors, rate = plan.elements, plan.scene.sonar.sampling_frequency
    add("/signals", "position", ("sensor", "xyz"), sensors.position, "m", "element positions in the sonar frame")
    add("/signals", "gain", ("sensor",), sensors.gain, "1", "element gain: 0 for a dead element")
    time = np.arange(plan.sizes["sample"]) / rate
    add("/signals", "time", ("sample",), time, "s", "time of each sample after the start of the window")
    add("/signals", "sampling_frequency", (), rate, "Hz", "sampling frequency")
