"""Bellhop's arrivals, and our eigenrays beside them."""

from sonarsynth.validation.bellhop.arrivals_compared import RayComparison, compare_arrivals, comparison_table
from sonarsynth.validation.bellhop.arrivals_file import ArrivalsError, BellhopArrivals, read_arrivals

__all__ = [
    "ArrivalsError",
    "BellhopArrivals",
    "RayComparison",
    "compare_arrivals",
    "comparison_table",
    "read_arrivals",
]
