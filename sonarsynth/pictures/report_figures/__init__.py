"""A store as one page: what is in it, whether its splits are apart, how exact it is, and how hard."""

from __future__ import annotations

from sonarsynth.pictures.report_figures.report_numbers import numbers_of
from sonarsynth.pictures.report_figures.report_page import report

__all__ = ["numbers_of", "report"]
