"""The section of rays names what is in it, each thing once."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.ray_figures.ray_figure import section_figure
from sonarsynth.pictures.ray_figures.ray_styles import Look
from sonarsynth.pictures.ray_figures.scene_geometry import SceneGeometry
from sonarsynth.receiver import PlanarLattice, elements

RAY = np.array([[0.0, 0.0, -5.0], [10.0, 0.0, 0.0], [20.0, 0.0, -4.0], [10.0, 0.0, -10.0], [0.0, 0.0, -5.0]])


def plate(name: str, x: float, z: float) -> Hull:
    corners = np.array([[x - 1, 0, z], [x + 1, 0, z], [x + 1, 0, z + 0.5], [x - 1, 0, z + 0.5]])
    return Hull(name, corners, np.array([[0, 1, 2], [0, 2, 3]]))


def drawn(*looks: Look, hulls: tuple[Hull, ...] = (), stretch: float = 1.0) -> Figure:
    """A section of one ray for each look, made so many times wider."""
    rays: list[Floats] = [RAY * [stretch, 1.0, 1.0]] * len(looks)
    array = elements(PlanarLattice(columns=2, rows=2, pitch=0.05))
    place = np.array([0.0, 0.0, -5.0])
    view = {name: np.tile(place, (3, 1)) for name in ("across", "upright")}
    around = SceneGeometry(10.0, 0.0, place, array, array.position + place, {"array": place}, hulls, {}, view)
    return section_figure("a scene", rays, looks, np.array([0.0, 10.0]), np.full(2, 1500.0), around)


def look(family: str, *event: str, hidden: bool = False) -> Look:
    return Look(family, hidden, ("start", *event, *["end"] * (len(RAY) - 1 - len(event))), np.nan)


@pytest.mark.parametrize(
    ("looks", "expected"),
    [
        ([look("surface", "surface", "target")], ["surface", "reflected by surface", "reflected by target"]),
        (
            [look("bottom", "bottom"), look("surface", "surface")],
            ["surface", "bottom", "reflected by surface", "reflected by bottom"],
        ),
        (
            [look("surface and bottom", "surface", "target", "bottom")],
            ["surface and bottom", *(f"reflected by {name}" for name in ("surface", "bottom", "target"))],
        ),
        ([look("direct", hidden=True)], ["direct", "hidden by a target"]),
        ([look("direct", "target"), look("direct", "facet")], ["direct", "reflected by target"]),
    ],
)
def test_the_legend_has_each_entry_once(looks: list[Look], expected: list[str]) -> None:
    (legend,) = drawn(*looks).legends
    assert [text.get_text() for text in legend.get_texts()] == [*expected, "field of view"]


def test_marks_in_the_legend_are_of_reflections_and_lines_of_rays() -> None:
    (legend,) = drawn(look("surface", "surface"), look("direct", "turning point")).legends
    marks = {line.get_label(): (line.get_marker(), line.get_linestyle()) for line in legend.get_lines()}
    assert (marks["reflected by surface"], marks["turning point"]) == (("^", "None"), ("o", "None"))
    assert marks["direct"] == marks["surface"] == ("None", "-")


@pytest.mark.parametrize("stretch", [1.0, 2.0, 100.0])
def test_a_section_says_how_much_larger_heights_are_drawn(stretch: float) -> None:
    figure = drawn(look("direct"), stretch=stretch)
    section = next(axes for axes in figure.axes if "distance" in axes.get_xlabel())
    figure.canvas.draw()
    x, y = np.diff(section.transData.transform([(0.0, 0.0), (1.0, 1.0)]), axis=0)[0]
    said = section.get_title(loc="left").split("; ")[1]
    if said == "one scale":
        assert y / x == pytest.approx(1.0, abs=0.03)
    else:
        assert y / x == pytest.approx(float(said.split()[2]), rel=0.06)
        assert stretch == 100.0


def test_every_target_is_named_over_its_outline() -> None:
    figure = drawn(look("direct"), hulls=(plate("hull", 6.0, -5.0), plate("rock", 15.0, -9.0)))
    section = next(axes for axes in figure.axes if "distance" in axes.get_xlabel())
    named = {text.get_text(): text.xy for text in section.texts if hasattr(text, "xy")}
    assert named == {"array": (0.0, -5.0), "hull": (6.0, -4.5), "rock": (15.0, -8.5)}
