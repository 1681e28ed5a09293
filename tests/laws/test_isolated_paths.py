"""Single paths of the link budget are found again in signals of each alone, and `verify` sees when they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from sonarsynth.evaluation import link_budget_adds_up, link_budget_measured
from sonarsynth.labels import family
from sonarsynth.pipeline import TracedFrame, beamform_frame, range_frame, trace_frame
from sonarsynth.pipeline.labelling import isolated_levels
from sonarsynth.planning import Choices, plan
from sonarsynth.scattering import Kirchhoff
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.isolated_paths import measured_levels
from tests.laws.test_ledger import LEVEL, SNAPS, SONAR, assert_it_adds_up, booked, some_paths, the_band, transfer
from tests.laws.test_synthesis import absorption
from tests.scenes import point_scene, remus


@pytest.mark.parametrize("method", [GriddedSynthesis(), DirectSum()], ids=["kernel", "direct"])
def test_each_isolated_path_is_found_in_its_signals(method: GriddedSynthesis | DirectSum) -> None:
    """Turned, blurred, rough, coherent over a facet, absorbed, stretched by Doppler, of another gain: all as said."""
    of = some_paths(160, 6)
    of = replace(of, doppler=np.random.default_rng(6).uniform(-5e-3, 5e-3, 160))
    budget = booked(of)
    found = np.isfinite(budget.isolated_level)
    assert (found == (budget.paths > 0)).all()
    measured = LEVEL[budget.isolated.snap] + measured_levels(method, budget.isolated, SNAPS, SONAR, absorption)
    assert np.abs(measured - budget.isolated_level[found]).max() < 0.02
    alone = [measured_levels(method, budget.isolated.select([e]), SNAPS, SONAR, absorption)[0] for e in range(3)]
    np.testing.assert_allclose(LEVEL[budget.isolated.snap[:3]] + alone, measured[:3], atol=5e-3)


@pytest.mark.parametrize(
    "extreme",
    [
        {"delay_std": 3e-5},  # 110 dB less
        {"absorption": 200.0},
        {"corner_delays": (-0.7e-3, -0.3e-3, 1e-3)},  # 400 rad over the facet
        {"corner_delays": (0.0, 0.0, 0.0)},
        {"doppler": -0.09},
        {"doppler": 1e-13},  # rounding: a transmitter on a sonar that moves
        {"coherent_fraction": 1.0, "height_delay_std": 1e-10},
        {"scattering": 1e-12},
    ],
    ids=str,
)
def test_extreme_paths_are_found_too(extreme: dict[str, float]) -> None:
    one = replace(some_paths(1, 9, coherent="corner_delays" in extreme), delay_std=np.zeros(1))
    one = replace(one, **{name: np.array([value]) for name, value in extreme.items()})
    product = one.scattering * one.spreading_out * one.spreading_in * one.boundary
    budget = booked(replace(one, amplitude=product * 10.0 ** (-one.absorption / 20.0)))
    level = LEVEL[one.snap] + measured_levels(GriddedSynthesis(), budget.isolated, SNAPS, SONAR, absorption)
    assert level == pytest.approx(budget.isolated_level[np.isfinite(budget.isolated_level)], abs=0.06)
    assert_it_adds_up(budget)


def test_the_isolated_path_is_the_loudest_and_silent_ones_are_none() -> None:
    of = some_paths(300, 7)
    loud = replace(of, delay_std=np.where(np.arange(300) % 2, 1e-3, of.delay_std))  # 1 ms of blur leaves nothing
    budget, band = booked(loud), the_band()
    each = (np.abs(transfer(loud, band.frequency, band.relative)) ** 2 * band.weight[loud.snap]).sum(axis=1)
    rows = np.argwhere(np.isfinite(budget.isolated_level))
    for n, (snap, target, kind) in enumerate(rows):
        mine = (loud.snap == snap) & (loud.target == target) & (family(loud) == kind)
        assert 10 * np.log10(each[mine].max()) + LEVEL[snap] == pytest.approx(
            budget.isolated_level[snap, target, kind], abs=0.02
        )
        assert budget.isolated.delay_std[n] < 1e-3
    silent = booked(replace(of, delay_std=np.full(300, 1e-3)))
    assert not np.isfinite(silent.isolated_level).any()
    assert (silent.paths == budget.paths).all()


def link_budget_tree(values: dict[tuple[str, str], np.ndarray]) -> xr.DataTree:
    dims = ("frame", "emission", "target", "family")
    group = {
        name: (dims[: 1 + array.ndim], array[None])
        for (where, name), array in values.items()
        if where == "/link_budget"
    }
    return xr.DataTree.from_dict({"/link_budget": xr.Dataset(group)})


@pytest.mark.parametrize("law", [None, Kirchhoff(), Kirchhoff(roughness=1e-3, diffuse=0.1)])
def test_a_frame_has_the_levels_that_its_link_budget_says_until_one_is_changed(law: Kirchhoff | None) -> None:
    recipe = remus() if law is None else point_scene((20.0, 4.0, -47.0), (15.0, -6.0, -56.0))
    if law is not None:
        scene = recipe.scene
        recipe = replace(recipe, scene=replace(scene, physics=replace(scene.physics, scattering=law)))
    made = plan(recipe, frozenset({"signals"}))
    traced = trace_frame(made, 0)

    def rows(of: TracedFrame) -> xr.DataTree:
        return link_budget_tree(range_frame(made, 0, of, beamform_frame(made, 0, of)))

    good = rows(traced)
    report = link_budget_measured(good, np.array([0]))
    assert report.ok and report.numbers["worst_db"] < 0.01 and report.numbers["paths"] == 2
    assert link_budget_adds_up(good, np.array([0])).ok
    facet = good["link_budget/isolated_facet"].values
    assert facet[0, 0, -1, 0] == -1 and 0 <= facet[0, 0, 0, 0] < len(traced.frame.moment.bodies[0].mesh.faces)
    alone = traced.budget.isolated
    louder = replace(alone, amplitude=1.02 * alone.amplitude)  # by 0.17 dB
    wrong = link_budget_measured(rows(replace(traced, budget=replace(traced.budget, isolated=louder))), np.array([0]))
    assert wrong.ok is False and wrong.numbers["worst_db"] == pytest.approx(0.172, abs=0.01)
    for asked, enough in ((0.01, False), (0.021, True)):
        tree = rows(replace(traced, budget=replace(traced.budget, isolated=louder)))
        tree.attrs["accuracy_signal"] = asked
        assert link_budget_measured(tree, np.array([0])).ok is enough
    good["link_budget/scattering"].values[0, 0, 0, 0] += 0.2
    assert link_budget_adds_up(good, np.array([0])).ok is False


def test_a_missing_level_is_a_fault_where_signals_are_stored() -> None:
    made = plan(point_scene((20.0, 4.0, -47.0), (15.0, -6.0, -56.0)), ("signals",), Choices())
    traced = trace_frame(made, 0)
    tree = link_budget_tree(range_frame(made, 0, traced, beamform_frame(made, 0, traced)))
    assert link_budget_measured(tree, np.array([0])).ok
    assert np.isfinite(tree["link_budget/isolated_level"].values).sum() == 2
    tree["link_budget/measured_level"].values[:] = np.where(
        np.arange(2)[:, None] > 0, isolated_levels(made, traced.frame, traced.budget, traced.truth.snap_level), np.nan
    )
    assert link_budget_measured(tree, np.array([0])).ok is False
    tree.attrs["products"] = ["signals"]
    tree["link_budget/measured_level"].values[:] = np.nan
    assert link_budget_measured(tree, np.array([0])).ok is False
    del tree["link_budget"]["measured_level"]
    assert link_budget_measured(tree, np.array([0])).ok is None
