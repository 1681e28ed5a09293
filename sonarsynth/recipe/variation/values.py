"""Values that a recipe sets in its scene: any plain value, numbers with units, and the paths that they go to."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any

from pydantic import PlainSerializer, PlainValidator, TypeAdapter, WithJsonSchema

from sonarsynth.conventions import ASSUMED_SPEED, bounded
from sonarsynth.description.field_messages import Where

WORLD = ("environment", "targets", "sources", "populations", "noise_sources", "scatterers", "chorus")
SHORT = dict.fromkeys(WORLD, "scene.world.") | {"trajectory": "scene.", "sonar": "scene."}
"""What may be left out before a path that begins so."""
VARYING = ("scene.world.", "scene.trajectory.", "scene.sonar.sensor_errors.", "scene.sonar.electronics.", ASSUMED_SPEED)
"""What can vary."""
FRAMES = "scene.trajectory.frames"
"""How long a sequence is: what varies it lists whole numbers, or draws them."""
MOST_FRAMES = 10_000_000
"""Of a recipe."""


@dataclass(frozen=True)
class Plain:
    """A number, text, list or mapping as written, made hashable."""

    text: str
    """Canonical JSON."""

    def fits(self, wanted: Plain) -> bool:
        """Whether it is that value, or one of that kind."""
        content = self.value
        return self == wanted or (isinstance(content, dict) and content.get("kind") == wanted.value)

    @property
    def value(self) -> Any:
        """The value."""
        return json.loads(self.text)

    @classmethod
    def of(cls, value: Any) -> Plain:
        """From a plain value, or a description. Raises ValueError for anything else."""
        if isinstance(value, cls):
            return value
        if is_dataclass(value) and not isinstance(value, type):
            value = TypeAdapter(type(value)).dump_python(value, mode="json")
        try:
            return cls(json.dumps(value, sort_keys=True, allow_nan=False))
        except (TypeError, ValueError):
            raise ValueError("must be a number, a text, a list or a mapping") from None

    @property
    def shown(self) -> str:
        """As people read it, in short."""
        value = self.value
        text = value if isinstance(value, str) else self.text
        return text if len(text) <= 60 else f"{text[:57]}..."


PlainValue = Annotated[
    Plain, PlainValidator(Plain.of), PlainSerializer(lambda plain: plain.value), WithJsonSchema({"title": "Value"})
]
"""Any value that the field it goes to accepts."""


def number_and_unit(value: float | str) -> tuple[float, str]:
    """(12.0, "m") of "12 m", (12.0, "") of 12. Raises ValueError where there is no finite number."""
    if isinstance(value, str):
        text, _, unit = value.strip().partition(" ")
        try:
            number = float(text)
        except ValueError:
            number = math.nan
    else:
        number, unit = float(value), ""
    if not math.isfinite(number):
        raise ValueError(f"must be a number, or a text such as '1 m', not '{value}'")
    return float(bounded(number)), unit.strip()


def with_unit(number: float, unit: str) -> Plain:
    """A number in the unit that it was written in."""
    return Plain.of(f"{number!r} {unit}" if unit else number)


def same_unit(**values: float | str | None) -> str:
    """The unit that all of these have; those that are None do not count. Raises ValueError where they differ."""
    units = {name: number_and_unit(value)[1] for name, value in values.items() if value is not None}
    if len(set(units.values())) > 1:
        shown = ", ".join(f"{name} in '{unit}'" if unit else f"{name} without" for name, unit in units.items())
        raise ValueError(f"must all have the same unit: {shown}")
    return next(iter(units.values()))


def _quantity(value: Any) -> float | str:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError("must be a number, or a text such as '1 m'")
    number_and_unit(value)
    return value


Quantity = Annotated[
    float | str,
    PlainValidator(_quantity),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "pattern": "^[-+0-9.eE]+ .+$"}]}),
]
"""A number, with its unit where the field it goes to has one."""


def _paths(value: Any) -> tuple[str, ...]:
    texts = (value,) if isinstance(value, str) else value
    if not isinstance(texts, (list, tuple)) or not texts or not all(isinstance(t, str) for t in texts):
        raise ValueError("must be a path such as scene.world.targets.0.motion.heading, or a list of them")
    texts = [in_full(text) for text in texts]
    for text in texts:
        if not text.startswith(VARYING):
            raise ValueError(
                f"'{text}' cannot vary: scene.world, scene.trajectory and what is wrong with the sensors do; the "
                "instrument and the methods are the same for all sequences"
            )
        if re.fullmatch(r"scene\.world\.populations\.[\w-]+(\.(most|name|models(\..*)?))?", text):
            raise ValueError(
                f"'{text}' cannot vary: the store has room and meshes for what a population may be at most"
            )
        if text.endswith(".path"):
            raise ValueError(f"'{text}' is the name of a file: vary what holds it, with its kind and path")
        if text.endswith(".kind"):
            raise ValueError(f"'{text}' cannot vary by itself: vary what holds it, with its kind and all its fields")
        if not all(re.fullmatch(r"[\w-]+", key) for key in text.split(".")):
            raise ValueError(f"'{text}' is not a path such as scene.world.targets.0.motion.heading")
    return tuple(texts)


def _written(paths: tuple[str, ...]) -> str | list[str]:
    return paths[0] if len(paths) == 1 else list(paths)


Paths = Annotated[
    tuple[str, ...],
    PlainValidator(_paths),
    PlainSerializer(_written),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}, "minItems": 1}]}),
]
"""Where a value goes: one path into the scene, or several that all get it."""


def in_full(path: str) -> str:
    """A dotted path with what may be left out before it."""
    return SHORT.get(path.partition(".")[0], "") + path


def by_number(data: Any, path: Where) -> Where:
    """A path into `data` with numbers for the names of members of lists."""
    keys: list[str | int] = []
    for key in path:
        names = [item.get("name") for item in data if isinstance(item, dict)] if isinstance(data, list) else []
        keys.append(names.index(key) if key in names and len(names) == len(data) else key)
        try:
            data = data[keys[-1]]
        except (LookupError, TypeError):
            data = None
    return tuple(keys)


def where(path: str) -> Where:
    """A dotted path in parts."""
    return tuple(int(key) if key.isdecimal() else key for key in path.split("."))


def put(
    data: Any, path: Where, value: Any, unknown: Callable[[str, Iterable[str]], str] | None = None, depth: int = 0
) -> Any:
    """`data` with the value at path[depth:] replaced; mappings that are missing on the way are added.

    unknown: says that a name is not among others, of the last but one at most, where no mapping may be added. Raises
    LookupError where the path leads nowhere.
    """
    if depth == len(path):
        return value
    key = path[depth]
    if isinstance(data, list):
        if not isinstance(key, int) or key >= len(data):
            names = [
                f"{i} ({v['name']})" if isinstance(v, dict) and "name" in v else str(i) for i, v in enumerate(data)
            ]
            raise LookupError(f"there is no entry '{key}', only {', '.join(names[:9]) or 'an empty list'}")
        return [put(v, path, value, unknown, depth + 1) if i == key else v for i, v in enumerate(data)]
    if data is None or isinstance(data, dict):
        name, data = str(key), data or {}
        if unknown and data and name not in data and not (depth == len(path) - 1 or data.get("kind")):
            raise LookupError(unknown(name, data))
        return data | {name: put(data.get(name), path, value, unknown, depth + 1)}
    raise LookupError(f"'{'.'.join(map(str, path[:depth]))}' has no fields")


def _name(value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", value):
        raise ValueError("must be a word of letters, digits and _")
    return value


Name = Annotated[str, PlainValidator(_name), WithJsonSchema({"type": "string", "pattern": "^[A-Za-z][A-Za-z0-9_]*$"})]
"""Name of a coordinate of the store."""


def default_name(paths: tuple[str, ...]) -> str:
    """What an entry without a name is called: targets_0_motion_heading."""
    return paths[0].removeprefix("scene.").removeprefix("world.").replace(".", "_")


def leads_through(a: Where, b: Where) -> bool:
    """Whether one path leads through the other."""
    return all(x == y for x, y in zip(a, b, strict=False))
