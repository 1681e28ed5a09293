"""Errors of a plan are measured on some facets of large meshes: their echoes are those that all facets have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth import planning
from sonarsynth.planning import context_of
from sonarsynth.planning.measured import sampled_arrivals
from sonarsynth.targets.shapes import Sphere
from sonarsynth.tracing.arrivals import trace
from tests.scenes import point_scene


def ball(edge):
    """A ball that hides its own back, 20 m ahead."""
    recipe = point_scene((20.0, 0.0, -50.0), (6.0, 9.0, -45.0))
    one = replace(recipe.scene.world.targets[0], shape=Sphere(radius=0.5, edge=edge))
    return replace(recipe, scene=replace(recipe.scene, world=replace(recipe.scene.world, targets=(one,))))


def test_every_third_facet_echoes_as_among_all():
    """Bit for bit, but for what is too faint beside others: and all facets hide what is behind them."""
    made = planning.plan(ball(0.1), {"signals"})
    context = context_of(made, made.recipe.frame(0)[1])
    context = replace(context, tolerances=replace(context.tolerances, negligible=0.0))
    every = trace(context, made.propagation)
    some = trace(replace(context, tolerances=replace(context.tolerances, every=3)), made.propagation)
    third = every.select(every.direct | (every.facet % 3 == 0))
    assert 50 < len(some.facet) < 0.4 * len(every.facet)
    for name in ("facet", "delay", "amplitude", "direction", "delay_terms"):
        np.testing.assert_array_equal(getattr(some, name), getattr(third, name))


def test_errors_of_some_facets_are_those_of_all(monkeypatch):
    """Of a mesh that is measured on a seventh of its facets, and on all: within a third."""
    recipe = ball(0.018)
    some = planning.plan(recipe, {"signals"}).errors
    monkeypatch.setattr(sampled_arrivals, "SAMPLE", 10**9)
    planning.choosing._CHOSEN.clear()
    whole = planning.plan(recipe, {"signals"}).errors
    assert some.whole != whole.whole
    np.testing.assert_allclose(some.whole, whole.whole, rtol=0.33)
