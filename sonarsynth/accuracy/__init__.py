"""Error against run time: what is computed fast, against the same computed slowly, exactly and independently.

Each reference is a function that gives rows; `REFERENCES` names them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sonarsynth.accuracy.rays import ray_accuracy
from sonarsynth.accuracy.rows import Row

REFERENCES: Final[dict[str, Callable[[bool], list[Row]]]] = {"rays": ray_accuracy}
"""Rows of each reference; the argument is whether to be quick about it."""

__all__ = ["REFERENCES", "Row", "ray_accuracy"]
