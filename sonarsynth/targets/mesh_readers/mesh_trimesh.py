"""Binary STL and GLB through trimesh, without a word from it, and without another file."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sonarsynth.geometry.surfaces import MeshError, Surface


def by_trimesh(kind: str, data: bytes) -> Surface:
    """Vertices and triangles of a file of this ending, as they stand there. Raises MeshError."""
    import trimesh

    try:
        with _silent():
            # bytes without a name: what the file may name in turn (materials, pictures, URLs) is not looked for
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
            return np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
    except Exception as error:  # whatever a reader may meet in a damaged file
        text = " ".join(str(error).split())[:120]
        raise MeshError(f"cannot be read as {kind.upper()} ({type(error).__name__}: {text})") from None


@contextmanager
def _silent() -> Iterator[None]:
    """Without warnings, and without what trimesh logs: tracebacks of what it tried first."""
    log = logging.getLogger("trimesh")
    before, log.disabled = log.disabled, True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = before
