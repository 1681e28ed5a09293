"""One rule for bare numbers: the unit that the schema names, which is SI; of an angle none, unless it is 0."""

from __future__ import annotations

import json
import types
from collections.abc import Iterator
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from sonarsynth.conventions import UNITS, Unit
from sonarsynth.description import FieldError
from sonarsynth.geometry.motion import Still
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.reading import RecipeError


def leaves(kind: Any, name: str, seen: set[Any]) -> Iterator[tuple[str, Any, Unit]]:
    """Every number with a unit that a description holds, at any depth: class and field, type, unit."""
    if get_origin(kind) is Annotated:
        units = [m for m in get_args(kind) if isinstance(m, Unit)]
        if units:
            yield name, kind, units[0]
        else:
            yield from leaves(get_args(kind)[0], name, seen)
    elif get_origin(kind) in (tuple, list, Union, types.UnionType):
        for member in get_args(kind):
            yield from leaves(member, name, seen)
    elif hasattr(kind, "__pydantic_fields__") and kind not in seen:
        seen.add(kind)
        for field_name, field in kind.__pydantic_fields__.items():
            whole = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
            yield from leaves(whole, f"{kind.__name__}.{field_name}", seen)


FIELDS = list(leaves(Recipe, "", set()))
ANGLES = {name for name, _, unit in FIELDS if unit.symbol in ("rad", "rad/s")}


def units_in(part: Any) -> Iterator[str]:
    if isinstance(part, dict):
        yield from [part["x-unit"]] if "x-unit" in part else []
        yield from (unit for value in part.values() for unit in units_in(value))
    elif isinstance(part, list):
        yield from (unit for value in part for unit in units_in(value))


def test_the_schema_names_the_unit_of_every_dimensioned_field() -> None:
    schema = reading.schema()["$defs"]
    assert len(FIELDS) > 150 and len(ANGLES) > 25
    for name, _, unit in FIELDS:
        owner, _, field = name.partition(".")
        described = schema[owner]["properties"][field]
        assert unit.symbol in set(units_in(described)), name


@pytest.mark.parametrize("name", sorted({name for name, _, _ in FIELDS}))
def test_a_bare_number_is_si_or_refused_with_both_readings(name: str) -> None:
    """In all fields of the schema: with and without the unit the same, or only with."""
    for _, kind, unit in (leaf for leaf in FIELDS if leaf[0] == name):
        recipe = TypeAdapter(kind)
        for number in (0.5, 1.0, 7.5, 30, 2000.0, 60e3, 1e-4, -1e-4, -20.0):
            try:
                said = recipe.validate_json(json.dumps(f"{number} {unit.symbol}"), strict=True)
            except ValidationError:  # out of the bounds of the field
                continue
            assert said == number
            assert recipe.validate_python(number) == number  # Python is SI
            assert recipe.validate_json(recipe.dump_json(said), strict=True) == said
            if name in ANGLES:
                both = rf"{number} could be {number} deg(/s)? or {number} rad(/s)?: write the unit"
                with pytest.raises(ValidationError, match=both):
                    recipe.validate_json(json.dumps(number), strict=True)
                in_degrees = recipe.validate_json(json.dumps(f"{float(np.rad2deg(number))!r} deg{unit.symbol[3:]}"))
                assert in_degrees == pytest.approx(number, rel=1e-15)
            else:
                assert recipe.validate_json(json.dumps(number), strict=True) == number
            break
        else:
            pytest.fail(f"no number tried is in the bounds of {name}")


def test_ninety_is_not_116_degrees(small_file) -> None:
    with pytest.raises(RecipeError, match=r"--set: scene\.trajectory\.sonar\.heading: 90 could be 90 deg or 90 rad"):
        reading.load(small_file, ["scene.trajectory.sonar={kind: still, position: [0, 0, -5], heading: 90}"])
    for zero in ("0", "0.0", "-0.0"):
        setting = f"scene.trajectory.sonar={{kind: still, position: [0, 0, -5], heading: {zero}}}"
        still = reading.load(small_file, [setting]).scene.trajectory.sonar
        assert isinstance(still, Still) and still.heading == 0.0


def test_a_grid_and_variations_say_the_unit_of_angles_too(small_file) -> None:
    path = "scene.world.targets.0.motion.pitch"
    good = reading.load(small_file, [f"grid=[{{path: {path}, values: [0, 90 deg]}}]"])
    assert good.scene_of(1).world.targets[0].motion.pitch == pytest.approx(np.pi / 2)
    for entry in (
        f"grid=[{{path: {path}, values: [0, 90]}}]",
        f"variations=[{{path: {path}, kind: uniform, low: 10, high: 20}}]",
    ):
        wrong = reading.load(small_file, [entry])
        with pytest.raises(FieldError, match=r"pitch: [\d.]+ could be [\d.]+ deg or [\d.]+ rad"):
            wrong.scene_of(wrong.sequences - 1)


def test_a_store_of_the_time_before_is_read_in_radians(small_file) -> None:
    text = reading.dump(reading.load(small_file, ["scene.sonar.beams.azimuth_span=0.5 rad"]))
    bare = text.replace("0.5 rad", "0.5")
    assert bare != text
    assert reading.loads(bare.replace(" rad", ""), resolved=True) == reading.loads(text)
    with pytest.raises(RecipeError, match=r"0\.5 could be 0\.5 deg or 0\.5 rad"):
        reading.loads(bare)


def test_the_units_that_could_be_taken_for_another_are_those_of_angles() -> None:
    assert {symbol for symbol in UNITS if Unit(symbol).ambiguous} == {"rad", "rad/s"}


@pytest.mark.parametrize("number", [1e300, -1e300, 1e16, 10**18])
def test_numbers_that_overflow_somewhere_are_refused_in_every_field(small_file, number: float) -> None:
    """A catenary of scale 1e300, a Gabor pulse of 1e308 Hz: accepted, and then our fault."""
    for name, kind, unit in FIELDS:
        for written in (f"{number} {unit.symbol}", number):
            with pytest.raises(ValidationError) as refused:
                TypeAdapter(kind).validate_json(json.dumps(written), strict=True)
            assert "in size, not" in str(refused.value) or (name in ANGLES and written == number)
    with pytest.raises(RecipeError, match=r"--set: scene\.world\.environment\.depth: must be at most"):
        reading.load(small_file, [f"scene.world.environment.depth={number} m"])


def test_angles_that_are_left_out_need_no_unit(small_file) -> None:
    """Defaults are checked as what is written is: those that are angles must not be taken for written ones."""
    seen: set[Any] = set()
    list(leaves(Recipe, "", seen))
    defaults = [kind.__pydantic_fields__[name].default for kind in seen for name in kind.__pydantic_fields__
                if f"{kind.__name__}.{name}" in ANGLES]  # fmt: skip
    stated = [d for d in defaults if isinstance(d, (int, float)) and d != 0]
    assert len(stated) >= 6
    assert {type(d) for d in stated} == {np.float64}
    shape = "{kind: myring, nose: 0.2, middle: 1, tail: 0.5, diameter: 0.3}"
    sets = [f"scene.world.targets.0.shape={shape}", "scene.sonar.beams={azimuths: 5, elevations: 5}"]
    sets += ["scene.processing.cancelling={kind: wavefront}", "scene.physics.scattering={kind: mirror_lobe}"]
    recipe = reading.load(small_file, sets)
    assert recipe.scene.sonar.beams.azimuth_span == np.deg2rad(50.0)
    assert reading.loads(reading.dump(recipe)) == recipe
