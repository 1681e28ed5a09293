"""Random changes of Bellhop's arrivals (`.arr`): each is refused in one line, or compared with our rays."""

from __future__ import annotations

import os
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from fault_injection.judging import SECONDS, snapshot
from fault_injection.recipes import damaged, lines_changed, numbers, pick
from sonarsynth import planning
from sonarsynth.recipe import reading
from sonarsynth.validation.bellhop import ArrivalsError, compare_arrivals, comparison_table

RECORDED = Path(__file__).parents[2] / "tests/reference/bellhop"
ODD_LINES = (
    b"'3D'", b"'2D'", b"1000000000", b"-1", b"0", b"nan nan nan nan nan nan nan nan", b"1e300", b"1 2 3", b"5*1.0",
    b"1.5 0 1e-3 0 10 -10 1000000000000 0", b"1.5 0 inf 0 10 -10 1 0", b"0 0 0 0 0 0 0 0", b"\0", b"\xff",
)  # fmt: skip
odd_lines = lines_changed(ODD_LINES)


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Judge so many changed files. Returns what came of them."""
    names = ("uniform", "layers")
    plans = {n: planning.plan(reading.load(RECORDED / f"{n}.yaml"), (), planning.Choices()) for n in names}
    verdicts: Counter[str] = Counter()
    failures, began = [], time.perf_counter()
    with tempfile.TemporaryDirectory(dir=folder, prefix="arrivals-") as root:
        for number in range(count):
            random = np.random.default_rng([seed, number])
            name = names[number % len(names)]
            data = (RECORDED / f"{name}.arr").read_bytes()
            file = Path(root) / f"{number}.arr"
            if random.random() < 0.1:
                _trap(file, int(random.integers(4)))
            else:
                for _ in range(pick((1, 1, 2, 3), random)):
                    data = pick((numbers, numbers, odd_lines, damaged), random)(data, random)
                file.write_bytes(data)
            before = snapshot(Path(root))
            verdict = _judge(plans[name], file)
            verdict = verdict if snapshot(Path(root)) == before else "something written"
            verdicts[verdict.partition(":")[0]] += 1
            if not verdict.startswith(("compared", "refused")):
                failures.append(f"{number} ({name}): {verdict[:600]}")
            file.rmdir() if file.is_dir() else file.unlink()
    return {
        "ok": not failures,
        "cases": count,
        "seed": seed,
        "verdicts": dict(verdicts),
        "failures": failures,
        "seconds": time.perf_counter() - began,
    }


def _trap(file: Path, kind: int) -> None:
    """A device, a pipe, a folder, or a file larger than any memory."""
    if kind == 0:
        file.symlink_to("/dev/zero")
    elif kind == 1:
        os.mkfifo(file)
    elif kind == 2:
        file.mkdir()
    else:
        with file.open("wb") as huge:
            huge.truncate(1 << 40)


def _judge(plan: planning.Plan, file: Path) -> str:
    """What came of one file: `compared`, `refused: why`, or how it failed."""

    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    previous = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            comparison_table(compare_arrivals(plan, 0, file), file)
        return "compared"
    except ArrivalsError as error:
        line = str(error)
        return f"refused: {line}" if line.startswith(str(file)) and "\n" not in line else f"not one line: {line}"
    except TimeoutError:
        return "hang"
    except Exception:  # what is looked for
        return f"traceback: {traceback.format_exc()[-500:]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous)
