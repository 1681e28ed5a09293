"""Writes down which kernels the first build of the README calls: sonarsynth/kernels.json, compiled ahead from then on.

.venv/bin/python tools/listed_kernels.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = """
import sys, tempfile
import sonarsynth as ss
from sonarsynth import compiling, compiling_ahead
with tempfile.TemporaryDirectory() as folder:
    ss.build(ss.load("configs/remus.yaml"), f"{folder}/s.zarr", workers=0)
sys.exit("compiled") if compiling.anew else print(*map(compiling_ahead.spelled, compiling.loaded), sep="\\n")
"""


def called() -> str:
    """The lines of the list: where all is kept, only what Python calls is looked up, not what that calls in turn."""
    command = [sys.executable, "-c", BUILD]
    first = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    return first.stdout or subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


if __name__ == "__main__":
    from sonarsynth.compiling_ahead import LISTED

    LISTED.write_text(called())
