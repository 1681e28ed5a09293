"""Choices kept on this machine from one process to the next, with what they were measured to err by.

A file each, named by all that they follow from. One that is damaged, or cannot be read or written, is as none.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from pathlib import Path
from typing import Final

from numba.core.registry import cpu_target

from sonarsynth.description import named_files
from sonarsynth.description.code_version import code_digest, versions
from sonarsynth.planning.choices import Choices, choices_from
from sonarsynth.planning.plans import Errors

PLACE: Final = "SONARSYNTH_CACHE"
"""The variable of the environment that names the folder of what is kept; where it is empty, nothing is."""
MOST_FILES, MOST_BYTES = 1000, 1 << 20
"""Files that are kept, the last written, and bytes of one that is read."""

CODE: Final = code_digest()
"""Of the sources as they are loaded: they may be edited while a process runs, which then still chooses by those."""


def folder() -> Path | None:
    """Where choices are kept: below `PLACE`, the user's folder of caches where that is not set; None: nowhere."""
    caches = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    base = os.environ.get(PLACE, os.path.join(caches, "sonarsynth"))
    return Path(base) / "choices" if os.path.isabs(base) else None


def read(key: object) -> tuple[Choices, Errors] | None:
    """What was kept by a key; None where nothing was, or not all of it is there as it was written."""
    file = _file(key)
    if file is None:
        return None
    try:
        seal, _, body = named_files.read(file, MOST_BYTES).partition(b"\n")
        if seal != _seal(file, body):
            return None
        kept = json.loads(body)
        return choices_from(kept["choices"]), Errors(**{name: float(value) for name, value in kept["errors"].items()})
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def keep(key: object, choices: Choices, errors: Errors) -> None:
    """Keep choices by a key, at once or not at all; the oldest files go where there are too many."""
    file = _file(key)
    if file is None:
        return
    body = json.dumps({"choices": choices.as_json(), "errors": vars(errors)}).encode()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=file.suffix, delete=False) as scratch:
            scratch.write(_seal(file, body) + b"\n" + body)
        try:
            os.replace(scratch.name, file)
        finally:
            Path(scratch.name).unlink(missing_ok=True)
        for old in sorted(file.parent.glob(f"*{file.suffix}"), key=lambda one: -one.stat().st_mtime)[MOST_FILES:]:
            old.unlink()
    except OSError:
        return


def _file(key: object) -> Path | None:
    """The file of a key, whose text says all of it. By the processor the last digits of errors differ."""
    place = folder()
    if place is None:
        return None
    processor = cpu_target.target_context.codegen().magic_tuple()
    made_of = repr((key, CODE, sorted(versions().items()), processor))
    return place / f"{hashlib.sha256(made_of.encode()).hexdigest()}.choices"


def _seal(file: Path, body: bytes) -> bytes:
    """Digest of what a file holds, under its own name alone."""
    return hashlib.sha256(file.name.encode() + body).hexdigest().encode()
