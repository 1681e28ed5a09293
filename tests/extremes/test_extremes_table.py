"""The extremes table: every quick case is right, a wrong one is seen, and the command says so."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.validation import extremes
from sonarsynth.validation.extremes import Case, groups, outcome
from sonarsynth.validation.extremes.outcomes import CaseResult, holds, off, refused, relative, together

QUICK = [(group, case) for group, cases in groups().items() for case in cases if not case.slow]


SECONDS = ("a body at every bearing", "targets of 1 um, 1 mm and 1 km", "a target on the baseline")
"""Cases that take several."""
ASKED = [
    pytest.param(group, case, id=f"{group}: {case.name}", marks=[pytest.mark.long] if case.name in SECONDS else [])
    for group, case in QUICK
]


@pytest.mark.parametrize(("group", "case"), ASKED)
def test_what_must_come_out_does(group: str, case: Case) -> None:
    row = outcome(group, case)
    assert row.ok, row.got
    assert row.expected


def test_names_are_all_different() -> None:
    names = [case.name for cases in groups().values() for case in cases]
    assert len(set(names)) == len(names)
    assert set(SECONDS) < set(names)


def _refuse() -> None:
    raise ValueError("too large")


def test_wrong_and_missing_numbers_are_seen() -> None:
    assert not off(np.nan, 1.0).ok
    assert not off([], 1.0).ok
    assert not off([0.0, 2.0], 1.0).ok
    assert not relative([1.0, 2.0], [1.0], 1.0).ok
    assert relative([1.0], [1.0 + 1e-9], 1e-8).ok
    assert not refused(lambda: None, "").ok
    assert refused(_refuse, "large").ok and not refused(_refuse, "small").ok
    assert not together(holds(True, "a"), holds(False, "b")).ok
    assert not together([]).ok
    assert not together([holds(True, "a"), holds(False, "b")]).ok


@pytest.mark.parametrize("check", [lambda: warnings.warn("odd", RuntimeWarning, stacklevel=1), _refuse])
def test_a_warning_and_an_error_are_failures(check: object) -> None:
    row = outcome("any", Case("odd", "nothing", check))  # type: ignore[arg-type]
    assert not row.ok
    assert "odd" in row.got or "too large" in row.got


@pytest.mark.parametrize("ok", [True, False])
def test_the_command_prints_rows_and_tells_by_its_status(
    ok: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = Case("one", "1", lambda: CaseResult("1", True)), Case("two", "2", lambda: CaseResult("2", ok))
    monkeypatch.setattr(extremes, "groups", lambda: {"few": cases})
    assert run(app, ["accuracy", "--extremes", "--json", "--out", str(tmp_path)]) == (0 if ok else 1)
    rows = json.loads(capsys.readouterr().out)
    assert [row["ok"] for row in rows] == [True, ok]
    assert all({"case", "expected", "got", "ok", "seconds", "group"} == set(row) for row in rows)
    assert json.loads((tmp_path / "extremes.json").read_text()) == rows
    assert run(app, ["accuracy", "--extremes", "--out", str(tmp_path)]) == (0 if ok else 1)
    assert ("all passed, none skipped" in capsys.readouterr().out) == ok


def test_it_goes_without_a_reference(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["accuracy", "--extremes", "--reference", "rays"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
