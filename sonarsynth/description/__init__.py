"""What people write: small, frozen, hashable classes, checked when built; the same class in Python and in YAML.

A family of interchangeable methods is a union of descriptions told apart by their `kind`:

    Beamformer = Annotated[FocusedDelayAndSum | PlaneWave, BY_KIND]

which is the registry, and `kind:` in YAML is the tag.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast, dataclass_transform

from pydantic import ConfigDict, Discriminator, Field, ValidationError
from pydantic.dataclasses import dataclass

from sonarsynth.description.field_messages import field_names, unknown, wrong_fields
from sonarsynth.description.schemas import HelpText

__all__ = ["BY_KIND", "ONE_OR_SEVERAL", "FieldError", "description", "unknown"]

BY_KIND: Any = Field(discriminator="kind")
"""Annotation of a union of descriptions: `kind` says which one."""


def _one_or_several(value: object) -> str:
    return "several" if isinstance(value, (list, tuple)) else "one"


ONE_OR_SEVERAL: Any = Discriminator(_one_or_several)
"""Annotation of a union of one (`Tag("one")`) and a tuple of such (`Tag("several")`)."""

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


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def description(cls: type[T]) -> type[T]:
    """Make a class a description: keyword arguments only, frozen, hashable, unknown fields refused, no NaN or infinity.

    Sequences are tuples; `help` lists the fields. Raises ValueError, one line, when fields are wrong.
    """
    written = cls.__doc__
    described = cast(type[T], dataclass(frozen=True, kw_only=True, config=_CONFIG)(cls))
    described.__init__ = _in_one_line(described.__init__)  # type: ignore[method-assign]
    if written:
        described.__doc__ = HelpText(written)  # type: ignore[assignment]  # Python asks it for the text
    return described


def _in_one_line(init: Callable[..., None]) -> Callable[..., None]:
    """A constructor whose errors are one line of what pydantic reports in several."""

    @wraps(init)
    def checked(self: object, *args: Any, **fields: Any) -> None:
        if args:
            raise TypeError(f"{type(self).__name__} takes its fields by name: {', '.join(field_names(type(self)))}")
        try:
            init(self, **fields)
        except ValidationError as error:
            wrong = [(".".join(map(str, keys)), text) for keys, text in wrong_fields(error, type(self), fields)]
            lines = [f"{field}: {text}" if field else text for field, text in wrong]
            raise ValueError(f"{type(self).__name__}: {'; '.join(lines)}") from None

    return checked
