"""Rays to look at: what is drawn, printed and written of a frame is what the closed form says."""

from __future__ import annotations

import base64
import json
import re
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
from sonarsynth.pictures.figures.style import compass
from sonarsynth.pictures.ray_figures.ray_page import MOST_FACETS, thinned_facets
from sonarsynth.pictures.ray_figures.ray_styles import COLOURS, Look, drawing_order, styles
from sonarsynth.pictures.ray_figures.scene_geometry import scene_geometry
from sonarsynth.pictures.ray_pictures import ray_lines, show_rays, table
from sonarsynth.propagation.ray_request import EigenrayRequest, RayRequest
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Box
from sonarsynth.targets.target import Target

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


def traces_of(text: str) -> list[dict[str, Any]]:
    """The traces that a page draws, with numbers as arrays."""
    call = text[text.rindex("Plotly.newPlot(") :]
    traces: list[dict[str, Any]] = json.JSONDecoder().raw_decode(call, call.index("["))[0]
    for trace in traces:
        for axis in set(trace) & {"x", "y", "z"}:
            if isinstance(trace[axis], dict):
                trace[axis] = np.frombuffer(base64.b64decode(trace[axis]["bdata"]), trace[axis]["dtype"])
            trace[axis] = np.array(trace[axis], float)
    return traces


def test_the_page_draws_every_ray_in_both_views_and_leads_nowhere(
    shown: tuple[dict[str, Path], str, dict[str, Any]],
) -> None:
    text = shown[0]["rays.html"].read_text("utf-8")
    own = text.replace(re.findall(r"<script[^>]*>/\*\*\n\* plotly.*?</script>", text, flags=re.DOTALL)[0], "")
    for reach in ("http:", "https:", " src=", " href=", "@import", "fetch(", str(shown[0]["rays.html"].parent)):
        assert reach not in own
    assert '"showSendToCloud": false' in own
    assert len(text) < 7e6
    assert "A box &amp; a &lt;/script&gt; snap" in own
    assert "</script> snap" not in own
    lines = [t for t in traces_of(own) if t.get("name") in COLOURS]
    bearing = shown[2]["bearing"]
    for ray in shown[2]["rays"]:
        at = np.array(ray["position"])
        flat = (at - ARRAY) @ [np.cos(bearing), np.sin(bearing), 0.0]
        (there,) = [t for t in lines if t["type"] == "scatter3d" and holds(np.stack([t["x"], t["y"], t["z"]], 1), at)]
        below = [
            t for t in lines if t["type"] == "scatter" and holds(np.stack([t["x"], t["y"]], 1), np.c_[flat, at[:, 2]])
        ]
        assert there["name"] == ray["family"] == below[0]["name"]
        assert there["line"]["color"] == COLOURS[ray["family"]]
        said = next(words for words in there["text"] if f": {ray['family']}, {ray['vertices']}<br>" in words)
        assert f"{1e3 * ray['travel_time']:.4f} ms" in said and f"loss {ray['transmission_loss']:.1f} dB" in said


def holds(line: np.ndarray, part: np.ndarray) -> bool:
    """Whether a polyline with gaps has these points in a row, between two gaps."""
    ends = np.flatnonzero(np.isnan(line[:, 0]))
    pieces = [piece[~np.isnan(piece[:, 0])] for piece in np.split(line, ends)]
    return any(piece.shape == part.shape and np.allclose(piece, part, atol=1e-9) for piece in pieces)


def test_a_page_draws_an_even_part_of_the_facets_of_large_meshes() -> None:
    faces = np.zeros((81_920, 3), int)
    kept = thinned_facets([Hull("a", np.zeros((1, 3)), faces), Hull("b", np.zeros((1, 3)), faces[:1000])])
    assert sum(map(len, kept)) <= MOST_FACETS
    assert len(kept[0]) / len(kept[1]) == pytest.approx(81.92, rel=0.01)
    assert (np.diff(np.diff(kept[0])) ** 2 <= 1).all()


def test_the_field_of_view_ends_at_its_edges_and_in_the_water() -> None:
    asked = recipe()
    scene, frame = asked.frame(0)
    geometry = scene_geometry(scene, frame, 0.5 * np.pi)
    sonar, beams = frame.sonar_pose, scene.sonar.beams
    across, upright = (sonar.to_body(geometry.view[name])[1:-1] for name in ("across", "upright"))
    angle = np.arctan2(across[:, 1], across[:, 0])
    np.testing.assert_allclose([angle.min(), angle.max()], [beams.azimuth[0], beams.azimuth[-1]], atol=1e-12)
    steep = np.arctan2(upright[:, 2], upright[:, 0])
    np.testing.assert_allclose([steep.min(), steep.max()], [beams.elevation[0], beams.elevation[-1]], atol=1e-12)
    z = geometry.view["upright"][:, 2]
    assert z.max() <= 1e-9 and z.min() >= -20.0 - 1e-9
    assert geometry.tracks == {}  # nothing moves


def test_rays_of_a_fan_tell_hits_from_misses_and_strong_from_weak() -> None:
    miss, hit = Look("fan", False, ("launch", "end"), np.nan), Look("fan", False, ("launch", "facet"), np.nan)
    weak, strong = (Look("fan", False, ("launch", "facet"), c) for c in (0.1, 0.7))
    assert [s.label for s in styles([miss] * 20 + [hit])] == ["meets no target"] * 20 + ["meets a target"]
    assert len({s.colour for s in styles([miss, weak, strong])}) == 3
    assert drawing_order([strong, miss, weak]) == [1, 2, 0]
    assert len({s.colour for s in styles([miss, hit, miss])}) == 3  # a few are told apart one by one


@pytest.mark.parametrize(("x", "y", "word"), [(0, 1, "N (000"), (1, 1, "NE (045"), (1, 0, "E (090"), (0, -1, "S (180"),
                                              (-1, 0, "W (270"), (-1e-9, 1, "N (000")])  # fmt: skip
def test_directions_have_compass_words(x: float, y: float, word: str) -> None:
    assert compass(np.arctan2(y, x)) == f"{word} deg)"
