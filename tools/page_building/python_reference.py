"""The page of all names of `sonarsynth`, of which mkdocstrings makes the reference."""

from __future__ import annotations

import inspect
from collections.abc import Iterable

import sonarsynth
from tools.page_building.tables import MADE, table

INTRODUCTION = """# Python

All that `import sonarsynth as ss` has. Numbers are SI, angles radians. `help(ss.NAME)` lists the parameters of each
with their units, limits and defaults. On the site each has its signature and its text below; without it, the tables
say what each is.
"""


def names() -> str:
    """The page: functions, then classes by the room that they live in."""
    found = {name: getattr(sonarsynth, name) for name in sonarsynth.__all__}
    functions = [name for name, thing in found.items() if inspect.isfunction(thing)]
    rooms: dict[str, list[str]] = {}
    for name in found.keys() - set(functions):
        rooms.setdefault(found[name].__module__.split(".")[1], []).append(name)
    groups = {"Functions": functions} | {room.capitalize(): sorted(rooms[room]) for room in sorted(rooms)}
    return f"{MADE}{INTRODUCTION}\n" + "\n\n".join(section(title, group) for title, group in groups.items()) + "\n"


def section(title: str, group: Iterable[str]) -> str:
    """A table of names, and a directive of mkdocstrings for each."""
    things = {name: getattr(sonarsynth, name) for name in group}
    rows = [(f"`{name}`", first_line(thing)) for name, thing in things.items()]
    directives = "\n".join(f"::: {thing.__module__}.{thing.__qualname__}" for thing in things.values())
    return f"## {title}\n\n{table(('name', ''), rows)}\n\n{directives}"


def first_line(thing: object) -> str:
    """The first sentence of a docstring."""
    return (inspect.getdoc(thing) or "").partition("\n\n")[0]
