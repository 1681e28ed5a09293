"""Stiff and extreme cases of every stage: what must come out, computed on its own, and what did."""

from __future__ import annotations

from collections.abc import Iterator

from sonarsynth.accuracy.extremes.outcomes import Case, Extreme, outcome, outcomes

__all__ = ["Case", "Extreme", "extremes", "groups", "outcome"]


def groups() -> dict[str, tuple[Case, ...]]:
    """All cases, by what they are about."""
    from sonarsynth.accuracy.extremes import bodies, bubbles, chain, facets, rays, signals, sources, targets

    return {
        "rays": rays.CASES,
        "signals": signals.CASES,
        "sources": sources.CASES,
        "targets": targets.CASES,
        "bodies": bodies.CASES,
        "facets": facets.CASES,
        "bubbles": bubbles.CASES,
        "chain": chain.CASES,
    }


def extremes(*, quick: bool = False) -> Iterator[Extreme]:
    """The rows of the table, as they are done; quick: without what takes minutes or gigabytes."""
    return outcomes(groups(), quick=quick)
