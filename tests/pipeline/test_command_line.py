"""The command line: statuses, one line an error, and answers for programs."""

from __future__ import annotations

import json
import os
import re
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from sonarsynth import compiling, pipeline, planning, schedule, store
from sonarsynth.cli import app, printing
from sonarsynth.cli.running import BadOption, run
from sonarsynth.cli.selecting import frame_numbers, product_names
from sonarsynth.recipe import reading
from sonarsynth.schedule.build_report import Log
from sonarsynth.store.files.json_lines import read_lines
from tests.waiting import HANGING, wait_until

HERE = Path(__file__).parents[2]


class Answer:
    """What a command gave: its status, and what it printed."""

    def __init__(self, status: int, out: str, err: str) -> None:
        self.status, self.out, self.err = status, out, err


Command = Callable[..., Answer]


@pytest.fixture
def command(capfd: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    def call(*arguments: object) -> Answer:
        status = run(app, [str(a) for a in arguments])
        return Answer(status, *capfd.readouterr())

    return call


def one_line(answer: Answer) -> str:
    """The error, which must be all there is."""
    assert answer.out == ""
    assert answer.err.endswith("\n")
    assert answer.err.count("\n") == 1
    return answer.err.removeprefix("sonarsynth: ").rstrip()


def test_build_verify_and_build_again(command: Command, small_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    built = command("build", small_file, path, "--workers", "0", "--frames", "0:8")
    assert built.status == 0
    assert "8 frames written" in built.out
    verified = command("verify", path, "--json")
    answer = json.loads(verified.out)
    assert (answer["frames"], answer["frames_complete"], answer["problems"]) == (20, 8, [])
    assert verified.status == (0 if answer["ok"] else 4)
    again = command("build", small_file, path, "--workers", "0", "--frames", "0:8", "--json")
    assert again.status == 0
    assert json.loads(again.out)["written"] == 0
    other = command("build", small_file, path, "--workers", "0", "--set", "seed=4")
    assert other.status == 2
    assert "(seed: 3, now 4)" in one_line(other)
    for quick in (False, True):  # in frames, shard by shard
        seen: list[tuple[int, int, int]] = []
        store.verify(path, quick=quick, progress=lambda *counts, seen=seen: seen.append(counts))
        assert seen[-1] == (8, 8, 0) and seen == sorted(seen)
    (path / "image/energy/c.0.0.0").unlink()
    damaged = command("verify", path)
    assert damaged.status == 4
    assert "DAMAGE image/energy/c.0.0.0: the file is missing" in damaged.out


def test_a_damaged_file_is_one_line_and_status_4(small_file: Path, tmp_path: Path) -> None:
    """In processes of their own: what libraries say as they end counts too."""
    path = tmp_path / "s.zarr"
    assert run(app, ["build", str(small_file), str(path), "--workers", "0", "--frames", "0:8"]) == 0
    (file,) = (path / "image/energy").glob("c.0*")
    data = bytearray(file.read_bytes())
    data[len(data) // 3] ^= 1
    file.write_bytes(data)
    for name in ("show", "card", "report", "detect"):
        command = [sys.executable, "-m", "sonarsynth", name, str(path)]
        done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False)
        answer = Answer(done.returncode, done.stdout, done.stderr)
        assert answer.status == 4
        assert one_line(answer) == f"image/energy/{file.name}: its checksum is wrong: 'sonarsynth repair' restores it"


def test_a_folder_that_is_no_store_is_said_alike_by_every_command(command: Command, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no store")
    for name in ("show", "card", "report", "detect", "verify", "repair", "export"):
        answer = command(name, tmp_path)
        assert answer.status == 2
        assert one_line(answer) == f"{tmp_path} is not a store of sonarsynth"


def test_a_place_that_cannot_be_written_is_refused_before_anything_is_planned(
    command: Command, small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither below a file nor in /proc; and nothing is left behind where it can."""
    monkeypatch.setattr(planning, "plan", lambda *_: 1 / 0)
    file = tmp_path / "file"
    file.write_text("")
    for place, nearest in ((file / "s.zarr", file), (Path("/proc/nope/s.zarr"), Path("/proc"))):
        answer = command("build", small_file, place)
        assert answer.status == 2
        assert one_line(answer).startswith(f"{place}: nothing can be written in {nearest} (")
    store.try_writing(tmp_path / "new" / "s.zarr")
    assert not list(tmp_path.glob(".*"))


def test_failed_frames_are_status_3(
    command: Command, small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "trace_paths", lambda made, i: 1 / 0)
    answer = command("build", small_file, tmp_path / "s.zarr", "--workers", "0", "--frames", "3")
    assert answer.status == 3
    assert "frame 3 failed in trace: ZeroDivisionError: division by zero" in answer.out


def test_an_interrupted_build_is_status_130(
    command: Command, small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pipeline, "trace_paths", stop)
    answer = command("build", small_file, tmp_path / "s.zarr", "--workers", "0")
    assert answer.status == 130
    assert one_line(answer) == "interrupted; run the same command again to resume"


def test_a_store_that_is_locked_is_status_4_and_one_that_is_not_there_status_2(
    command: Command, small_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / "s.zarr"
    with store.lock(path):
        locked = command("build", small_file, path, "--workers", "0")
    assert locked.status == 4
    assert "s.zarr is being built by process" in one_line(locked)
    gone = command("verify", path)
    assert gone.status == 2
    assert one_line(gone) == f"{path}: no such store"


def test_our_own_fault_is_status_1_and_names_the_traceback(
    command: Command, small_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr("sonarsynth.schedule.build", lambda *_, **__: 1 / 0)
    answer = command("build", small_file, tmp_path / "s.zarr")
    assert answer.status == 1
    found = re.fullmatch(r"ZeroDivisionError: division by zero \(traceback in (.+)\)", one_line(answer))
    assert found is not None
    assert "Traceback (most recent call last)" in Path(found[1]).read_text()
    shown = command("--debug", "build", small_file, tmp_path / "s.zarr")
    assert shown.status == 1
    assert "Traceback (most recent call last)" in shown.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--frames", "0:21"], "--frames: '0:21' ends past the last frame, 19"),
        (["--frames", "x"], "--frames: 'x' is neither a frame number nor a range such as 0:8"),
        (["--products", "film"], "--products: 'film' is not a product; known: signals, image, cloud"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], "--workers starts processes on this machine"),
        (["--workers", "-1"], "Invalid value for '--workers'"),
        (["--wrokers", "1"], "No such option"),
        (["--set", "seed=-1"], "small.yaml:--set: seed: must be greater than or equal to 0, not -1"),
        (["--set", "scene.world.targets.0.motion.start.2=-20"], "small.yaml:--set: scene.world.targets.0.motion"),
        (["--set", "scene.world.sources.0.position=[1, 2, 3]"], "small.yaml:--set: scene.world.sources.0.position: "),
    ],
)
def test_bad_input_is_status_2_and_one_line(
    command: Command, small_file: Path, tmp_path: Path, arguments: list[str], message: str
) -> None:
    answer = command("build", small_file, tmp_path / "s.zarr", *arguments)
    assert answer.status == 2
    assert message in one_line(answer)
    assert not (tmp_path / "s.zarr").exists()


@pytest.mark.parametrize("of", ["plan", "build"])
def test_a_target_below_the_bed_at_some_frame_is_named_with_its_line(
    command: Command, small_file: Path, tmp_path: Path, of: str
) -> None:
    small_file.write_text(small_file.read_text().replace("stop: [10, 1, -5]", "stop: [10, 1, -9]"))
    answer = command(of, small_file, *([tmp_path / "s.zarr"] if of == "build" else []))
    assert answer.status == 2
    assert re.search(
        r"small\.yaml:9: scene\.world\.targets\.0\.motion: .*below the bottom at frame \d+", one_line(answer)
    )


def test_the_plan_for_people_and_for_programs(command: Command, small_file: Path) -> None:
    people, programs = command("plan", small_file), command("plan", small_file, "--json")
    assert people.status == programs.status == 0
    answer = json.loads(programs.out)
    assert {"stages", "left_out", "predicted_seconds", "predicted_bytes"} <= answer.keys()
    assert all({"stage", "method", "why", "error", "seconds", "bytes"} <= row.keys() for row in answer["stages"])
    assert "predicted:" in people.out


def test_the_schema_is_json(command: Command) -> None:
    answer = command("schema")
    assert answer.status == 0
    assert json.loads(answer.out)["title"] == "Recipe"


def test_frames_and_products_are_read() -> None:
    assert frame_numbers(None, 9) is None
    assert frame_numbers("0:3, 8,7:", 9) == (0, 1, 2, 7, 8)
    assert frame_numbers(":", 2) == (0, 1)
    assert product_names("image, cloud") == {"image", "cloud"}
    for text in ("", "3:3", "9", "-1", "1:2:3", ",", "0:10"):
        with pytest.raises(BadOption):
            frame_numbers(text, 9)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.long
def test_signals_end_a_build_and_its_workers_in_10_s_and_it_goes_on(
    small_file: Path, tmp_path: Path, number: signal.Signals
) -> None:
    path = tmp_path / "s.zarr"
    small_file.write_text(small_file.read_text().replace("frames: 20, interval: 0.1", "frames: 4000, interval: 2e-4"))
    code = (  # what runs in the background of a shell ignores SIGINT, and what it starts
        "import signal, sys\nfrom sonarsynth.cli import main\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\nmain(sys.argv[1:])"
    )
    building = subprocess.Popen(
        [sys.executable, "-c", code, "build", str(small_file), str(path), "--workers", "1", "--no-predict"],
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(HERE)}, start_new_session=True,
    )  # fmt: skip
    wait_until(lambda: any((path / ".marks").glob("[0-9]*.json")), lambda: building.poll() is None)
    family = psutil.Process(building.pid).children(recursive=True)
    assert family
    os.killpg(building.pid, number)  # as Ctrl-C, or a batch system, does
    _, err = building.communicate(timeout=HANGING)
    assert building.returncode == 130
    assert err.endswith("sonarsynth: interrupted; run the same command again to resume\n") and "Traceback" not in err
    assert psutil.wait_procs(family, timeout=HANGING)[1] == []
    assert not store.beside(path, "lock").exists()
    there = store.frames_there(path)
    assert len(there) >= 8
    report = store.verify(path, quick=True)
    left = "without a completion mark", "was not finished"  # data, or the mark itself
    assert all(any(words in problem.what for words in left) for problem in report.problems)
    again = schedule.build(reading.load(small_file), path, frames=range(len(there) + 1), workers=0)
    assert again.ok and set(there) <= set(store.frames_there(path))


def test_a_first_call_says_that_kernels_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Minutes on a new machine, which passed for planning."""
    kernel = tmp_path / "added.py"
    kernel.write_text(
        "from sonarsynth.compiling import compiled\n\n\n@compiled\ndef one_more(x):\n    return x + 1.0\n"
    )
    monkeypatch.setattr(printing, "SECONDS_BETWEEN_LINES", 0.01)
    monkeypatch.setattr(compiling, "anew", [])
    said: list[str] = []

    def lines(text: str) -> bool:
        said.append(capfd.readouterr().err)
        return text in "".join(said)

    with printing.planning():
        wait_until(lambda: lines("planning, 0 s"))
        assert runpy.run_path(str(kernel))["one_more"](3.0) == 4.0
        wait_until(lambda: lines("planning (1 kernel compiled so far, once for this machine), "))


def test_time_left_is_not_told_from_frames_that_waited_for_workers_and_kernels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was: 5.9 min left, of a second."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    log = Log(tmp_path / "log.jsonl")
    with printing.progress() as said:
        for seconds, done in ((0.0, 0), (140.0, 8), (150.0, 16), (160.0, 24)):
            now[0] = 100.0 + seconds
            for told in (said, log.progress):
                told(done, 64, 0)
    lines = ["8 of 64 frames", "16 of 64 frames, 0.8 frames/s, 60 s left", "24 of 64 frames, 0.8 frames/s, 50 s left"]
    assert capsys.readouterr().err.splitlines() == lines
    assert [event["seconds_left"] for event in read_lines(tmp_path / "log.jsonl")] == [None, 60.0, 50.0]
