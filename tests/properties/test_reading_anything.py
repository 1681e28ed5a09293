"""Whatever a file holds, it is read, or refused in a line that names it, of recipes a line for each thing that is
wrong: recipes, casts, recordings, meshes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sonarsynth.environment.casts import CastError, profile_of
from sonarsynth.environment.sound_speed import Cast
from sonarsynth.recipe import reading
from sonarsynth.recipe.reading import RecipeError
from sonarsynth.recipe.reading.yaml_source import read_file, read_text
from sonarsynth.sources.recordings import RecordingError, read_recording
from sonarsynth.sources.snap_models import RecordedSnap

few = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
RECIPE = (Path(__file__).parents[2] / "configs" / "grid.yaml").read_text()
CAST = "% Start latitude,-36.2\nDepth (m),Temperature (C),Salinity (psu)\n0.5,20.1,35\n4,19.7,35.1\n20,15,35.2\n"

cell = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.sampled_from(["", "x", "1e999", "-9999", "0x1", "1_0", "1,5", " "]),
)
yaml_text = st.text(alphabet=st.sampled_from(list("ab:-,[]{}&*!|>'\"#%@` \n\t?0.1~e+\\<=")), max_size=80)
plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**39), 10**39) | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=10),
    lambda inner: st.lists(inner, max_size=4)
    | st.dictionaries(st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=6), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


def one_line(error: ValueError, name: object) -> None:
    lines = str(error).split("\n") if isinstance(error, RecipeError) else [str(error)]
    for text in lines:
        assert "\n" not in text and text.startswith(str(name)) and len(text) > len(str(name)) + 3, text


@few
@given(yaml_text)
def test_any_text_is_read_as_a_recipe_or_refused(text: str) -> None:
    try:
        source = read_text(text, "x.yaml", Path())
        reading.recipe_of(source)
    except RecipeError as error:
        one_line(error, "x.yaml")
        assert re.match(r"x\.yaml:\d+: ", str(error))
    else:
        raise AssertionError("no recipe is so short")


@few
@given(st.dictionaries(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1), plain, min_size=1))
def test_what_json_says_is_what_is_read(data: dict[str, object]) -> None:
    source = read_text(json.dumps(data), "x.yaml", Path())
    assert source.data == data
    assert json.dumps(source.data) == json.dumps(data)


@few
@given(st.integers(0, len(RECIPE) - 1), st.integers(0, 40), yaml_text)
def test_a_recipe_with_a_part_exchanged_is_read_or_refused(start: int, length: int, text: str) -> None:
    changed = RECIPE[:start] + text + RECIPE[start + length :]
    try:
        made = reading.loads(changed, "x.yaml")
    except RecipeError as error:
        one_line(error, "x.yaml")
        assert re.match(r"x\.yaml:\d+: ", str(error))
    else:
        assert reading.loads(reading.dump(made)) == made


@few
@given(st.one_of(st.binary(max_size=200), st.text(max_size=200).map(str.encode)))
def test_any_bytes_are_no_cast_and_no_recording(tmp_path: Path, data: bytes) -> None:
    for ending in ("csv", "wav"):
        file = tmp_path / f"x.{ending}"
        file.write_bytes(data)
        with pytest.raises((CastError, RecordingError)) as error:
            profile_of(Cast(path=str(file))) if ending == "csv" else read_recording(RecordedSnap(path=str(file)))
        one_line(error.value, file)


def exchanged(text: str, where: int, value: str) -> str:
    """The text with one of its numbers exchanged."""
    numbers = list(re.finditer(r"-?\d+(?:\.\d+)?", text))
    one = numbers[where % len(numbers)]
    return text[: one.start()] + value + text[one.end() :]


@few
@given(st.integers(0, 99), cell)
def test_a_cast_with_one_other_number_is_a_profile_of_water_or_refused(tmp_path: Path, where: int, value: str) -> None:
    file = tmp_path / "cast.csv"
    file.write_text(exchanged(CAST, where, value))
    try:
        profile = profile_of(Cast(path=str(file)))
    except CastError as error:
        one_line(error, file)
    else:
        assert np.isfinite(profile.speed).all() and (np.diff(profile.depth) >= 0).all()
        assert (profile.speed > 1300).all() and (profile.speed < 1700).all() and profile.depth.max() <= 12e3


def test_a_recipe_is_read_from_a_plain_file(tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match="is not a file"):
        read_file("/dev/zero")
