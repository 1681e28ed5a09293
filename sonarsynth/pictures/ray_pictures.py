"""Rays through a frame, drawn: a section with the profile beside it, in space, a page to turn; a table and the numbers.

What a recipe asks for under `rays:`; without it the eigenrays of the frame.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.conventions import aligned, counted
from sonarsynth.equations.rays.ray_solutions import water
from sonarsynth.pictures.figures.style import TIGHT, save
from sonarsynth.pictures.ray_figures.ray_figure import section_figure, space_figure
from sonarsynth.pictures.ray_figures.ray_page import page
from sonarsynth.pictures.ray_figures.ray_styles import FAN, Look
from sonarsynth.pictures.ray_figures.scene_geometry import SceneGeometry, scene_geometry
from sonarsynth.pictures.ray_lines import HIDDEN, RayLine, eigenray_lines, fan_lines
from sonarsynth.pipeline import follow_rays
from sonarsynth.planning import Plan
from sonarsynth.planning import plan as plan_of
from sonarsynth.propagation.ray_request import EigenrayRequest
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame
from sonarsynth.store.files.place import write_atomically

LONGEST_TABLE = 100
REFLECTED = {"surface": "surface", "bottom": "bottom", "facet": "target"}
"""Events of rays that are reflections, and from what."""

HEADINGS = (
    "joins",
    "family",
    "vertices",
    "time (ms)",
    "launch (deg)",
    "arrival (deg)",
    "length (m)",
    "TL (dB)",
    "caustics",
    "flag",
)
UNITS = "SI; angles in rad, up positive; positions (east, north, up) with z = 0 the mean surface; levels in dB re 1 uPa"


def rays(recipe: Recipe, frame: int = 0, out: Path | str = "rays") -> list[Path]:
    """Draw the rays of a frame of a recipe, as `show_rays` does.

    Parameters
    ----------
    recipe: whose rays are drawn.
    frame: number of the frame.
    out: folder of the pictures.

    Returns
    -------
    The files written.

    Raises
    ------
    FieldError for a scene that cannot be, IndexError for a frame that is not there.
    """
    return show_rays(plan_of(recipe), frame, Path(out))[0]


def show_rays(plan: Plan, index: int, out: Path) -> tuple[list[Path], str]:
    """Write `section.png`, `space.png`, `rays.html` and `rays.json` of a frame's rays; their paths, and a table.

    The section is the vertical plane of the sonar's axis, or the one that the eigenrays spread along where they spread
    little along that axis. Rays of a fan that are sent on to the shrimp are coloured by their coefficient, and
    only those are drawn in space. Raises FieldError where there is nothing to draw.
    """
    plan = plan.at(index)
    scene, frame = plan.recipe.frame(index)
    lines = ray_lines(plan, frame, index)
    geometry = scene_geometry(scene, frame, _bearing(frame, lines))
    value = as_json(plan, frame, lines, geometry)
    looks = [Look(line.family, HIDDEN in line.flags, line.event, line.coefficient) for line in lines]
    rays = [line.position for line in lines]
    depth, speed = (np.array(value["profile"][name]) for name in ("depth", "speed"))
    title = f"{plan.recipe.title or 'untitled'}, frame {index}"
    every = counted(len(rays), "ray")
    out.mkdir(parents=True, exist_ok=True)
    files = [out / name for name in ("section.png", "space.png", "rays.html", "rays.json")]
    save(section_figure(f"{title}: {every}", rays, looks, depth, speed, geometry), files[0])
    met = [i for i, look in enumerate(looks) if look.family != FAN or np.isfinite(look.coefficient)]
    shown = met if any(look.family == FAN for look in (looks[i] for i in met)) else range(len(looks))
    described = every if len(shown) == len(rays) else f"{len(shown)} of {every}, sent on from a target"
    space = space_figure(f"{title}: {described}", [rays[i] for i in shown], [looks[i] for i in shown], geometry)
    save(space, files[1], **TIGHT)
    write_atomically(files[2], page(value, looks, geometry).encode())
    write_atomically(files[3], (json.dumps(value, allow_nan=False) + "\n").encode())
    return files, table(lines)


def ray_lines(plan: Plan, frame: Frame, index: int) -> list[RayLine]:
    """The rays to draw of a frame: its eigenrays, the fan, or both, as the recipe asks."""
    request = plan.recipe.rays
    wanted = EigenrayRequest() if request is None else request.eigenrays
    lines = eigenray_lines(plan, frame, wanted) if wanted is not None else []
    if request is not None and request.fan:
        lines += fan_lines(follow_rays(plan, index))
    return lines


def as_json(plan: Plan, frame: Frame, lines: Sequence[RayLine], geometry: SceneGeometry) -> dict[str, Any]:
    """The rays of a frame, the water that they are in, and what stands around them, for a program."""
    bottom = plan.scene.world.environment.depth
    layers = water(plan.profile.depth, plan.profile.speed, bottom)
    places = {"array": frame.sonar_pose.position} | {f"snap {n}": s.position for n, s in enumerate(frame.moment.snaps)}
    return {
        "title": plan.recipe.title,
        "frame": frame.index,
        "time": frame.time,
        "units": UNITS,
        "bottom": bottom,
        "profile": {"depth": layers.depth.tolist(), "speed": layers.speed.tolist()},
        "places": {name: position.tolist() for name, position in places.items()},
        "bearing": geometry.bearing,
        "hydrophones": geometry.sensors.tolist(),
        "tracks": {name: track.tolist() for name, track in geometry.tracks.items()},
        "field_of_view": {name: line.tolist() for name, line in geometry.view.items()},
        "rays": [line.as_json() for line in lines],
    }


def table(lines: Sequence[RayLine]) -> str:
    """The eigenrays, a line each, and a line about the fan."""
    eigenrays = [line for line in lines if line.family != FAN]
    fan = [line for line in lines if line.family == FAN]
    rows: list[tuple[str, ...]] = [HEADINGS] if eigenrays else []
    for line in eigenrays[:LONGEST_TABLE]:
        ends = np.rad2deg(line.elevation[[0, -1]])
        numbers = [1e3 * line.time[-1], *ends, line.length[-1], line.transmission_loss]
        texts = [f"{number:.{digits}f}" for number, digits in zip(numbers, (4, 3, 3, 3, 1), strict=True)]
        flags = ", ".join(line.flags) or "good"
        rows.append((line.name, line.family, line.vertices, *texts, str(line.caustics), flags))
    texts = aligned(rows, words=(0, 1, 2, len(HEADINGS) - 1))
    if len(eigenrays) > LONGEST_TABLE:
        texts.append(f"... and {len(eigenrays) - LONGEST_TABLE} more, in rays.json")
    if eigenrays:
        texts.append("vertices: S surface, B bottom, T turning point, X target; angles of the ray, up positive")
        texts.append("set rays.eigenrays.vertices to change the maximum number of vertices")
        texts.append("TL at the centre of the band; for an echo: two-way, with a target strength of 0 dB")
    if fan:
        met = Counter(event for line in fan for event in line.event)
        words = [f"{met[name]} {word}" for name, word in REFLECTED.items() if met[name]]
        turned = f"; {met['turning point']} turning points" if met["turning point"] else ""
        texts.append(f"{len(fan)} rays: {', '.join(words) or 'no'} reflections{turned}")
    return "\n".join(texts)


def _bearing(frame: Frame, lines: Sequence[RayLine]) -> float:
    """Direction (rad, from x to y) of the plane to draw: the sonar's axis, or where the eigenrays spread most."""
    ahead = frame.sonar_pose.turn_to_world([1.0, 0.0, 0.0])
    axis = float(np.arctan2(ahead[1], ahead[0]))
    if not lines or any(line.family == FAN for line in lines):
        return axis
    flat = np.concatenate([line.position[:, :2] for line in lines]) - frame.sonar_pose.position[:2]
    along, across = (np.ptp(flat @ [np.cos(a), np.sin(a)]) for a in (axis, axis + 0.5 * np.pi))
    if along >= 0.5 * across:
        return axis
    widest = np.linalg.svd(flat, full_matrices=False)[2][0]  # the array is the origin
    away = widest if widest @ flat.mean(axis=0) >= 0 else -widest
    return float(np.arctan2(away[1], away[0]))
