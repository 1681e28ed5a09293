"""Texts of the command line that select frames and products, and those that describe a thing."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sonarsynth.cli.running import BadOption


def frame_numbers(text: str | None, count: int) -> tuple[int, ...] | None:
    """Frames named by "0:8", "3", "8:" or several with commas; None (all) for None. Raises BadOption."""
    return _numbers("--frames", "frame", text, count)


def chosen_frames(frames: str | None, sequences: str | None, first: Sequence[int]) -> tuple[int, ...] | None:
    """Frames, of sequences with these first ones (sequence + 1,), that both texts name; None for all.

    Raises BadOption.
    """
    numbers = frame_numbers(frames, first[-1])
    chosen = _numbers("--sequences", "sequence", sequences, len(first) - 1)
    if chosen is None:
        return numbers
    if numbers is None:
        return tuple(frame for n in chosen for frame in range(first[n], first[n + 1]))
    wanted = {frame for n in chosen for frame in range(first[n], first[n + 1])}
    both = tuple(frame for frame in numbers if frame in wanted)
    if not both:
        raise BadOption("--frames and --sequences have no frame in common")
    return both


def _numbers(option: str, noun: str, text: str | None, count: int) -> tuple[int, ...] | None:
    if text is None:
        return None
    chosen: set[int] = set()
    for term in text.split(","):
        match = re.fullmatch(r"\s*(\d*)(:?)(\d*)\s*", term)
        if match is None or not term.strip() or not (match[2] or match[1]):
            raise BadOption(f"{option}: '{term}' is neither a {noun} number nor a range such as 0:8")
        first = int(match[1] or 0)
        stop = (int(match[3]) if match[3] else count) if match[2] else first + 1
        if stop > count:
            raise BadOption(f"{option}: '{term}' ends past the last {noun}, {count - 1}")
        if stop <= first:
            raise BadOption(f"{option}: '{term}' contains no {noun}; they are numbered 0 to {count - 1}")
        chosen.update(range(first, stop))
    return tuple(sorted(chosen))


def product_names(text: str) -> frozenset[str]:
    """Products named with commas. Raises BadOption."""
    from sonarsynth.planning import chosen_products

    try:
        return chosen_products(name.strip() for name in text.split(",") if name.strip())
    except ValueError as error:
        raise BadOption(f"--products: {error}") from None


def described(text: str, name: str, kind: Any) -> Any:
    """The description of a YAML text; kind: its class or union. Raises BadOption, RecipeError."""
    from pydantic import TypeAdapter, ValidationError

    from sonarsynth.recipe.reading.messages import explain
    from sonarsynth.recipe.reading.yaml_source import read_text

    if not text.lstrip().startswith("{"):
        raise BadOption(f"{name}: must be a mapping such as '{{kind: kirchhoff}}', not '{text}'")
    source = read_text(text, name, Path.cwd())
    try:
        return TypeAdapter(kind).validate_json(json.dumps(source.data), strict=True)
    except ValidationError as error:
        raise explain(error, kind, source) from None
