"""The parts of tools/setup.py that need no network."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def setup(tmp_path: Path) -> ModuleType:
    """tools/setup.py of a copy in a folder with a space in its name."""
    clone = tmp_path / "a clone"
    (clone / "tools").mkdir(parents=True)
    for name in ("pyproject.toml", "tools/setup.py", "tools/requirements.lock"):
        (clone / name).write_bytes((ROOT / name).read_bytes())
    spec = importlib.util.spec_from_file_location("setting_up", clone / "tools" / "setup.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("library", "package"),
    [
        ("libusb-1.0.so.0", "libusb-1.0-0"),
        ("libidn2.so.0", "libidn2-0"),
        ("libX11.so.6", "libx11-6"),
        ("libEGL.so.1", "libegl1"),
        ("libGL.so.1", "libgl1"),
        ("libGLX.so.0", "libglx0"),
        ("libGLdispatch.so.0", "libglvnd0"),
        ("libxcb.so.1", "libxcb1"),
        ("libXau.so.6", "libxau6"),
        ("libudev.so.1", "libudev1"),
        ("libgcc_s.so.1", "libgcc-s1"),
        ("libgomp.so.1", "libgomp1"),
    ],
)
def test_a_shared_library_is_in_the_package_that_debian_policy_names(
    setup: ModuleType, library: str, package: str
) -> None:
    assert setup.debian_package(library) == package


def test_the_locked_uv_comes_with_its_hashes_and_nothing_else(setup: ModuleType) -> None:
    lines = setup.locked("uv").splitlines()
    assert lines[0].startswith("uv==")
    assert all(line.strip().startswith("--hash=sha256:") for line in lines[1:])
    assert len(lines) > 1
    with pytest.raises(setup.CannotSetUp, match="does not hold nothing-of-this-name"):
        setup.locked("nothing-of-this-name")


def test_a_change_of_the_lock_or_the_project_asks_for_a_new_set_up(setup: ModuleType) -> None:
    setup.PYTHON.parent.mkdir(parents=True)
    setup.PYTHON.symlink_to(sys.executable)
    assert not setup.up_to_date()
    setup.STAMP.write_text(setup.stamp())
    assert setup.up_to_date()
    for changed in (setup.LOCK, setup.ROOT / "pyproject.toml"):
        text = changed.read_text()
        changed.write_text(text + "\n# changed\n")
        assert not setup.up_to_date()
        changed.write_text(text)
        assert setup.up_to_date()
    setup.PYTHON.unlink()
    assert not setup.up_to_date()


def test_an_old_python_is_told_so_in_one_line(setup: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    setup.OLDEST = (99, 0)
    assert setup.main() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("setup: failed: needs Python 99.0 or newer")


def test_an_unreachable_registry_is_told_in_one_line(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    error = "WARNING: Retrying\nERROR: Could not find a version of uv\nERROR: No matching distribution\n"
    monkeypatch.setattr(setup, "make_environment", lambda: None)
    monkeypatch.setattr(setup, "run", lambda *command, **_: subprocess.CompletedProcess(command, 1, "", error))
    assert setup.main() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("pip cannot get uv from a package registry: ERROR: Could not find a version of uv")


def test_a_home_that_cannot_be_written_stops_neither_the_packages_nor_the_project(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """uv needs a cache there; what it cannot do pip does."""
    ran: list[list[str]] = []

    def run(*command: object, **_: object) -> subprocess.CompletedProcess[str]:
        ran.append(list(map(str, command)))
        by_uv = str(command[0]).endswith("/uv")
        return subprocess.CompletedProcess(ran[-1], int(by_uv), "", "error: failed to create directory `/.cache/uv`")

    monkeypatch.setattr(setup, "run", run)
    setup.install_packages()
    setup.install_project()
    by_pip = [command for command in ran if "pip" in command[:3] and not command[0].endswith("/uv")]
    assert [command[-1] for command in by_pip[1:]] == [str(setup.LOCK), str(setup.ROOT)]
    assert "--editable" in by_pip[-1]


def test_a_checkout_that_cannot_be_written_is_told_so_with_another_place(
    setup: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refused(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(setup.tempfile, "TemporaryFile", refused)
    assert setup.main() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{setup.ROOT} cannot be written (Permission denied)" in line
    assert "work in a copy" in line and "apt install" not in line
