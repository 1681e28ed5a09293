"""Errors of a plan are measured on some facets of large meshes, whose echoes are those that all facets have, and the
array is cut into no more parts than errors ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.planning import choosing, context_of
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
    for name in ("facet", "delay", "amplitude", "direction"):
        np.testing.assert_array_equal(getattr(some, name), getattr(third, name))
    np.testing.assert_array_equal(some.expansion.delay, third.expansion.delay)


def test_errors_of_some_facets_are_those_of_all(monkeypatch):
    """Of a mesh that is measured on a seventh of its facets, and on all: within a third."""
    recipe = ball(0.018)
    some = planning.plan(recipe, {"signals"}).errors
    monkeypatch.setattr(sampled_arrivals, "SAMPLE", 10**9)
    planning.choosing._CHOSEN.clear()
    whole = planning.plan(recipe, {"signals"}).errors
    assert some.uncut != whole.uncut
    np.testing.assert_allclose(some.uncut, whole.uncut, rtol=0.33)


@dataclass(frozen=True)
class Falling:
    """Errors that fall with the number of parts as they are told."""

    of: Callable[[int], float]
    tried: list[int] = field(default_factory=list)

    def error(self, parts, occlusion, faint=1.0):
        self.tried.append(parts)
        return self.of(parts)


def parts_for(errors, count=508, allowed=1.0):
    made = SimpleNamespace(
        elements=SimpleNamespace(count=count),
        scene=SimpleNamespace(physics=SimpleNamespace(dynamic_range="auto")),
        recipe=SimpleNamespace(accuracy=SimpleNamespace(cheap=0.1 * allowed)),
    )
    return choosing._finer(made, [errors], "centre", errors.of(1), allowed).parts


@pytest.mark.parametrize("count", [2, 9, 64, 508])
@pytest.mark.parametrize("whole", [1.5, 7.0, 90.0, 3e3])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_an_array_is_cut_into_the_fewest_parts_that_do(count, whole, power):
    """Of powers of two, by trying them all: where errors fall as a power of the number of parts, 2 at most."""
    enough = [2**n for n in range(10) if 2**n < count and whole * 2.0 ** (-power * n) <= 1.0]
    assert parts_for(Falling(lambda parts: whole * parts**-power), count) == min(enough, default=count)


def test_each_cut_is_tried_once_and_then_each_hydrophone_is_alone():
    """As in water whose layers are finer than the array, where halving is no gain until parts are of a few."""
    fine, never = Falling(lambda parts: 5.0 if parts < 100 else 0.5), Falling(lambda parts: 5.0)
    assert parts_for(fine) == 128 and fine.tried == [2, 4, 8, 16, 32, 64, 128]
    assert parts_for(never) == 508 and never.tried == [*fine.tried, 256]
