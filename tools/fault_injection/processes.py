"""The command line in processes of their own: started, waited for, killed; where it hangs, its log says at what."""

from __future__ import annotations

import faulthandler
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

from sonarsynth import cli

LONGEST = 600.0
"""Seconds after which a build that was not killed counts as hung: on a busy machine a worker starts in a minute."""


def fork(arguments: list[str], log: Path) -> int:
    """Run the command line in a process and a group of its own, forked, so that it need not import all again."""
    sys.stdout.flush()
    child = os.fork()
    if child:
        return child
    status = 1
    try:
        os.setsid()
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(out, 1)
        os.dup2(out, 2)
        faulthandler.register(signal.SIGUSR1, file=out)
        cli.main(arguments)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 0
    finally:
        os._exit(status)


def ended(child: int) -> int | None:
    """Exit status of a process that has ended, None while it runs."""
    found, status = os.waitpid(child, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if found else None


def wait(child: int, limit: float = LONGEST) -> int | str:
    """Exit status of a process; "hung" where it had to be ended."""
    until = time.monotonic() + limit
    while time.monotonic() < until:
        if (status := ended(child)) is not None:
            return status
        time.sleep(0.01)
    return end_hung(child)


def end_hung(child: int) -> str:
    """End a process that hangs, with its group; what its threads were at goes to its log."""
    os.kill(child, signal.SIGUSR1)
    time.sleep(1.0)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "hung"


def kill_worker(child: int, dice: random.Random) -> bool:
    """Kill one worker process of a build, once there is one."""
    until = time.monotonic() + LONGEST
    while time.monotonic() < until:
        try:
            process = psutil.Process(child)
            found = workers_of(process)
            if not found and process.status() == psutil.STATUS_ZOMBIE:
                return False
        except psutil.Error:
            return False
        if found:
            strike(dice.choice(found).kill)
            return True
        time.sleep(0.01)
    return False


def workers_of(process: psutil.Process) -> list[psutil.Process]:
    """Worker processes of a build: they are forked from one that the building process starts."""
    servers = [one for one in process.children() if any("multiprocessing.forkserver" in word for word in one.cmdline())]
    return [worker for server in servers for worker in server.children()]


def strike(kill: Callable[[], object]) -> None:
    """Kill something that may have ended by itself."""
    with suppress(ProcessLookupError, psutil.NoSuchProcess):
        kill()
