"""YAML text to plain values that know where they stand: every path into them has a line, or `--set`.

YAML 1.2 (`1e-3` is a number, `no` is a text). Nothing is constructed but texts, numbers, booleans, null, lists and
mappings; sizes, depth and aliases are bounded, so a file can be wrong but not dangerous.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from sonarsynth.description.field_messages import Where
from sonarsynth.recipe.variation.values import by_number, in_full, put, where

MAX_BYTES: Final = 2_000_000
MAX_VALUES: Final = 50_000
MAX_DEPTH: Final = 64
MAX_DIGITS: Final = 40
"""Of a whole number."""
SET: Final = "--set"
_TAG: Final = "tag:yaml.org,2002:"


class RecipeError(ValueError):
    """A recipe that cannot be used; str() is a line for it and each of `others` that are wrong too: file, line (or
    --set), field, and what is wrong."""

    def __init__(self, file: str, place: str, field: str, message: str, others: Sequence[RecipeError] = ()) -> None:
        self.file, self.place, self.field, self.others = file, place, field, tuple(others)
        self.message = " ".join(message.split())
        head = f"{file}:{place}" if place else file
        line = ": ".join(text for text in (head, field, self.message) if text)
        super().__init__("\n".join((line, *map(str, self.others))))

    def __reduce__(self) -> tuple[type[RecipeError], tuple[str, str, str, str, tuple[RecipeError, ...]]]:
        return type(self), (self.file, self.place, self.field, self.message, self.others)


@dataclass(frozen=True, eq=False)
class Source:
    """A recipe as read: plain values, and the line (or `--set`) of each of them."""

    name: str
    """The file, as errors name it."""
    folder: Path
    """Where relative paths of the file start."""
    data: Any
    places: dict[Where, str]
    text: str = ""
    """The text as written."""
    settings: tuple[str, ...] = ()
    """What `--set` set over it, in order."""

    def place(self, keys: Where) -> str:
        """Line of a value, or of the nearest one that holds it; `--set` where that set a part of the value."""
        if any(place == SET and at[: len(keys)] == keys for at, place in self.places.items()):
            return SET
        while keys and keys not in self.places:
            keys = keys[:-1]
        return self.places.get(keys, "1")

    def error(self, keys: Where, message: str, others: Sequence[RecipeError] = ()) -> RecipeError:
        """The error of the value at a path."""
        return RecipeError(self.name, self.place(keys), dotted(keys), message, others)


def dotted(keys: Where) -> str:
    """A path as people write it: scene.world.targets.0.name."""
    return ".".join(map(str, keys))


def read_file(path: Path | str) -> Source:
    """Read a recipe file. Raises RecipeError."""
    path, name = Path(path), str(path)
    if "\n" in name:
        raise RecipeError("recipe", "", "", "this is a text, not the path of one: sonarsynth.loads reads it")
    try:
        if not path.is_file():
            there = "is not a file" + " but a folder" * path.is_dir()
            raise RecipeError(name, "", "", there if path.exists() else "no such file")
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise RecipeError(name, "", "", f"cannot be read: {error.strerror}") from None
    if len(raw) > MAX_BYTES:
        raise RecipeError(name, "", "", f"is larger than {MAX_BYTES // 1_000_000} MB")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise RecipeError(name, str(line), "", f"is not UTF-8 text (byte {raw[error.start]:#04x})") from None
    return read_text(text, name, path.parent.absolute())


def read_text(text: str, name: str, folder: Path) -> Source:
    """Read the text of a recipe. Raises RecipeError."""
    if not isinstance(text, str | bytes):
        raise TypeError(f"a recipe is read from a text, not from a {type(text).__name__}")
    node = _compose(text, name)
    if node is None:
        raise RecipeError(name, "1", "", "is empty")
    reader = _Reader(name, {})
    data = reader.value(node, ())
    if not isinstance(data, dict):
        given = f", not {str(data)[:40]!r}" if isinstance(data, str) else ""
        raise RecipeError(name, "1", "", f"must be a mapping of fields (title, seed, scene, ...){given}")
    return Source(name, folder, data, reader.places, text)


def override(source: Source, setting: str) -> Source:
    """The source with one `path=value` of the command line set: paths go as in a grid, by number or by name. Raises
    RecipeError."""
    path, equals, text = setting.partition("=")
    if not equals or not path.strip():
        raise RecipeError(source.name, SET, "", f"'{setting}' is not path=value")
    keys = by_number(source.data, where(in_full(path.strip())))
    reader = _Reader(source.name, {}, SET)
    node = _compose(text, source.name, SET, path.strip())
    value = None if node is None else reader.value(node, keys)
    places = {w: p for w, p in source.places.items() if w[: len(keys)] != keys}
    try:
        data = put(source.data, keys, value)
    except LookupError as error:
        raise RecipeError(source.name, SET, dotted(keys), error.args[0]) from None
    return replace(
        source,
        data=data,
        places=places | reader.places | {keys: SET},
        settings=(*source.settings, setting),
    )


@lru_cache(maxsize=16)
def _compose(text: str, name: str, place: str = "", field: str = "") -> Node | None:
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _Composer
    try:
        node: Node | None = yaml.compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = place or str(mark.line + 1 if mark else 1)
        raise RecipeError(name, line, field, _plain(error)) from None
    except MemoryError:
        raise RecipeError(name, place or "1", field, "does not fit in memory") from None
    except RecursionError:
        raise RecipeError(name, place or "1", field, "is nested too deeply") from None
    except (YAMLError, ValueError) as error:
        raise RecipeError(name, place or "1", field, f"is not YAML: {getattr(error, 'reason', error)}") from None
    return node


def _plain(error: MarkedYAMLError) -> str:
    problem = str(error.problem or error.context or "is not YAML")
    if isinstance(error, _Unwanted):
        return problem
    if "'\\t'" in problem:
        return "tabs cannot indent YAML; use spaces"
    return f"is not YAML: {problem}"


class _Unwanted(MarkedYAMLError):
    """YAML that no recipe needs."""


class _Composer(Composer):
    """Composes a document; stops where it is too large, before it takes long."""

    values = 0

    def compose_document(self) -> Any:
        event = self.parser.peek_event()
        if event.version not in (None, (1, 2)):
            raise _Unwanted(problem="is not of YAML 1.2: leave out '%YAML'", problem_mark=event.start_mark)
        return super().compose_document()

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.parser.peek_event()
        self.values += 1
        if self.values > MAX_VALUES:
            raise _Unwanted(problem=f"holds more than {MAX_VALUES} keys and values", problem_mark=event.start_mark)
        if self.depth > MAX_DEPTH:
            raise _Unwanted(problem=f"is nested deeper than {MAX_DEPTH} levels", problem_mark=event.start_mark)
        if not isinstance(event, AliasEvent) and getattr(event, "anchor", None) in self.anchors:
            raise _Unwanted(problem=f"the anchor '{event.anchor}' is given twice", problem_mark=event.start_mark)
        return super().compose_node(parent, index)


@dataclass
class _Reader:
    """Turns nodes into plain values, noting where each stands."""

    name: str
    places: dict[Where, str]
    place: str = ""

    def error(self, node: Node, keys: Where, message: str) -> RecipeError:
        return RecipeError(self.name, self.place or str(node.start_mark.line + 1), dotted(keys), message)

    def value(self, node: Node, keys: Where, at: Node | None = None) -> Any:
        self.places.setdefault(keys, self.place or str((at or node).start_mark.line + 1))
        if len(self.places) > MAX_VALUES:
            raise self.error(node, (), f"holds more than {MAX_VALUES} values (aliases are counted)")
        if len(keys) > MAX_DEPTH:
            raise self.error(node, (), f"is nested deeper than {MAX_DEPTH} levels")
        if isinstance(node, ScalarNode):
            return self._scalar(node, keys)
        if isinstance(node, SequenceNode) and str(node.tag) == f"{_TAG}seq":
            return [self.value(item, (*keys, i)) for i, item in enumerate(node.value)]
        if isinstance(node, MappingNode) and str(node.tag) == f"{_TAG}map":
            return {key: self.value(v, (*keys, key), k) for key, k, v in self._items(node, keys)}
        raise self.error(node, keys, f"has the tag {node.tag}; tags are not used in recipes")

    def _items(self, node: MappingNode, keys: Where) -> Iterator[tuple[str, Node, Node]]:
        taken: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, ScalarNode):
                raise self.error(key, keys, "a key must be a text")
            if not _is_text(key.value):
                raise self.error(key, keys, "a key holds half a character (a surrogate)")
            if key.value in taken:
                raise self.error(key, (*keys, key.value), "is given twice")
            taken.add(key.value)
            yield str(key.value), key, value

    def _scalar(self, node: ScalarNode, keys: Where) -> Any:
        text, tag = str(node.value), str(node.tag)
        if not tag.startswith(_TAG):
            raise self.error(node, keys, f"has the tag {tag}; tags are not used in recipes")
        match tag.removeprefix(_TAG):
            case "str" | "timestamp" | "merge" | "value":
                if not _is_text(text):
                    raise self.error(node, keys, "holds half a character (a surrogate)")
                return text
            case "null":
                return None
            case "bool" if text.lower() in ("true", "false"):
                return text.lower() == "true"
            case "bool":
                raise self.error(node, keys, f"must be true or false, not {text[:40]}")
            case "int":
                return self._integer(node, keys, text)
            case "float":
                return self._float(node, keys, text)
        raise self.error(node, keys, f"has the tag {tag}; tags are not used in recipes")

    def _integer(self, node: Node, keys: Where, text: str) -> int:
        digits = text.lower().lstrip("+-")
        base = {"0x": 16, "0o": 8, "0b": 2}.get(digits[:2], 10)
        try:
            number = int(text, base)
            if abs(number) < 10**MAX_DIGITS:
                return number
            raise ValueError
        except ValueError:
            raise self.error(node, keys, "is not a whole number that can be used") from None

    def _float(self, node: Node, keys: Where, text: str) -> float:
        try:
            number = float(text.replace("_", ""))
        except ValueError:  # .inf and .nan, as YAML writes them
            number = math.nan
        if not math.isfinite(number):
            raise self.error(node, keys, f"must be a finite number, not {text[:40]}")
        return number


def _is_text(text: str) -> bool:
    return not any("\ud800" <= c <= "\udfff" for c in text)
