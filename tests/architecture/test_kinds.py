"""No room knows the kinds of another's methods: what differs from kind to kind, the kinds say themselves."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.architecture.test_rooms import FILES, PACKAGE

BY_DESIGN = ("validation", "export")
"""References share nothing with what they judge; formats of others know some kinds and refuse the rest."""
STILL_ASKED = {
    "cli/target_strength_command.py": {"MeshFile"},
    "frontiers/image_knobs.py": {"DenseDelayAndSum"},
    "frontiers/peer_rows.py": {"GriddedSynthesis"},
    "frontiers/signal_knobs.py": {"DirectSum", "GriddedSynthesis"},
    "planning/noise_rows.py": {"NoiseRecording"},
    "planning/notes/noise_checks.py": {"NoiseRecording"},
    "planning/notes/track_checks.py": {"RecordedTrack"},
    "signals/noise/point_sources.py": {"NoiseRecording"},
}
"""Kinds that other rooms ask for all the same: each could say for itself what it is asked for."""


def room(file: Path) -> str:
    return file.relative_to(PACKAGE).parts[0]


def kinds() -> dict[str, str]:
    """Room of each class that a recipe chooses by `kind`."""
    found = {}
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ClassDef) and any(
                isinstance(line, ast.AnnAssign) and ast.unparse(line.target) == "kind" and line.value is not None
                for line in node.body
            ):
                found[node.name] = room(file)
    return found


def test_no_room_asks_for_the_kinds_of_another() -> None:
    home, asked = kinds(), dict[str, set[str]]()
    assert len(home) > 80
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance":
                names = {inner.id for inner in ast.walk(node.args[1]) if isinstance(inner, ast.Name)}
            elif isinstance(node, ast.MatchClass):
                names = {ast.unparse(node.cls)}
            else:
                continue
            others = {name for name in names & home.keys() if home[name] != room(file)}
            if others and room(file) not in BY_DESIGN:
                asked.setdefault(file.relative_to(PACKAGE).as_posix(), set()).update(others)
    assert asked == STILL_ASKED
