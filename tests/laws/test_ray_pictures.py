"""The section of rays names what is in it, each thing once."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from sonarsynth.pictures.figures.ray_figure import Look, section_figure

from sonarsynth.pictures.figures.frame_figure import Hull

RAY = np.array([[0.0, 0.0, -5.0], [10.0, 0.0, 0.0], [20.0, 0.0, -4.0], [10.0, 0.0, -10.0], [0.0, 0.0, -5.0]])


def plate(name: str, x: float, z: float) -> Hull:
    corners = np.array([[x - 1, 0, z], [x + 1, 0, z], [x + 1, 0, z + 0.5], [x - 1, 0, z + 0.5]])
    return Hull(name, corners, np.array([[0, 1, 2], [0, 2, 3]]))


def drawn(*looks: Look, hulls: tuple[Hull, ...] = ()) -> Figure:
    return section_figure([RAY] * len(looks), hulls, np.array([0.0, 10.0]), np.full(2, 1500.0), 10.0, looks=looks)


def look(family: str, *event: str, hidden: bool = False) -> Look:
    return Look(family, hidden, ("start", *event, *["end"] * (len(RAY) - 1 - len(event))))


@pytest.mark.parametrize(
    ("looks", "expected"),
    [
        ([look("surface", "surface", "target")], ["surface", "target"]),
        ([look("bottom", "bottom"), look("surface", "surface")], ["surface", "bottom"]),
        (
            [look("surface and bottom", "surface", "target", "bottom")],
            ["surface and bottom", "surface", "bottom", "target"],
        ),
        ([look("direct", hidden=True)], ["direct", "hidden by a target"]),
        ([look("direct", "target"), look("direct", "facet")], ["direct", "target"]),
    ],
)
def test_the_legend_has_each_entry_once(looks: list[Look], expected: list[str]) -> None:
    (legend,) = drawn(*looks).legends
    assert [text.get_text() for text in legend.get_texts()] == expected


def test_a_mark_in_the_legend_is_that_of_the_reflections_of_its_family() -> None:
    (legend,) = drawn(look("surface", "surface"), look("direct", "turning point")).legends
    marks = {line.get_label(): line.get_marker() for line in legend.get_lines()}
    assert (marks["surface"], marks["turning point"]) == ("^", "o")
    assert marks["direct"] in ("", "None")


def test_every_target_is_named_over_its_outline() -> None:
    figure = drawn(look("direct"), hulls=(plate("hull", 6.0, -5.0), plate("rock", 15.0, -9.0)))
    section = next(axes for axes in figure.axes if "distance" in axes.get_xlabel())
    assert {text.get_text(): text.xy for text in section.texts} == {"hull": (6.0, -4.5), "rock": (15.0, -8.5)}
