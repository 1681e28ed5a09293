"""Rays as one page: a file that any browser opens and nothing else is needed for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.ray_figure import COLOURS, FAN, RAYS
from sonarsynth.pictures.figures.style import ERROR_MAP

MOST_FACETS = 20_000
"""Facets of all targets that a page draws; of more, some are left out, evenly."""
DATA, SCRIPT = "@DATA@", "@SCRIPT@"
"""Where the template takes the numbers and the program."""


def page(rays: Mapping[str, Any], hulls: Sequence[Hull]) -> str:
    """The page (HTML, pure ASCII) of the rays that `ray_pictures.as_json` describes, with the targets in the world.

    It needs no network. The numbers are JSON in a script element of id `rays-data`.
    """
    lines = [{**ray, "colour": colour} for ray, colour in zip(rays["rays"], _colours(rays["rays"]), strict=True)]
    value = {**rays, "rays": lines, "colours": COLOURS, "targets": _targets(hulls)}
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))  # escapes all that is not ASCII
    for mark in "<>&":  # so that no name can end the element
        text = text.replace(mark, f"\\u{ord(mark):04x}")
    folder = files("sonarsynth.pictures.figures")
    names = ("rays.html", "rays_drawing.js", "rays_mouse.js")
    template, drawing, mouse = (folder.joinpath(name).read_text(encoding="ascii") for name in names)
    before, after = template.replace(SCRIPT, drawing + mouse).split(DATA)
    return before + text + after


def _colours(rays: Sequence[Mapping[str, Any]]) -> list[str]:
    """Colour of each ray: of its family; in a fan alone by turns, or by the coefficients where rays were sent on."""
    sent = [ray["coefficient"] for ray in rays if ray["coefficient"] is not None]
    if any(ray["family"] != FAN for ray in rays):
        return [COLOURS[ray["family"]] for ray in rays]
    if not sent:
        return [RAYS[i % len(RAYS)] for i in range(len(rays))]
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    strongest = max(sent) or 1.0
    scale = colormaps[ERROR_MAP]
    return [COLOURS[FAN] if (c := ray["coefficient"]) is None else to_hex(scale(c / strongest)) for ray in rays]


def _targets(hulls: Sequence[Hull]) -> list[dict[str, Any]]:
    """Each target's name, vertices (m, rounded to 1e-5 of its size) and facets, MOST_FACETS in all at most."""
    total = sum(len(h.faces) for h in hulls)
    made = []
    for hull in hulls:
        count = min(len(hull.faces), max(1, len(hull.faces) * MOST_FACETS // max(total, 1)))
        faces = hull.faces[np.linspace(0, len(hull.faces) - 1, count).astype(int)] if count else hull.faces
        used, corner = np.unique(faces, return_inverse=True)
        vertices = hull.vertices[used]
        size = float(np.ptp(vertices, axis=0).max()) if len(vertices) else 1.0
        digits = int(np.clip(5 - np.floor(np.log10(size or 1.0)), 0, 12))
        made.append(
            {
                "name": hull.name,
                "vertices": np.round(vertices, digits).tolist(),
                "faces": corner.reshape(-1, 3).tolist(),
                "facets": len(hull.faces),
            }
        )
    return made
