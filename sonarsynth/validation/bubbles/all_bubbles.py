"""Every row of the validation of bubbles."""

from __future__ import annotations

from importlib.util import find_spec

from sonarsynth.validation.bubbles.bubble_checks import frozen_rows, level_rows
from sonarsynth.validation.bubbles.bubbles_conserved import conserved_rows, rayleigh_rows
from sonarsynth.validation.bubbles.bubbles_extreme import extreme_rows
from sonarsynth.validation.bubbles.bubbles_logarithmic import logarithmic_rows
from sonarsynth.validation.bubbles.bubbles_solvers import solver_rows
from sonarsynth.validation.validation_rows import Row


def bubble_accuracy(quick: bool = False) -> list[Row]:
    """Errors and run times; quick: fewer gases, depths and tolerances. Raises ModuleNotFoundError without mpmath."""
    if find_spec("mpmath") is None:
        raise ModuleNotFoundError("the references for bubbles need mpmath: pip install 'sonarsynth[accuracy]'")
    return [
        *frozen_rows(quick),
        *rayleigh_rows(),
        *conserved_rows(quick),
        *level_rows(quick),
        *logarithmic_rows(quick),
        *solver_rows(quick),
        *extreme_rows(quick),
    ]
