"""Every field that a recipe may have is explained, in the schema that editors read and in `help`."""

from __future__ import annotations

import inspect
import re

import pytest

import sonarsynth as ss
from sonarsynth.description.schemas import kind_of, shown
from sonarsynth.recipe import reading

DESCRIBED = reading.schema()["$defs"]


@pytest.mark.parametrize("name", sorted(DESCRIBED))
def test_no_field_is_without_a_text(name: str) -> None:
    fields = DESCRIBED[name].get("properties", {})
    bare = [field for field, part in fields.items() if field != "kind" and not part.get("description")]
    assert not bare and (DESCRIBED[name].get("description") or "enum" in DESCRIBED[name])


def test_help_gives_parameters_with_bounds_units_and_defaults() -> None:
    text = inspect.getdoc(ss.Thermocline)
    assert text is not None
    assert "mixed_depth : number from 0 in m, default 5\n    Depth of the top" in text
    assert "surface_speed : number from 100 to 10000 in m/s, default 1541" in text
    assert "kind :" not in text
    assert "Parameters\n----------" not in DESCRIBED["Thermocline"]["description"]


def test_a_default_is_the_one_that_a_field_has() -> None:
    """None only where nothing is the default, and of a method its kind."""
    compared = 0
    for name in set(DESCRIBED) & set(ss.__all__):
        for field, info in getattr(getattr(ss, name), "__pydantic_fields__", {}).items():
            if not info.is_required():
                default = info.get_default(call_default_factory=True)
                told = DESCRIBED[name]["properties"][field].get("default")
                assert (told is None) == (default is None), (name, field)
                if hasattr(default, "kind"):
                    assert told["kind"] == default.kind
                    compared += 1
    assert compared > 10


FUNCTIONS = [name for name in ss.__all__ if inspect.isfunction(getattr(ss, name))]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_parameter_of_a_function_is_without_a_word(name: str) -> None:
    function = getattr(ss, name)
    sections = re.split(r"\n(\w+)\n-+\n", inspect.getdoc(function) or "")
    of = dict(zip(sections[1::2], sections[2::2], strict=True))
    explained = re.findall(r"^(\w+): .", of.get("Parameters", ""), re.MULTILINE)
    assert explained == list(inspect.signature(function).parameters) and of["Returns"].strip()


def test_a_class_explains_itself_and_so_do_its_methods() -> None:
    classes = [getattr(ss, name) for name in ss.__all__ if inspect.isclass(getattr(ss, name))]
    assert len(classes) > 60
    for one in classes:
        own = [value for key, value in vars(one).items() if inspect.isfunction(value) and not key.startswith("_")]
        assert inspect.getdoc(one) and all(value.__doc__ for value in own), one


def test_the_stricter_of_two_bounds_is_shown() -> None:
    for part, words in (
        ({"minimum": 100, "exclusiveMinimum": 0}, "from 100"),
        ({"minimum": 0, "exclusiveMinimum": 0, "maximum": 5}, "over 0 to 5"),
        ({"maximum": 9, "exclusiveMaximum": 3}, "under 3"),
    ):
        assert kind_of({"type": "number", **part}) == f"number {words}"


def test_defaults_are_short() -> None:
    assert [shown(one) for one in (None, 5.0, {"kind": "wenz", "level": 3}, {"level": 3})] == [
        "none",
        "5",
        "wenz",
        "its own defaults",
    ]
