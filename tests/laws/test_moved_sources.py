"""A frame with its source moved over traced paths is the frame of a recipe that has the source there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.environment.sea import Linear
from sonarsynth.planning import plan
from sonarsynth.recipe import Recipe
from sonarsynth.scattering import Isotropic
from sonarsynth.sources.snap_models import Ricker
from sonarsynth.sources.sound_source import SoundSource
from sonarsynth.tracing import facet_paths
from tests.laws.test_stored_paths import SPEED, paths_of, still
from tests.scenes import remus

NEAR, FAR = ss.SnappingShrimp(position=(15.0, -4.0)), ss.SnappingShrimp(position=(26.0, 6.0), source_level=180.0)
OTHER = ss.SnappingShrimp(position=(14.0, -5.0), snap=Ricker(frequency=40e3))


def with_world(recipe: Recipe, **changes: Any) -> Recipe:
    return replace(recipe, scene=replace(recipe.scene, world=replace(recipe.scene.world, **changes)))


def in_bent_water(signal: float = 1e-5) -> Recipe:
    """The body at rest, its echoes by surface and bottom too, in water that bends rays."""
    recipe = still(bounces=1, signal=signal)
    water = replace(recipe.scene.world.environment, sound_speed=Linear(surface_speed=1540.0, gradient=-1.0))
    return with_world(recipe, environment=water)


@pytest.mark.parametrize("recipe", [still(), in_bent_water()], ids=["uniform", "bent"])
def test_of_bodies_at_rest_paths_and_sound_are_those_of_the_recipe_with_the_source_there(recipe: Recipe) -> None:
    made = plan(recipe, {"signals", "paths"})
    for source, tree in zip((NEAR, FAR, OTHER), ss.with_sources(made, 0, (NEAR, FAR, OTHER)), strict=True):
        facet_paths.way_to_array.cache_clear()
        fresh = ss.render(plan(with_world(recipe, sources=(source,)), made.products, made.choices), 0)
        for name in ("delay", "azimuth", "amplitude", "phase", "facet", "family"):
            count = int(fresh["paths"]["count"])
            assert np.array_equal(tree["paths"][name][:count], fresh["paths"][name][:count]), name
        assert int(tree["paths"]["count"]) == count > 100
        assert np.array_equal(tree["signals/pressure"], fresh["signals/pressure"])
        assert tree["truth/emissions"].equals(fresh["truth/emissions"])


def test_of_a_body_that_moves_they_agree_within_the_accuracy() -> None:
    recipe = remus(1)
    made = plan(recipe, {"signals"})
    for source, tree in zip((NEAR, FAR), ss.with_sources(made, 0, (NEAR, FAR)), strict=True):
        fresh = ss.render(plan(with_world(recipe, sources=(source,)), made.products, made.choices), 0)["signals"]
        moved, there = tree["signals/pressure"].to_numpy(), fresh["pressure"].to_numpy()
        late = np.arange(there.shape[1]) / recipe.scene.sonar.sampling_frequency
        echo = late > late[np.abs(there).max(axis=0).argmax()] + 1e-3  # after the direct pulse
        assert np.abs(moved - there)[:, echo].max() < recipe.accuracy.signal * np.abs(there[:, echo]).max()


@pytest.mark.parametrize("move", [0.1, 1.0, 12.0])
def test_paths_of_one_place_of_the_source_are_carried_to_another_by_the_length_of_their_ways_to_it(move: float) -> None:
    """Of facets that send the same all round: what a source elsewhere changes is that, and which facets it lights."""
    recipe = still(signal=1e-3)
    recipe = replace(recipe, scene=replace(recipe.scene, physics=replace(recipe.scene.physics, scattering=Isotropic())))
    made, there = plan(recipe, ["paths"]), (15.0 - 0.6 * move, -4.0 - 0.8 * move)
    trees = ss.with_sources(made, 0, [NEAR, ss.SnappingShrimp(position=there)])
    frame = made.frame(0)
    mesh, pose = frame.moment.bodies[0].mesh, frame.moment.bodies[0].pose
    middle, normal = pose.to_world(mesh.centroid), pose.turn_to_world(mesh.normal)
    sources = [tree["truth/emissions"]["position"].to_numpy()[0] for tree in trees]
    before, after = (paths_of(tree) for tree in trees)
    before, after = (of.isel(path=np.flatnonzero(of.target.to_numpy() == 0)) for of in (before, after))
    both, n, m = np.intersect1d(before.facet, after.facet, return_indices=True)
    out, moved = (np.linalg.norm(middle[both] - source, axis=1) for source in sources)
    assert len(both) > 100
    assert np.allclose(after.delay[m], before.delay[n] + (moved - out) / SPEED, rtol=0.0, atol=1e-12)
    assert np.allclose(after.amplitude[m] * moved, before.amplitude[n] * out, rtol=1e-6)
    new = after.facet.to_numpy()
    assert np.all(np.sum((sources[1] - middle[new]) * normal[new], axis=1) > 0.0)  # others are dark there
    assert set(new.tolist()) != set(before.facet.to_numpy().tolist())


def test_the_way_to_the_array_is_traced_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls, trace_facets = list[int](), facet_paths.facet_paths

    def counted(*args: Any, **named: Any) -> Any:
        calls.append(1)
        return trace_facets(*args, **named)

    straight, bent = plan(still(signal=1e-3), ["paths"]), plan(in_bent_water(signal=1e-3), ["paths"])
    facet_paths.way_to_array.cache_clear()
    monkeypatch.setattr(facet_paths, "facet_paths", counted)
    assert len(ss.with_sources(straight, 0, (NEAR, FAR, OTHER))) == 3 and len(calls) == 1
    for source in (NEAR, FAR, OTHER):  # where rays bend, of one call after the other too
        assert ss.with_sources(bent, 0, [source]) and len(calls) == 2
    axes = (ss.Axis(name="east", path="scene.world.sources.0.position.0", values=(13.0, 14.0, 15.0)),)
    places = plan(replace(in_bent_water(signal=1e-3), grid=axes), ["paths"])
    calls.clear()
    facet_paths.way_to_array.cache_clear()
    paths = [ss.render(places, index)["paths"].dataset for index in range(3)]
    assert len(calls) == 1 and not paths[0].equals(paths[1])


def test_of_a_store_with_the_sources_of_its_recipe_the_frame_is_that_of_the_store(tmp_path: Path) -> None:
    recipe = still(signal=1e-3)
    ss.build(recipe, tmp_path / "paths.zarr", products=["paths"], workers=0)
    store = ss.open(tmp_path / "paths.zarr")
    own: tuple[SoundSource, ...] = recipe.scene.world.sources
    (same,) = ss.with_sources(store, 0, [own])
    count = int(same["paths"]["count"])
    stored = store["paths"].dataset.isel(frame=0, path=slice(count))
    assert same["paths"].dataset.drop_vars("frame", errors="ignore").equals(stored.drop_vars("frame", errors="ignore"))
    (heard,) = ss.with_sources(store, 0, [FAR], products={"signals"})
    assert np.abs(heard["signals/pressure"]).max() > 0.0 and "recipe_digest" not in heard.attrs


def test_what_the_recipe_varies_of_its_sources_is_not_said_of_others() -> None:
    axes = (ss.Axis(name="east", path="scene.world.sources.0.position.0", values=(13.0, 14.0)),)
    (tree,) = ss.with_sources(plan(replace(still(signal=1e-3), grid=axes), ["paths"]), 1, [NEAR])
    assert "east" not in tree.variables and int(tree["trajectory"]) == 1
    assert np.allclose(tree["truth/emissions"]["position"][0, :2], NEAR.position[:2])


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (ss.SnappingShrimp(position=(15.0, -4.0, -11.0)), "outside the water"),
        (ss.SnappingShrimp(position=(20.0, 1.0, -4.5)), "remus"),
    ],
)
def test_a_source_out_of_the_water_or_in_a_body_is_refused(source: SoundSource, message: str) -> None:
    with pytest.raises(ss.FieldError, match=message):
        ss.with_sources(plan(still(signal=1e-3), ["paths"]), 0, [source])


def test_a_source_from_where_sound_bends_more_than_the_plan_follows_is_refused() -> None:
    recipe = remus(1)
    water = replace(recipe.scene.world.environment, sound_speed=Linear(surface_speed=1540.0, gradient=-2e-4))
    recipe = with_world(recipe, environment=water)
    with pytest.raises(ss.FieldError, match="more than this plan follows"):
        ss.with_sources(plan(recipe, ["paths"]), 0, [ss.SnappingShrimp(position=(600.0, 0.0))])
