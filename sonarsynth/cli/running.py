"""Running a command: its exit status, and its error as one line, those of a recipe as a line each."""

from __future__ import annotations

import errno
import gc
import logging
import os
import re
import signal
import sys
import tempfile
import traceback
import warnings
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import typer

OURS, INPUT, STORE, INTERRUPTED = 1, 2, 4, 130
STATUS = (
    dict.fromkeys(("StoreLocked", "BuildEnded", "Damage"), STORE)
    | {"WrongReturn": OURS}
    | dict.fromkeys(
        ("RecipeError", "Mismatch", "NothingToDraw", "BadEnding", "TooLarge", "Unreachable", "NoScheduler")
        + ("RecordingError", "TrackError", "DetectionsError"),
        INPUT,
    )
)
"""Of errors that say all there is to say, by name: what raises them may not be imported yet."""
BAD_PLACE = FileNotFoundError, PermissionError, NotADirectoryError, IsADirectoryError, FileExistsError
"""What the system says of a place that a command was given and cannot use."""
UNUSABLE = errno.ELOOP, errno.ENAMETOOLONG
"""The same, of errors without a class: a link in a store or in a circle, a name that is too long."""
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


LACKS = re.compile(r"(?:Could not find node at|No variable named) '?([\w/.-]+)")
"""What xarray says of a variable or group that is not in a store, which is none of its marks: those are compared."""


class BadOption(ValueError):
    """Options that do not go together, or a text of one that cannot be read."""


def run(app: typer.Typer, arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    if arguments is None:
        arguments = sys.argv[1:]
        gc.set_threshold(50_000, 20, 50)  # what libraries make when they are imported stays: a tenth of a short command
    for name in ONE_THREAD:  # work is spread over processes; read when numpy is imported
        os.environ.setdefault(name, "1")
    before, usual = signal.signal(signal.SIGTERM, _interrupt), warnings.formatwarning
    warnings.formatwarning = lambda *said: f"sonarsynth: {said[0]}\n" if "Unmarked" in str(said[1]) else usual(*said)
    try:
        status = app(arguments, prog_name="sonarsynth", standalone_mode=False)
        return _interrupted() if status == INTERRUPTED else status if isinstance(status, int) else 0
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if "--debug" in arguments:
            traceback.print_exc()
        return _explain(error, "--debug" in arguments)
    finally:
        signal.signal(signal.SIGTERM, before)
        warnings.formatwarning = usual


def _interrupted() -> int:
    return _say("interrupted; run the same command again to resume", INTERRUPTED)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _explain(error: Exception, shown: bool) -> int:
    """Say an error in one line, those of a recipe in a line each; returns the exit status."""
    if hasattr(error, "format_message") and hasattr(error, "exit_code"):  # typer's own: wrong usage
        return _say(error.format_message() or "no command: sonarsynth --help lists them", INPUT)
    from sonarsynth.description import FieldError

    name = type(error).__name__
    if name == "Damage":
        logging.getLogger("asyncio").addFilter(_of_no_damage)  # other files that were read are of no interest
        warnings.filterwarnings("ignore", "coroutine .* was never awaited", RuntimeWarning)
    if name in STATUS or isinstance(error, (BadOption, FieldError)):
        lines = str(error).split("\n") if name == "RecipeError" else [str(error)]
        return max(_say(line, STATUS.get(name, INPUT)) for line in lines)
    if isinstance(error, OSError) and error.strerror:
        file = f"{error.filename}: " if error.filename else ""
        what = "is a file, and a folder is needed" if isinstance(error, FileExistsError) else error.strerror
        given = isinstance(error, BAD_PLACE) or error.errno in UNUSABLE
        return _say(f"{file}{what}", INPUT if given else OURS)
    if isinstance(error, KeyError) and (lacks := LACKS.search(str(error))):
        return _say(f"the store has no {lacks[1]}: another version wrote it, or another program", INPUT)
    line = f"{type(error).__name__}: {error}"
    return _say(line if shown else f"{line} (traceback in {_keep_traceback(error)})", OURS)


def _of_no_damage(record: logging.LogRecord) -> bool:
    return record.exc_info is None or type(record.exc_info[1]).__name__ != "Damage"


def _keep_traceback(error: Exception) -> str:
    with tempfile.NamedTemporaryFile("w", prefix="sonarsynth-", suffix=".traceback.txt", delete=False) as file:
        file.writelines(traceback.format_exception(error))
        return file.name


def _say(message: str, status: int) -> int:
    line = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in " ".join(message.split()))
    sys.stderr.write(f"sonarsynth: {line}\n")
    return status
