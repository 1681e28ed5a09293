"""What keys of recipes were called before, and are called still where random draws are keyed: no number changes."""

from __future__ import annotations

from typing import Final

Path = tuple[str | int, ...]
"""Keys and list indices from the top of a recipe."""

RENAMED: Final[dict[Path, str]] = {
    ("scene", "world", "shrimp"): "sources",
    ("scene", "world", "environment", "bed"): "bottom",
    ("scene", "physics", "visibility"): "occlusion",
    ("scene", "physics", "faintest"): "dynamic_range",
    ("scene", "processing", "ranging"): "placing",
}
"""Old path to the new last word of it."""


def new_path(path: Path) -> Path:
    """A path in the words of today."""
    for old, name in RENAMED.items():
        if path[: len(old)] == old:
            return (*old[:-1], name, *path[len(old) :])
    return path


def as_drawn(path: str) -> str:
    """The path of what varies in the words that its random draws are keyed by."""
    keys = path.split(".")
    for old, name in RENAMED.items():
        if keys[: len(old)] == [*old[:-1], name]:
            return ".".join([*map(str, old), *keys[len(old) :]])
    return path
