"""Stiff and extreme cases of every stage: what must come out, computed on its own, and what did."""

from __future__ import annotations

from collections.abc import Iterator

from sonarsynth.validation.extremes import (
    extreme_bodies,
    extreme_bubbles,
    extreme_chains,
    extreme_facets,
    extreme_images,
    extreme_rays,
    extreme_signals,
    extreme_sources,
    extreme_targets,
)
from sonarsynth.validation.extremes.outcomes import Case, Extreme, outcome

__all__ = ["Case", "Extreme", "extremes", "groups", "outcome"]


def groups() -> dict[str, tuple[Case, ...]]:
    """All cases, by what they are about."""
    return {
        "rays": extreme_rays.CASES,
        "signals": extreme_signals.CASES,
        "sources": extreme_sources.CASES,
        "targets": extreme_targets.CASES,
        "bodies": extreme_bodies.CASES,
        "facets": extreme_facets.CASES,
        "bubbles": extreme_bubbles.CASES,
        "images": extreme_images.CASES,
        "chain": extreme_chains.CASES,
    }


def extremes() -> Iterator[Extreme]:
    """The rows of the table, as they are done."""
    return (outcome(group, case) for group, cases in groups().items() for case in cases)
