"""One case of bad input, judged: a command in a process of its own, and whether it ends as it must.

A case is a folder with a recipe and its files. `sonarsynth build` must accept it, or refuse it in one line that names
the recipe and the line in it, with status 2 and nothing on stdout; `sonarsynth plan` must then refuse it alike. A
recipe that is accepted must survive being written out and read back, as the workers of a build do. The time, the
memory and the files of the folder are watched. The process is forked from one that has everything imported: a case
takes little.
"""

from __future__ import annotations

import mmap
import os
import re
import resource
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from sonarsynth import cli, evaluation, planning, schedule, store
from sonarsynth.cli import printing
from sonarsynth.cli.running import run
from sonarsynth.description import FieldError
from sonarsynth.recipe import reading

SECONDS = 10
"""Of the processor until a recipe is accepted or refused; six times as long by the clock: machines are busy."""
MEMORY = 1 << 30
"""Bytes that a case may take above what the imports take."""
RECIPE = "case.yaml"
LINE = re.compile(
    rf"sonarsynth: {re.escape(RECIPE)}(?::(?P<line>\d+))?: (?:(?P<field>[A-Za-z_][\w.-]*): )?(?P<what>.+)"
)
PLACELESS = ("no such file", "is not a file", "is larger than", "cannot be read", "needs more memory")
"""What is wrong with a recipe that has no lines."""
ACCEPTED, REFUSED, LONG = "accepted", "refused", "accepted, planned for longer"


@dataclass(frozen=True)
class Outcome:
    """What came of a case."""

    verdict: str  # ACCEPTED, REFUSED, or how it failed
    field: str  # of a refusal
    text: str  # what was printed
    memory: int  # bytes at most, above the imports

    @property
    def ok(self) -> bool:
        """Whether the case ended as it must."""
        return self.verdict in (ACCEPTED, REFUSED, LONG)


def judge(folder: Path, *, must_refuse: bool = False, whole: bool = False) -> Outcome:
    """Plan, and build as far as it computes nothing, the recipe RECIPE in a folder; how that ended.

    `whole`: with the choices that a plan makes by trying them, which takes seconds.
    """
    before, told = snapshot(folder), mmap.mmap(-1, 16)  # told: memory at the start, and how far the case came
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            _child(folder, out.fileno(), err.fileno(), told, whole)
        _, ended, usage = os.wait4(child, 0)
        printed = _read(err)
        status = os.waitstatus_to_exitcode(ended)
        resident, checked = struct.unpack("<qq", told)
        memory = max(0, usage.ru_maxrss * 1024 - resident)
        verdict = _verdict(status, _read(out), printed, memory, bool(checked))
    after = snapshot(folder)
    changed = sorted(n for n in after.keys() | before.keys() if after.get(n) != before.get(n))
    if changed:
        verdict, printed = "something written", f"{changed[:5]} {printed}"
    if verdict == ACCEPTED and must_refuse:
        verdict = "not refused"
    found = LINE.fullmatch(printed.partition("\n")[0])
    return Outcome(verdict, (found and found["field"]) or "", printed, memory)


def snapshot(folder: Path) -> dict[str, tuple[int, int, int, bytes]]:
    """Everything in a folder: mode, size, time of change and content of each file."""
    found = {}
    for root, folders, files in os.walk(folder):
        for name in folders + files:
            path = Path(root, name)
            status = path.lstat()
            plain = path.is_file() and not path.is_symlink() and status.st_size < MEMORY
            content = path.read_bytes() if plain and status.st_blocks * 512 < 1 << 24 else b""
            found[str(path)] = (status.st_mode, status.st_size, status.st_mtime_ns, content)
    return found


def _verdict(status: int, out: str, err: str, memory: int, checked: bool) -> str:
    if -status in (signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL):
        return LONG if checked and memory <= MEMORY else "hang"
    if memory > MEMORY or "MemoryError" in err or "Unable to allocate" in err:
        return "memory"
    if status == 0:
        return ACCEPTED if not err else "accepted with words on stderr"
    if status != 2 or "Traceback" in err:
        return UNEXPECTED.get(status, f"status {status}")
    found, *others = (LINE.fullmatch(line) for line in err.splitlines() or [""])
    if out or found is None or None in others:
        return "refused, not in one line"
    return REFUSED if found["line"] or found["what"].startswith(PLACELESS) else "refused without a line"


IMPORTED = (evaluation, printing, schedule)
"""What commands import when they run: it is there before a process is forked."""

UNEXPECTED = {1: "traceback", 2: "traceback", 3: "build and plan differ, or a recipe that cannot be read back"}


def _child(folder: Path, out: int, err: int, told: mmap.mmap, whole: bool) -> None:
    """The forked process; does not return."""
    status = 1
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        os.chdir(folder)
        tempfile.tempdir = str(folder)  # what is left there is seen
        size, resident = (int(n) * resource.getpagesize() for n in Path("/proc/self/statm").read_text().split()[:2])
        told[:8] = struct.pack("<q", resident)
        resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        warnings.simplefilter("error")
        status = _commands(told, whole)
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        status = 1
        os.write(2, traceback.format_exc().encode("utf-8", "replace"))
    finally:
        os._exit(status)


def _from_now() -> None:
    """SECONDS from now on."""
    spent = int(time.process_time() + 0.5)
    resource.setrlimit(resource.RLIMIT_CPU, (spent + SECONDS, resource.RLIM_INFINITY))
    signal.alarm(6 * SECONDS)


def _commands(told: mmap.mmap, whole: bool) -> int:
    """Status of `build` up to where it computes; 3 where `plan` does not refuse what that refuses, in the same way."""
    plans: list[planning.Plan] = []
    planning.plan = _planner(plans, told, whole)
    _from_now()
    status = run(cli.app, ["build", RECIPE, "case.zarr", "--workers", "0"])
    if status == 0:
        return 0 if plans and _survives(plans[-1]) else 3
    if status != 2:
        return status
    sys.stderr.flush()
    said = os.lseek(2, 0, os.SEEK_CUR)
    _from_now()
    again = run(cli.app, ["plan", RECIPE])
    sys.stderr.flush()
    first, second = os.pread(2, said, 0), os.pread(2, 1 << 20, said)
    if again != 2 or first != second:
        return 3
    os.ftruncate(2, said)
    os.lseek(2, said, os.SEEK_SET)
    return 2


def _planner(plans: list[planning.Plan], told: mmap.mmap, whole: bool) -> Any:
    """A `planning.plan` that ends the command that calls it, with its result in `plans`.

    A plan has two parts: everything is checked, then choices are made by trying them, which takes what it takes.
    """
    found: dict[Any, FieldError] = {}
    planned: Any = planning.plan

    def in_parts(made: Any, products: Any = planning.PRODUCTS) -> planning.Plan:
        if made in found:
            raise found[made]
        try:
            checked: planning.Plan = planned(made, products, choices=planning.Choices())
        except FieldError as error:
            found[made] = error
            raise
        told[8:] = struct.pack("<q", 1)
        if whole:
            _from_now()
            checked = planned(made, products)
        plans.append(checked)
        raise typer.Exit(0)

    return in_parts


def _survives(made: planning.Plan) -> bool:
    """Whether the recipe as written into a store is the same when it is read back, and the store can be described."""
    store.layout_of(made)
    return reading.loads(reading.dump(made.recipe)) == made.recipe and bool(made.digest)


def _read(file: Any) -> str:
    file.seek(0)
    text: bytes = file.read(1 << 20)
    return text.decode("utf-8", "replace")
