"""What is made from the code is of the code as it is: the schema for editors, and the pages of reference."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sonarsynth.conventions import UNITS
from sonarsynth.recipe.reading import schema_text
from tools.page_building import ROOT, generated
from tools.page_building.pictures import FRAMES, ghosts, images, labels, likeness, noises, thumbnail
from tools.page_building.site import lay_out

MADE = generated()


@pytest.mark.parametrize("file", sorted(MADE), ids=lambda file: file.name)
def test_what_is_generated_is_current(file: Path) -> None:
    assert file.read_text() == MADE[file], "run tools/pages"


def test_every_recipe_names_the_schema_in_its_first_line() -> None:
    for file in (ROOT / "configs").glob("*.yaml"):
        found = re.match(r"# yaml-language-server: \$schema=(\S+)\n", file.read_text())
        assert found and (file.parent / found[1]).is_file(), file.name


def numbers(part: Any) -> list[dict[str, Any]]:
    """All fields of a schema that have a unit, and no other."""
    if isinstance(part, list):
        return [one for value in part for one in numbers(value)]
    if not isinstance(part, dict):
        return []
    own = [part] if "examples" in part else []
    return own + [one for key, value in part.items() if key != "examples" for one in numbers(value)]


def test_every_number_with_a_unit_has_an_example_that_is_one() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    found = json.loads(schema_text())
    fields = numbers(found)
    units = {
        unit for unit in UNITS if any(f"({unit.replace('rad', 'deg')}" in field["description"] for field in fields)
    }
    assert len(fields) > 150 and units >= {"m", "s", "Hz", "rad", "dB", "m/s", "Pa"}
    for field in fields:
        jsonschema.Draft202012Validator({"$defs": found["$defs"], **field}).validate(field["examples"][0])


def test_defaults_that_are_angles_have_a_unit_as_people_write_it() -> None:
    """A bare angle but 0 is refused in a recipe: the schema shows none, in tuples neither."""
    found = json.loads(schema_text())
    bare = [f for f in numbers(found) if any(isinstance(x, float) and x for x in np.atleast_1d(f.get("default", 0)))]
    assert not [field for field in bare if "(deg" in field["description"]]
    assert found["$defs"]["Upright"]["properties"]["heading"]["default"] == [0, "360 deg"]


def test_links_to_pictures_lead_to_where_the_site_has_them(tmp_path: Path) -> None:
    lay_out(tmp_path / "pages")
    page = (tmp_path / "pages" / "explanation" / "rays.md").read_text()
    assert "](../pictures/ghosts.png)" in page and (tmp_path / "pages" / "pictures" / "ghosts.png").is_file()


AS_DRAWN = 0.9
"""Least likeness of a picture to itself drawn again. Other draws of the signs of facets gave 0.56 to 0.87 where a body
had become faint or bright, 0.95 to 0.99 where all was as before."""


@pytest.mark.parametrize(
    "name", [n if n in ("grid", "tank") else pytest.param(n, marks=pytest.mark.long) for n in FRAMES]
)
def test_thumbnails_show_what_their_recipes_make(name: str, tmp_path: Path) -> None:
    thumbnail(name, tmp_path, tmp_path)
    assert likeness(tmp_path / f"{name}.png", ROOT / ".github" / f"{name}.png") > AS_DRAWN, "run tools/pages --pictures"


@pytest.mark.parametrize(
    ("drawing", "names"),
    [
        (labels, ("label_boxes", "label_beams")),
        (noises, ("noises",)),
        pytest.param(ghosts, ("ghosts",), marks=pytest.mark.long),
        pytest.param(images, ("images",), marks=pytest.mark.long),
    ],
)
def test_pictures_of_pages_show_what_is_made_now(drawing: Any, names: tuple[str, ...], tmp_path: Path) -> None:
    drawing(tmp_path, tmp_path)
    for name in names:
        assert likeness(tmp_path / f"{name}.png", ROOT / ".github" / f"{name}.png") > AS_DRAWN, (
            "run tools/pages --pictures"
        )
