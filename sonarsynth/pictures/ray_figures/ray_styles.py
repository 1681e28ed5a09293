"""How rays look in every picture of them: colour, line, and the name in the legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sonarsynth.pictures.figures.style import ERROR_MAP, RAYS
from sonarsynth.products import FAMILIES

FAN = "fan"
MISS = "#9a9a9a"
COLOURS = dict(zip(FAMILIES, RAYS, strict=False))
MARKERS = {"surface": "^", "bottom": "v", "turning point": "o", "target": "X", "facet": "X"}
"""Marks of vertices."""
SHADES = 16
"""Steps of colour of the coefficients."""


@dataclass(frozen=True, eq=False)
class Look:
    """What decides how a ray is drawn."""

    family: str  # of FAMILIES, or FAN
    hidden: bool  # behind a target: dashed
    event: tuple[str, ...]  # (point,): those in MARKERS are marked
    coefficient: float  # of the scattering law, of a ray sent on from a target; NaN: none


@dataclass(frozen=True)
class Style:
    """How a ray is drawn."""

    colour: str
    label: str
    width: float
    hidden: bool
    marked: bool  # its vertices are


def styles(looks: Sequence[Look]) -> list[Style]:
    """Style of each ray: eigenrays by family, rays sent on by coefficient, few others in turn, many by hit and miss."""
    strongest = highest_coefficient(looks)
    fan = [i for i, look in enumerate(looks) if look.family == FAN]
    turns = {i: n for n, i in enumerate(fan)} if len(fan) <= len(RAYS) and not strongest else {}
    return [_style(look, turns.get(i), strongest) for i, look in enumerate(looks)]


def highest_coefficient(looks: Sequence[Look]) -> float:
    """The largest coefficient of rays that were sent on from a target; 0 where none was."""
    coefficients = [look.coefficient for look in looks if np.isfinite(look.coefficient)]
    return max(coefficients, default=0.0)


def _style(look: Look, turn: int | None, strongest: float) -> Style:
    if look.family != FAN:
        return Style(COLOURS[look.family], look.family, 1.1, look.hidden, True)
    if np.isfinite(look.coefficient):
        from matplotlib import colormaps
        from matplotlib.colors import to_hex

        shade = np.ceil(SHADES * look.coefficient / (strongest or 1.0)) / SHADES
        return Style(to_hex(colormaps[ERROR_MAP](shade)), "sent on to the snap", 0.9, False, False)
    if turn is not None:
        return Style(RAYS[turn], f"ray {turn}", 1.1, False, True)
    if "facet" in look.event:
        return Style(RAYS[1], "meets a target", 0.8, False, False)
    return Style(MISS, "meets no target", 0.5, False, False)


def drawing_order(looks: Sequence[Look]) -> list[int]:
    """Misses first, weak before strong, many vertices before few: what matters most is drawn last, on top."""

    def rank(i: int) -> tuple[bool, bool, float, int]:
        look = looks[i]
        vertices = sum(event in MARKERS for event in look.event)
        return look.family != FAN, "facet" in look.event, float(np.nan_to_num(look.coefficient)), -vertices

    return sorted(range(len(looks)), key=rank)
