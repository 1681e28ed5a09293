"""Clutter drawn for each sequence: rocks, pilings, chains, nets, schools of fish and clouds of bubbles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth.targets.meshes import mesh_of
from tests.scenes import remus

DEPTH, LAW = 10.0, ss.Isotropic(strength=1e-3)
UPRIGHT, ANY = ss.Upright(), ss.AnyOrientation()
RISE = ss.Upright(pitch=(np.pi / 2, np.pi / 2))
KINDS = {
    "rock": (ss.Box(size=(0.5, 0.4, 0.3), edge=0.1), None, ANY, True),
    "piling": (ss.Cylinder(radius=0.15, length=6.0, edge=0.15), None, RISE, True),
    "chain": (ss.Knots(rows=12, spacing=0.1), LAW, UPRIGHT, True),
    "net": (ss.Knots(rows=5, columns=8), LAW, UPRIGHT, False),
    "fish": (ss.School(members=20), LAW, UPRIGHT, False),
    "bubbles": (ss.School(axes=(0.3, 0.3, 0.6), members=40, radius=0.003), LAW, UPRIGHT, False),
}


def population(name: str) -> ss.Population:
    shape, law, lie, on_bottom = KINDS[name]
    return ss.Population(
        name=name,
        models=(ss.BodyModel(shape=shape, category="clutter", scattering=law),),
        least=1,
        most=2,
        clutter=True,
        on_bottom=on_bottom,
        orientation=lie,
        region=ss.Annulus(centre=(12.0, 0.0), outer=6.0, heights=(-6.0, -4.0)),
    )


@pytest.fixture(scope="module")
def cluttered() -> ss.Recipe:
    recipe = remus(1, array=ss.PlanarLattice(columns=6, rows=6, pitch=0.02))
    scene = recipe.scene
    world = replace(scene.world, targets=(), populations=tuple(map(population, KINDS)))
    return replace(recipe, scene=replace(scene, world=world))


@pytest.fixture(scope="module")
def store(cluttered: ss.Recipe, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clutter") / "clutter.zarr"
    ss.build(cluttered, path, products=("image",), workers=0)
    return path


def test_all_of_it_builds_and_verifies(store: Path) -> None:
    assert ss.verify(store).problems == ()


@pytest.mark.parametrize("kind", KINDS)
def test_each_is_drawn_and_labelled_as_clutter(store: Path, cluttered: ss.Recipe, kind: str) -> None:
    """Its category is clutter, one or two of it are in the water, on the bottom where they should be, and heard."""
    with xr.open_datatree(store, engine="zarr") as tree:
        truth = tree["truth/targets"].dataset.isel(frame=0)
        body = truth.sel(target=f"{kind}_1")
        assert int(body["present"]) == 1 and int(body["clutter"]) == 1
        assert truth["category"].attrs["flag_meanings"].split()[int(body["category"])] == "clutter"
        assert np.isfinite(float(body["echo_level"].max()))
    placed = next(b for b in cluttered.frame(0)[1].moment.bodies if b.name == f"{kind}_1")
    heights = placed.pose.to_world(placed.mesh.vertices)[:, 2]
    assert heights.min() > -DEPTH and heights.max() < 0.0
    if KINDS[kind][3]:
        assert heights.min() < -DEPTH + 2e-3
    if kind == "piling":
        assert np.ptp(heights) == pytest.approx(6.0)


@pytest.mark.parametrize(("shape", "count"), [(ss.Knots(rows=3, columns=2), 6), (ss.School(members=40), 40)])
def test_each_piece_is_closed_and_shows_four_facets(shape: ss.Knots | ss.School, count: int) -> None:
    """Whatever the direction: so that its level is that of four facets, and the shape has the size that it says."""
    mesh = mesh_of(shape)
    assert len(mesh.faces) == 8 * count
    assert mesh.area @ mesh.normal == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    outward = mesh.centroid - mesh.vertices.reshape(count, 6, 3).mean(axis=1).repeat(8, axis=0)
    assert (np.einsum("fi,fi->f", mesh.normal, outward) > 0.0).all()
    towards = np.random.default_rng(1).standard_normal((20, 3))
    assert ((mesh.normal @ towards.T > 0.0).sum(axis=0) == 4 * count).all()
    if isinstance(shape, ss.School):
        inside = ((mesh.vertices.reshape(count, 6, 3).mean(axis=1) / shape.axes) ** 2).sum(axis=1)
        assert inside.max() <= 1.0 and mesh_of(replace(shape, arrangement=1)).digest != mesh.digest
