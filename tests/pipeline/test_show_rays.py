"""Rays to look at: what is drawn, printed and written of a frame is what the closed form says."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.description import FieldError
from sonarsynth.environment.boundaries import FluidHalfSpace, SeaBottom
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Tabulated
from sonarsynth.equations.water.boundary_reflection import rayleigh
from sonarsynth.geometry.motion import Still
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.ray_figure import COLOURS
from sonarsynth.pictures.figures.ray_page import MOST_FACETS, page
from sonarsynth.pictures.ray_pictures import ray_lines, show_rays, table
from sonarsynth.propagation.ray_request import EigenrayRequest, RayRequest
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Box
from sonarsynth.targets.target import Target
from tests.waiting import HANGING

SNAP, ARRAY, TARGET = np.array([30.0, 10.0, -14.0]), np.array([0.0, 0.0, -6.0]), np.array([40.0, -8.0, -9.0])
BOTTOM_DEPTH = FluidHalfSpace(density_ratio=1.9, speed_ratio=1.15, loss_tangent=0.01)


def box(place: np.ndarray, size: float = 1.0) -> Target:
    shape = Box(size=(size, size, size), edge=size)
    return Target(name="box", shape=shape, motion=Still(position=tuple(place), heading=0.5 * np.pi))


def recipe(rays: RayRequest | None = None, *, target: np.ndarray = TARGET, size: float = 1.0, **more: Any) -> Recipe:
    sea = {
        "depth": 20.0,
        "sound_speed": Isovelocity(speed=1500.0),
        "bottom": SeaBottom(reflection=BOTTOM_DEPTH),
        "absorption": Absorption(formula="none"),
    }
    world: dict[str, Any] = {"sources": (SnappingShrimp(position=tuple(SNAP), source_level=190.0),)} | more
    sonar = Still(position=tuple(ARRAY), heading=0.5 * np.pi)
    environment = Environment(**sea | world.pop("environment", {}))
    made = World(environment=environment, targets=(box(target, size),), **world)
    return Recipe(
        title="A box & a </script> snap", scene=Scene(world=made, trajectory=Trajectory(sonar=sonar)), rays=rays
    )


def lines_of(asked: Recipe) -> list[Any]:
    plan = planning.plan(asked)
    return ray_lines(plan, plan.recipe.frame(0)[1], 0)


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Path], str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("rays")
    files, text = show_rays(planning.plan(recipe()), 0, folder)
    return {f.name: f for f in files}, text, json.loads((folder / "rays.json").read_text())


def image(place: np.ndarray, *mirrors: float) -> np.ndarray:
    """A point seen in mirrors at depths, the first one first."""
    for depth in mirrors:
        place = place * [1, 1, -1] - [0, 0, 2.0 * depth]
    return place


def test_without_a_request_the_eigenrays_of_the_frame_are_drawn(shown: tuple[dict[str, Path], str, Any]) -> None:
    from PIL import Image

    files, text, value = shown
    assert set(files) == {"section.png", "space.png", "rays.html", "rays.json"}
    for name in ("section.png", "space.png"):
        with Image.open(files[name]) as drawn:
            assert min(drawn.size) > 400
    heard = [ray for ray in value["rays"] if ray["name"] == "snap 0 to array"]
    assert sorted(ray["vertices"] for ray in heard) == ["-", "B", "B-S", "S", "S-B"]
    echoes = [ray["vertices"] for ray in value["rays"] if ray["name"] == "snap 0 to box to array"]
    assert len(echoes) == len(set(echoes)) == 13  # every way to share at most two reflections between the two legs
    assert len(text.splitlines()) == 1 + 5 + 13 + 3


def test_paths_times_and_angles_are_those_of_image_sources(shown: tuple[dict[str, Path], str, Any]) -> None:
    mirrors = {"-": [], "S": [0.0], "B": [20.0], "S-B": [0.0, 20.0], "B-S": [20.0, 0.0]}
    seen = 0
    for ray in shown[2]["rays"]:
        np.testing.assert_allclose(ray["position"][0], SNAP, atol=1e-12)
        np.testing.assert_allclose(ray["position"][-1], ARRAY, atol=1e-12)
        out, _, back = ray["vertices"].partition("X")
        legs = [(SNAP, ARRAY, ray["vertices"])]
        if "X" in ray["vertices"]:
            legs = [(SNAP, TARGET, out.strip("-") or "-"), (TARGET, ARRAY, back.strip("-") or "-")]
        length = sum(float(np.linalg.norm(b - image(a, *mirrors[way]))) for a, b, way in legs)
        assert ray["path_length"] == pytest.approx(length, rel=1e-12)
        assert ray["travel_time"] == pytest.approx(length / 1500.0, rel=1e-12)
        last = legs[-1]
        arriving = last[1] - image(last[0], *mirrors[last[2]])
        assert ray["arrival_elevation"] == pytest.approx(np.arcsin(arriving[2] / np.linalg.norm(arriving)), abs=1e-12)
        seen += 1
    assert seen == 18


def test_transmission_loss_is_that_of_spreading_and_rayleighs_coefficient(
    shown: tuple[dict[str, Path], str, Any],
) -> None:
    rays = {ray["vertices"]: ray for ray in shown[2]["rays"]}
    for vertices, bounced in (("-", 0), ("S", 0), ("B", 1), ("S-B", 1), ("B-S", 1)):
        ray = rays[vertices]
        v = rayleigh(
            abs(ray["launch_elevation"]),
            BOTTOM_DEPTH.density_ratio,
            BOTTOM_DEPTH.speed_ratio,
            BOTTOM_DEPTH.loss_tangent,
        )
        loss = 20 * np.log10(ray["path_length"]) - bounced * 20 * np.log10(abs(v))
        assert ray["transmission_loss"] == pytest.approx(loss, abs=1e-9)
        assert ray["level"] == pytest.approx(190.0 - loss, abs=1e-9)
    both = np.linalg.norm(TARGET - SNAP), np.linalg.norm(ARRAY - TARGET)
    assert rays["X"]["transmission_loss"] == pytest.approx(20 * np.log10(both[0] * both[1]), abs=1e-9)


def test_bent_rays_turn_where_the_speed_is_that_of_their_slowness() -> None:
    speed = Tabulated(depth=(0.0, 10.0, 20.0), speed=(1510.0, 1480.0, 1510.0))
    snap = (SnappingShrimp(position=(150.0, 0.0, -12.0)),)
    asked = recipe(
        RayRequest(fan=False, eigenrays=EigenrayRequest(vertices=3, targets="none")),
        environment={"sound_speed": speed},
        sources=snap,
    )
    lines = lines_of(asked)
    turned = [line for line in lines if "T" in line.vertices]
    assert turned
    for line in turned:
        cosine = np.hypot(line.direction[:, 0], line.direction[:, 1])
        c = np.interp(-line.position[:, 2], speed.depth, speed.speed)
        np.testing.assert_allclose(cosine / c, cosine[0] / c[0], rtol=1e-12)
        at = [e == "turning point" for e in line.event]
        np.testing.assert_allclose(cosine[at], 1.0, atol=1e-12)
        assert np.abs(line.position[-1] - ARRAY).max() < 1e-10
    assert all(line.vertices.count("-") < 3 for line in lines)


def test_a_ray_behind_a_target_is_said_to_be_hidden() -> None:
    between = 0.5 * (SNAP + ARRAY)
    lines = lines_of(recipe(RayRequest(fan=False, eigenrays=EigenrayRequest(vertices=1)), target=between))
    flags = {line.vertices: line.flags for line in lines}
    assert flags["-"] == ("hidden by a target",)
    assert flags["S"] == flags["B"] == flags["X"] == ()
    nearest = EigenrayRequest(vertices=0, targets="nearest")
    behind = {
        line.vertices: line.flags for line in lines_of(recipe(RayRequest(fan=False, eigenrays=nearest), target=between))
    }
    assert behind["X"] == ("hidden by a target",)  # the snap is on the other side


def test_rays_go_to_the_nearest_facet_or_to_no_target() -> None:
    nearest = EigenrayRequest(vertices=0, targets="nearest")
    (echo,) = [x for x in lines_of(recipe(RayRequest(fan=False, eigenrays=nearest), size=4.0)) if x.vertices == "X"]
    met = echo.position[echo.event.index("target")]
    assert met[0] == pytest.approx(TARGET[0] - 2.0, abs=1e-4)
    assert not [
        x
        for x in lines_of(recipe(RayRequest(fan=False, eigenrays=EigenrayRequest(targets="none"))))
        if "X" in x.vertices
    ]


def test_a_snap_on_the_bed_hears_its_reflection_there_at_once() -> None:
    asked = recipe(RayRequest(fan=False, eigenrays=EigenrayRequest(vertices=1, targets="none")),
                   sources=(SnappingShrimp(position=(30.0, 10.0)),))  # fmt: skip
    by = {line.vertices: line for line in lines_of(asked)}
    assert by["B"].flags == ("reflected at its end",)
    assert by["B"].time[-1] == pytest.approx(by["-"].time[-1], rel=1e-14)
    assert by["-"].flags == by["S"].flags == ()


def test_snaps_at_one_place_are_one() -> None:
    twice = (SnappingShrimp(position=tuple(SNAP), snap_times=(0.0, 0.01)), SnappingShrimp(position=(20.0, 0.0, -5.0)))
    names = {line.name for line in lines_of(recipe(sources=twice))}
    assert {name for name in names if "box" not in name} == {"snap 0 to array", "snap 2 to array"}


def test_a_fan_and_eigenrays_can_be_drawn_together(tmp_path: Path) -> None:
    fan = RayRequest(azimuths=3, elevations=3, duration=0.05, eigenrays=EigenrayRequest(vertices=1))
    files, text = show_rays(planning.plan(recipe(fan)), 0, tmp_path)
    value = json.loads(files[3].read_text())
    assert [ray["family"] for ray in value["rays"]].count("fan") == 9
    assert "9 rays: " in text
    assert all(ray["transmission_loss"] is None for ray in value["rays"] if ray["family"] == "fan")


def test_a_fan_alone_has_a_table_of_one_line() -> None:
    lines = lines_of(recipe(RayRequest(azimuths=2, elevations=1, duration=0.01)))
    assert table(lines).startswith("2 rays: ")


def test_without_a_snap_there_is_nothing_to_draw() -> None:
    with pytest.raises(FieldError, match=r"sources: is empty: there are no eigenrays"):
        lines_of(recipe(sources=()))


def numbers_of(text: str) -> dict[str, Any]:
    (found,) = re.findall(r'<script id="rays-data" type="application/json">(.*?)</script>', text, flags=re.DOTALL)
    value: dict[str, Any] = json.loads(found)
    return value


def test_the_page_holds_the_numbers_and_nothing_else_is_needed(shown: tuple[dict[str, Path], str, Any]) -> None:
    text = shown[0]["rays.html"].read_bytes().decode("ascii")
    value = numbers_of(text)
    assert value["title"] == "A box & a </script> snap"
    kept = [{name: x for name, x in ray.items() if name != "colour"} for ray in value["rays"]]
    assert kept == shown[2]["rays"]
    assert [ray["colour"] for ray in value["rays"]] == [COLOURS[ray["family"]] for ray in value["rays"]]
    assert text.count("<script") == text.count("</script>") == 2
    for reach in ("http:", "https:", "src=", "href=", "@import", "url(", "fetch(", "@DATA@", "@SCRIPT@"):
        assert reach not in text
    (target,) = value["targets"]
    corners = np.array(target["vertices"])
    np.testing.assert_allclose(corners.min(axis=0), TARGET - 0.5, atol=1e-4)
    np.testing.assert_allclose(corners.max(axis=0), TARGET + 0.5, atol=1e-4)


def test_a_page_draws_a_part_of_the_facets_of_large_meshes(shown: tuple[dict[str, Path], str, Any]) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=6)  # 81 920 facets
    faces = np.asarray(ball.faces)
    hulls = [Hull("a", np.asarray(ball.vertices), faces), Hull("b", np.asarray(ball.vertices) + 5.0, faces[:1000])]
    targets = numbers_of(page(shown[2], hulls))["targets"]
    counts = [len(t["faces"]) for t in targets]
    assert sum(counts) <= MOST_FACETS
    assert counts[0] / counts[1] == pytest.approx(81.92, rel=0.01)
    assert [t["facets"] for t in targets] == [81_920, 1000]
    place = np.array(targets[0]["vertices"])[np.array(targets[0]["faces"])].mean(axis=(0, 1))
    assert np.abs(place).max() < 0.02  # left out evenly


@pytest.mark.skipif(shutil.which("node") is None, reason="node runs the page's program")
def test_the_program_of_the_page_draws_turns_and_answers(shown: tuple[dict[str, Path], str, Any]) -> None:
    browser = Path(__file__).with_name("page_in_node.js")
    done = subprocess.run(
        ["node", str(browser), str(shown[0]["rays.html"])], capture_output=True, text=True, check=False, timeout=HANGING
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["title"] == "A box & a </script> snap"
    assert told["about"] == "frame 0, 18 rays"
    assert told["boxes"][:4] == ["direct", "surface", "bottom", "surface and bottom"]
    assert told["boxes"][4:] == ["snap 0 to array", "snap 0 to box to array"]
    assert {"array", "snap 0"} <= set(told["places"])
    assert told["all"] == told["back"]
    assert told["none"][1] <= told["all"][1] - 18
    assert told["none"][0] < told["all"][0] - 100
    direct = next(ray for ray in shown[2]["rays"] if ray["vertices"] == "-")
    (words,) = [w for w in told["said"] if w.startswith("snap 0 to array: direct, -")]
    assert f"time {1e3 * direct['travel_time']:.4f} ms" in words
    assert f"loss {direct['transmission_loss']:.1f} dB" in words
    assert any("surface: at depth 0 m" in w for w in told["said"])
