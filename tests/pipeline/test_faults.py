"""Faults on purpose, a few of each kind: the command that makes a thousand of them."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from tools.fault_injection import hostile, links, renames
from tools.fault_injection.corrupt import KINDS, run


@pytest.mark.long
def test_random_damages_are_found_and_repaired_to_the_byte(tmp_path: Path) -> None:
    summary = run(24, seed=7, folder=tmp_path)
    assert summary["missed"] == []
    assert summary["not_identical"] == []
    assert summary["ok"]
    assert (summary["found"], summary["repaired_to_identical"]) == (24, 24)
    assert {how for how in KINDS if any(name.startswith(how) for name in summary["tried"])} == set(KINDS)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "count"), [(links, 6), (hostile, 6), (renames, 3)])
def test_hostile_stores_touch_nothing_outside_and_lose_nothing(tmp_path: Path, kind: ModuleType, count: int) -> None:
    summary = kind.run(count, seed=5, folder=tmp_path)
    assert summary["wrong"] == []
    assert summary["ok"] and summary["trials"] == count
