"""The house: rooms of a dozen files, every file name once, and no circle of modules, not even for types."""

from __future__ import annotations

import ast
from collections import Counter
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "sonarsynth"
FILES = sorted(PACKAGE.rglob("*.py"))
ROOM = 12
"""Files in a folder at most."""
PLACES = 8
"""Parameters that a function takes by their place, at most."""


def name_of(file: Path) -> str:
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(file): file for file in FILES}


def imported(file: Path) -> set[str]:
    """The modules of the package that a file imports, anywhere in it, for types too."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name in MODULES}
        elif isinstance(node, ast.ImportFrom) and node.module in MODULES:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in MODULES else node.module for name in names}
    return found


def test_no_circle_of_modules() -> None:
    graph = {name: imported(file) for name, file in MODULES.items()}
    assert len(graph) > 400 and sum(map(len, graph.values())) > 1000
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as circle:
        raise AssertionError(f"a circle: {' -> '.join(circle.args[1])}") from None


def test_every_file_name_is_there_once() -> None:
    names = Counter(file.name for file in FILES if file.name != "__init__.py")
    assert [name for name, count in names.items() if count > 1] == []


def test_rooms_are_of_a_dozen_files_at_most() -> None:
    rooms = Counter(file.parent.relative_to(PACKAGE).as_posix() for file in FILES)
    assert {room: count for room, count in rooms.items() if count > ROOM} == {}


def test_at_most_eight_parameters_go_by_their_place() -> None:
    """Others go by name. Compiled kernels are let be: numba knows no arguments that go by name alone."""
    long = []
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef) and "jit(" not in "".join(map(ast.unparse, node.decorator_list)):
                places = [a.arg for a in (*node.args.posonlyargs, *node.args.args) if a.arg not in ("self", "cls")]
                long += [f"{name_of(file)}.{node.name}"] if len(places) > PLACES else []
    assert long == []
