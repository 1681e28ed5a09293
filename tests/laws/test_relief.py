"""The relief of the bottom scatters and hides as a body does; a flat one is none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from sonarsynth.description import FieldError
from sonarsynth.geometry.motion import Still
from sonarsynth.pipeline import trace_frame
from sonarsynth.planning import plan
from sonarsynth.products import Arrivals
from sonarsynth.products.paths import FAMILIES
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.populations.population import BodyModel, Population
from sonarsynth.recipe.populations.regions import BoxRegion
from sonarsynth.recipe.rising_bottom import relief_of
from sonarsynth.recipe.scene import Physics
from sonarsynth.scattering import MirrorLobe
from sonarsynth.targets.relief import BOTTOM, Relief, highest_within
from sonarsynth.targets.shapes import Box, MeshFile, Sphere
from sonarsynth.targets.target import Target
from tests.scenes import remus

X, Y = np.linspace(4.0, 16.0, 13), np.linspace(-6.0, 6.0, 13)
STEP = 1e-4  # m, of the ground that the wall of a box-shaped rise takes


def sea(path: Path | None, *more: Target, edge: float | None = 0.2, mirrors: bool = False) -> Recipe:
    """A ball 20 m ahead, heard over a bottom with a relief; nothing is left out of its echoes."""
    recipe = remus(1)
    scene, vehicle = recipe.scene, recipe.scene.world.targets[0]
    vehicle = replace(
        vehicle, shape=Sphere(radius=0.4, edge=0.15), motion=Still(position=(20.0, 0.0, -8.0), heading=0.0)
    )
    relief = None if path is None else Relief(shape=MeshFile(path=str(path), edge=edge))
    world = replace(scene.world, targets=(vehicle, *more), relief=relief)
    tracing = {"kind": "straight", "bounces": 1} if mirrors else {"kind": "straight", "bounces": 0}
    physics = Physics(tracing=tracing, scattering=MirrorLobe(), subarrays=1, occlusion="centre", doppler=False)
    return replace(recipe, scene=replace(scene, world=world, physics=physics))


def grid(path: Path, height, x=X, y=Y) -> Path:
    np.savez(path, x=x, y=y, z=height(*np.meshgrid(x, y)))
    return path


def paths(recipe: Recipe) -> tuple[Arrivals, tuple[str, ...]]:
    return trace_frame(plan(recipe, {"signals"}), 0).arrivals, tuple(t.name for t in recipe.scene_of(0).world.targets)


def energy(found: Arrivals, target: int) -> float:
    return float(np.sum(found.amplitude[found.target == target] ** 2))


@pytest.mark.parametrize(
    "height", [lambda x, y: 0 * x, lambda x, y: -0.5 - 0.1 * np.sin(x), lambda x, y: 0.099 * np.cos(x)]
)
def test_what_does_not_rise_changes_nothing(tmp_path, height) -> None:
    found, names = paths(sea(grid(tmp_path / "flat.npz", height), mirrors=True))
    silent, _ = paths(sea(None, mirrors=True))
    assert names == ("remus",)
    np.testing.assert_array_equal(found.delay, silent.delay)
    np.testing.assert_array_equal(found.amplitude, silent.amplitude)


def test_a_ridge_hides_what_is_behind_it(tmp_path) -> None:
    """The ball is at 8 m of 10, the array at 5: a ridge half way hides it from 3.5 m on, and not from 1.5 m."""
    seen = paths(sea(None))[0]
    for height, hidden in ((1.5, False), (4.5, True)):
        ridge = grid(tmp_path / f"{height}.npz", lambda x, y, h=height: h * np.maximum(1 - np.abs(x - 10), 0))
        found, names = paths(sea(ridge, edge=0.5))
        assert names == ("remus", "bottom")
        assert energy(found, 0) == (0.0 if hidden else pytest.approx(energy(seen, 0), rel=1e-12))


@pytest.mark.parametrize("kind", ["npz", "csv", "nc", "stl"])
def test_a_rise_like_a_box_is_a_box(tmp_path, kind) -> None:
    """One 2 by 3 by 1.5 m, from every format: the energy of its facets is that of a box on the bottom."""
    size, path = np.array([2.0, 3.0, 1.5]), tmp_path / f"box.{kind}"
    x, y = (np.array([-0.5 * s - STEP, -0.5 * s, 0.5 * s, 0.5 * s + STEP]) for s in size[:2])
    z = np.zeros((4, 4))
    z[1:3, 1:3] = size[2]
    if kind == "npz":
        np.savez(path, x=x + 10.0, y=y, depth=-z)
    elif kind == "csv":
        rows = [f"{b:.9g};{a + 10.0:.9g};{z[j, i]:g}" for i, a in enumerate(x) for j, b in enumerate(y)]
        path.write_text("\n".join(["north (m);east (m);height (m)", *rows]))
    elif kind == "nc":
        import xarray as xr

        xr.DataArray(z.T, {"x": x + 10.0, "y": y}, ("x", "y"), "elevation", {"units": "m"}).to_netcdf(
            path, engine="scipy"
        )
    else:
        trimesh.creation.box(size, trimesh.transformations.translation_matrix([10.0, 0.0, 0.5 * size[2]])).export(path)
    mesh = relief_of(sea(path, edge=0.1).scene_of(0))
    np.testing.assert_allclose(mesh.box, [[9.0, -1.5, 0.0], [11.0, 1.5, 1.5]], atol=2 * STEP)
    assert mesh.area.sum() == pytest.approx(2 * 3 + 1.5 * 10, rel=1e-3)  # without its lower side
    assert mesh.area @ mesh.normal == pytest.approx([0.0, 0.0, 6.0], abs=1e-2)
    if kind != "npz":
        return
    body = Target(
        name="box", shape=Box(size=tuple(size), edge=0.1), motion=Still(position=(10.0, 0.0, -9.25), heading=np.pi / 2)
    )
    rise, box = paths(sea(path, edge=0.1, mirrors=True))[0], paths(sea(None, body, mirrors=True))[0]
    assert energy(rise, 1) == pytest.approx(energy(box, 1), rel=0.05)
    assert energy(rise, 0) == pytest.approx(energy(box, 0), rel=1e-3)


def test_bodies_lie_on_it(tmp_path) -> None:
    path = grid(tmp_path / "hill.npz", lambda x, y: 3.0 * np.exp(-((x - 10) ** 2 + y**2) / 8))
    rocks = Population(
        name="rock",
        models=(BodyModel(shape=Box(size=(0.4, 0.3, 0.2))),),
        least=6,
        most=6,
        on_bottom=True,
        region=BoxRegion(low=(6.0, -4.0, -9.0), high=(14.0, 4.0, -9.0)),
    )
    recipe = sea(path)
    scene = replace(recipe.scene, world=replace(recipe.scene.world, populations=(rocks,)))
    scene = replace(recipe, scene=scene).scene_of(0)
    drawn = [target.motion.position for target in scene.world.targets if target.name.startswith("rock")]
    ground = [highest_within(relief_of(scene), np.array(place[:2]), 0.0) for place in drawn]
    over = np.array([z for *_, z in drawn]) + 10.0 - 0.1 - ground  # their lowest points
    assert np.ptp(ground) > 0.5
    assert (over > 0.0).all() and (over < 0.5).all()


@pytest.mark.parametrize(("middle", "hidden"), [(14.0, 1), (6.0, 0)])
def test_the_plan_says_which_mirror_reflections_a_relief_takes(tmp_path, middle: float, hidden: int) -> None:
    """The ball is 20 m ahead, 2 m over the bottom, the array 5 m over it: by the bottom at 14.3 m, or not at all."""
    hill = grid(tmp_path / "hill.npz", lambda x, y: 0.5 * (np.hypot(x - middle, y) < 1.5))
    made, silent = plan(sea(hill, edge=0.5, mirrors=True), {"signals"}), paths(sea(None, mirrors=True))[0]
    bound = next(row.bound for row in made.left_out if row.what == "relief in mirror reflections")
    assert bound.startswith(f"of the first frame's 3 by the bottom {hidden} are under it: lost")
    found = trace_frame(made, 0).arrivals
    by_bottom = [a.select((a.arrives_by == FAMILIES.index("bottom")) & (a.target == 0)) for a in (found, silent)]
    assert energy(by_bottom[0], 0) == (0.0 if hidden else pytest.approx(energy(by_bottom[1], 0), rel=1e-12))


def test_a_file_that_changes_is_seen_by_sequences_that_are_drawn(tmp_path) -> None:
    path = grid(tmp_path / "hill.npz", lambda x, y: 0.5 + 0 * x)
    recipe = replace(sea(path), repeats=2)
    before = recipe.scene_of(1)
    assert recipe.scene_of(1) is before
    grid(path, lambda x, y: 0 * x, X[:-1])  # another size: clocks of files are coarse
    assert BOTTOM in before.world.target_names and BOTTOM not in recipe.scene_of(1).world.target_names


@pytest.mark.parametrize(("kind", "reason"), [("linked", "lies in another file"), ("vast", "numbers 'z', more than")])
def test_no_grid_is_read_from_elsewhere_or_past_memory(tmp_path: Path, kind: str, reason: str) -> None:
    h5py, path = pytest.importorskip("h5py"), tmp_path / "grid.nc"
    with h5py.File(path, "w") as file:
        if kind == "linked":
            file["z"] = h5py.ExternalLink("other.nc", "z")
        else:
            file.create_dataset("z", (10**7, 10**7), "f4", chunks=(1000, 1000))
    with pytest.raises(FieldError, match=reason):
        sea(path).scene_of(0)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.csv", "x,y,z\n0,0,1\n1,0,1\n0,1,1\n", "3 rows that do not fill a grid: 2 different x, 2 different y"),
        ("b.csv", "x,y,z\n0,0,1\n1,0,one\n", "line 3: is not a row of numbers"),
        ("c.csv", "lon,lat,z\n0,0,1\n", "line 1: names lon, lat, z are not x, y and z"),
        ("d.npz", "PK nothing", "cannot be read as npz"),
        ("e.nc", "CDF nothing", "cannot be read as netCDF"),
        ("f.csv", "0 0 11\n1 0 11\n0 1 11\n1 1 11\n", "rises 11 m over a bottom that is 10 m deep"),
        ("g.csv", "0 0 1\n1 0 nan\n0 1 1\n1 1 1\n", "no height at 1 of 4 points, the first at x 1, y 0"),
    ],
)
def test_what_is_no_relief_is_refused_in_a_line(tmp_path, name, content, reason) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(FieldError, match=reason) as error:
        sea(path).scene_of(0)
    assert str(path) in str(error.value) and "relief" in str(error.value.path)
