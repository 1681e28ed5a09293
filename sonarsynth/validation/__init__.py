"""Error against run time: what is computed fast, against the same computed slowly, exactly and independently.

Each reference is a function that gives rows; `REFERENCES` names them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sonarsynth.validation.bodies.cylinder import cylinder_accuracy
from sonarsynth.validation.bodies.plate import plate_accuracy
from sonarsynth.validation.bodies.sphere import sphere_accuracy
from sonarsynth.validation.bubbles.all_bubbles import bubble_accuracy
from sonarsynth.validation.rays.eigenray_checks import ray_accuracy
from sonarsynth.validation.validation_rows import Row


def _sphere(quick: bool) -> list[Row]:
    return sphere_accuracy(quick)


def _cylinder(quick: bool) -> list[Row]:
    return cylinder_accuracy(quick)


def _plate(quick: bool) -> list[Row]:
    return plate_accuracy(quick)


def _bubble(quick: bool) -> list[Row]:
    return bubble_accuracy(quick)


REFERENCES: Final[dict[str, Callable[[bool], list[Row]]]] = {
    "rays": ray_accuracy,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "plate": _plate,
    "bubble": _bubble,
}
"""Rows of each reference; the argument is whether to be quick about it."""

__all__ = ["REFERENCES", "Row", "ray_accuracy"]
