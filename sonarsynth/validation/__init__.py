"""Error against run time: what is computed fast, against the same computed slowly, exactly and independently.

Each reference is a function that gives rows; `REFERENCES` names them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sonarsynth.validation.bodies.cylinder import cylinder_accuracy
from sonarsynth.validation.bodies.plate import plate_accuracy
from sonarsynth.validation.bodies.sphere import sphere_accuracy
from sonarsynth.validation.bubbles import bubble_accuracy
from sonarsynth.validation.rays.eigenray_checks import ray_accuracy
from sonarsynth.validation.validation_rows import Row

REFERENCES: Final[dict[str, Callable[[bool], list[Row]]]] = {
    "rays": ray_accuracy,
    "sphere": sphere_accuracy,
    "cylinder": cylinder_accuracy,
    "plate": plate_accuracy,
    "bubble": bubble_accuracy,
}
"""Rows of each reference; the argument is whether to be quick about it."""

__all__ = ["REFERENCES", "Row", "ray_accuracy"]
