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
    return set().union(*(own_modules(node) for node in ast.walk(ast.parse(file.read_text()))))


def own_modules(node: ast.AST) -> set[str]:
    """The modules of the package that a statement imports."""
    if isinstance(node, ast.Import):
        return {alias.name for alias in node.names if alias.name in MODULES}
    if isinstance(node, ast.ImportFrom) and node.module in MODULES:
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        return {name if name in MODULES else node.module for name in names}
    return set()


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
            decorators = "".join(map(ast.unparse, getattr(node, "decorator_list", [])))
            if isinstance(node, ast.FunctionDef) and "compiled" not in decorators and "jit(" not in decorators:
                places = [a.arg for a in (*node.args.posonlyargs, *node.args.args) if a.arg not in ("self", "cls")]
                long += [f"{name_of(file)}.{node.name}"] if len(places) > PLACES else []
    assert long == []


HEAVY = {"numba", "matplotlib", "distributed", "dask", "xarray", "zarr", "scipy", "trimesh", "embreex"}


def loads_heavy(name: str, known: dict[str, bool]) -> bool:
    """Whether importing a module of the package loads a library that takes long to import."""
    if name not in known:
        known[name] = False  # while it is looked at
        top = [
            node for node in ast.parse(MODULES[name].read_text()).body if isinstance(node, ast.Import | ast.ImportFrom)
        ]
        names = {alias.name for node in top if isinstance(node, ast.Import) for alias in node.names}
        names |= {node.module or "" for node in top if isinstance(node, ast.ImportFrom)}
        own = set().union(*(own_modules(node) for node in top)) if top else set()
        known[name] = bool({n.partition(".")[0] for n in names} & HEAVY) or any(loads_heavy(n, known) for n in own)
    return known[name]


def test_only_what_loads_a_heavy_library_is_imported_within_functions() -> None:
    """The commands are the exception: each imports what it runs, so that help is there at once."""
    light, seen, known = [], 0, {}
    for file in FILES:
        if "cli" in file.relative_to(PACKAGE).parts:
            continue
        for function in (n for n in ast.walk(ast.parse(file.read_text())) if isinstance(n, ast.FunctionDef)):
            inner = [n for n in ast.walk(function) if isinstance(n, ast.Import | ast.ImportFrom)]
            names = set().union(*(own_modules(node) for node in inner)) if inner else set()
            seen += len(names)
            light += [f"{name_of(file)} imports {name}" for name in names if not loads_heavy(name, known)]
    assert seen > 10
    assert light == []
