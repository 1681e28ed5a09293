"""tools/faults --kills: as many kills as fit, and all of them without a trace; and what it would not miss."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def faults(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the tool."""
    paths = os.pathsep.join([str(ROOT), str(ROOT / "tools")])
    return subprocess.run(
        [sys.executable, "-m", "fault_injection", *arguments],
        env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False, timeout=3600,
    )  # fmt: skip


@pytest.mark.long
def test_killed_builds_come_out_identical() -> None:
    """The client is killed; workers that are have laws in test_surviving and test_losing_workers."""
    done = faults("--kills", os.environ.get("SONARSYNTH_KILLS", "1"), "--seed", "3")
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads(done.stdout)
    assert summary["ok"]
    assert summary["identical"] == summary["trials"]
    assert summary["kills"] >= 1


@pytest.mark.parametrize("arguments", [(), ("--kills", "0"), ("--kills", "many")])
def test_what_the_tool_cannot_do_is_said(arguments: tuple[str, ...]) -> None:
    done = faults(*arguments)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_a_changed_store_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "tools")
    kills = importlib.import_module("fault_injection.kills")
    (tmp_path / "tiny.yaml").write_text(kills.RECIPE)
    whole = kills._undisturbed(tmp_path / "tiny.yaml", tmp_path / "whole.zarr")
    assert kills._different(whole.path, whole) == [] == kills._bad_marks(whole.path, whole)
    file = next(whole.path.glob("signals/pressure/c.1.*"))
    file.write_bytes(file.read_bytes()[:-1])
    assert kills._different(whole.path, whole) and kills._bad_marks(whole.path, whole)
