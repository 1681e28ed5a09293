"""Bellhop's arrivals, and our eigenrays beside them."""

from sonarsynth.validation.bellhop.arrivals_compared import compare_arrivals, comparison_table
from sonarsynth.validation.bellhop.arrivals_file import ArrivalsError, BellhopArrivals, read_arrivals

__all__ = [
    "ArrivalsError",
    "BellhopArrivals",
    "compare_arrivals",
    "comparison_table",
    "read_arrivals",
]
