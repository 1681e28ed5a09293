"""Other cores compile kernels ahead: which these are is as it is today, and what is listed and gone does no harm."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from sonarsynth import compiling, compiling_ahead
from tests.waiting import wait_until
from tools.listed_kernels import called

KERNELS = """
from typing import NamedTuple
from sonarsynth.compiling import compiled
class Pair(NamedTuple):
    x: float
    y: float
@compiled
def total(values, pair, place, kept):
    return values[0, 0] + pair.x * pair.y + place[1] if kept else 0.0
"""
CALL = """
import numpy as np
import added
from sonarsynth import compiling, compiling_ahead
compiling.when_first_missed.append(lambda: print("missed"))
values = np.full((2, 2, 2), 3.0)[:, 0]
values.flags.writeable = False
print(added.total(values, added.Pair(2.0, 5.0), (7, 8), True))
print(*map(compiling_ahead.spelled, compiling.loaded), sep="\\n")
"""
AHEAD = """
from pathlib import Path
from sonarsynth import compiling_ahead
compiling_ahead.LISTED = Path("kernels.json")
compiling_ahead.compile_part(0, 1)
"""


def test_the_list_is_of_what_the_first_build_calls() -> None:
    listed, needed = set(compiling_ahead.LISTED.read_text().splitlines()), set(called().splitlines())
    differ = listed ^ needed  # on another processor, a few may
    assert 10 * len(differ) <= len(needed), f"run tools/listed_kernels.py: {sorted(differ)}"


def test_what_is_listed_is_read_as_it_was_spelled() -> None:
    for line in compiling_ahead.LISTED.read_text().splitlines():
        module, name, *arguments = json.loads(line)
        kinds = tuple(compiling_ahead._type(text, import_module(module)) for text in arguments)
        assert compiling_ahead.spelled((module, name, kinds)) == line


def test_a_kernel_that_was_compiled_ahead_is_kept_for_who_calls_it(tmp_path: Path) -> None:
    def run(code: str) -> list[str]:
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True)
        return done.stdout.split("\n")[:-1]

    line = '["added", "total", "float64 2A fixed", ["Pair", "float64", "float64"], ["tuple", "int64", "int64"], "bool"]'
    gone = ('["nowhere", "total", "float64"]', '["added", "gone", "float64"]', '["added", "total", "float64"]')
    (tmp_path / "added.py").write_text(KERNELS)
    (tmp_path / "kernels.json").write_text("\n".join((line, *gone)))
    run(AHEAD)
    assert run(CALL) == ["21.0", line], "it is loaded, and so nothing is missed"
    (tmp_path / "added.py").write_text(KERNELS + "\n")
    assert run(CALL) == ["missed", "21.0", ""]


def test_other_cores_are_used_where_there_are_some(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []
    ended: list[object] = []

    class Started:
        def __init__(self, command: list[str], **_: object) -> None:
            started.append(command[-2:])

        def kill(self) -> None: ...

        def wait(self) -> None:
            ended.append(self)

    monkeypatch.setattr(compiling_ahead.subprocess, "Popen", Started)
    monkeypatch.setattr(compiling, "when_first_missed", [])
    for cores, parts in ((1, []), (2, [["0", "1"]]), (64, [["0", "3"], ["1", "3"], ["2", "3"]])):
        monkeypatch.setattr(compiling_ahead.os, "sched_getaffinity", lambda _, cores=cores: set(range(cores)))
        compiling_ahead.use_other_cores()
        compiling_ahead.use_other_cores()
        assert len(compiling.when_first_missed) == 1
        compiling.when_first_missed.pop()()
        assert started == parts
        wait_until(lambda: len(ended) == len(started))  # else it would be left among the processes
        started.clear()
        ended.clear()
