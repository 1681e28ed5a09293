"""What people write: small, frozen, hashable classes, checked when built; the same class in Python and in YAML.

A family of interchangeable methods is a union of descriptions told apart by their `kind`:

    Beamformer = Annotated[FocusedDelayAndSum | PlaneWave, BY_KIND]

which is the registry, and `kind:` in YAML is the tag.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any, Final, TypeVar, cast, dataclass_transform

from pydantic import ConfigDict, Discriminator, Field
from pydantic.dataclasses import dataclass

from sonarsynth.description.schemas import HelpText

BY_KIND: Any = Field(discriminator="kind")
"""Annotation of a union of descriptions: `kind` says which one."""


def _one_or_several(value: object) -> str:
    return "several" if isinstance(value, (list, tuple)) else "one"


ONE_OR_SEVERAL: Any = Discriminator(_one_or_several)
"""Annotation of a union of one (`Tag("one")`) and a tuple of such (`Tag("several")`)."""

SYNONYMS: Final = {"file": "path", "filename": "path"}
"""What people write for a field, and its name, which is not spelt alike."""

_CONFIG = ConfigDict(extra="forbid", allow_inf_nan=False, validate_default=True)

T = TypeVar("T")


class FieldError(ValueError):
    """A field that is wrong in its scene: `path` leads to it from the recipe, `message` is one clear line."""

    def __init__(self, path: tuple[str | int, ...], message: str) -> None:
        super().__init__(f"{'.'.join(map(str, path))}: {message}")
        self.path = path
        self.message = message

    def __reduce__(self) -> tuple[type[FieldError], tuple[tuple[str | int, ...], str]]:
        return type(self), (self.path, self.message)


def unknown(name: str, names: Iterable[str], noun: str = "field") -> str:
    """That there is no such name, and which one it may be."""
    meant = [word for word in names if word == SYNONYMS.get(name)]
    close = meant or difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(names)}"
    return f"'{name}' is not a {noun} here; {hint}"


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def description(cls: type[T]) -> type[T]:
    """Make a class a description: keyword arguments only, frozen, hashable, unknown fields refused, no NaN or infinity.

    Sequences are tuples; `help` lists the fields. Raises `pydantic.ValidationError` (a ValueError) when a field is
    wrong.
    """
    written = cls.__doc__
    described = cast(type[T], dataclass(frozen=True, kw_only=True, config=_CONFIG)(cls))
    if written:
        described.__doc__ = HelpText(written)  # type: ignore[assignment]  # Python asks it for the text
    return described
