"""Collapsing bubbles against series, closed forms and tables."""

from __future__ import annotations

from importlib.util import find_spec

from sonarsynth.validation.bubbles.bubble_checks import equation_rows, level_rows, tolerance_rows
from sonarsynth.validation.bubbles.bubbles_logarithmic import logarithmic_rows
from sonarsynth.validation.validation_rows import Row


def bubble_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times; quick: fewer gases, depths and tolerances. Raises ModuleNotFoundError without mpmath."""
    if find_spec("mpmath") is None:
        raise ModuleNotFoundError("the references for bubbles need mpmath: pip install 'sonarsynth[accuracy]'")
    every = (equation_rows, tolerance_rows, level_rows, logarithmic_rows)
    return [row for rows in every for row in rows(quick)]
