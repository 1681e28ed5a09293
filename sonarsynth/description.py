"""What people write: small, frozen, hashable classes, checked when built; the same class in Python and in YAML.

A family of interchangeable methods is a union of descriptions told apart by their `kind`:

    Beamformer = Annotated[FocusedDelayAndSum | PlaneWave, BY_KIND]

which is the registry, and `kind:` in YAML is the tag.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

BY_KIND: Any = Field(discriminator="kind")
"""Annotation of a union of descriptions: `kind` says which one."""

_CONFIG = ConfigDict(extra="forbid", allow_inf_nan=False, validate_default=True, use_attribute_docstrings=True)

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(Field,))
def description(cls: type[T]) -> type[T]:
    """Make a class a description: keyword arguments only, frozen, hashable, unknown fields refused, no NaN or infinity.

    Sequences are tuples. Raises `pydantic.ValidationError` (a ValueError) when a field is wrong.
    """
    decorate: Callable[[type[T]], type[T]] = dataclass(frozen=True, kw_only=True, config=_CONFIG)
    return decorate(cls)
