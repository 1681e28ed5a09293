"""Files of casts as instruments and archives have them; each is told by what it holds, not by its ending."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import re
import zipfile
import zlib
from pathlib import Path
from typing import Any, Final

from sonarsynth.description import named_files
from sonarsynth.environment.readers.bellhop_env import is_bellhop, is_range_dependent, ranges_beside, read_bellhop
from sonarsynth.environment.readers.cast_columns import called
from sonarsynth.environment.readers.cast_netcdf import read_netcdf
from sonarsynth.environment.readers.cast_table import MAX_ROWS, CastError, CastTable
from sonarsynth.environment.readers.fixed_columns import read_fixed_columns
from sonarsynth.environment.readers.named_columns import read_named_columns
from sonarsynth.environment.readers.sea_bird import is_sea_bird, read_sea_bird

__all__ = ["READ", "CastError", "CastTable", "called", "files_of", "read_cast"]

READ: Final = (
    "Sea-Bird CNV, ROS and BTL; CastAway, Valeport, AML, RBR, Sippican EDF, MVP, SAIV, Idronaut, Sea and Sun, "
    "Oceanscience and other tables with column names and units; Kongsberg ASVP and S, Hypack, Caris, ISS, Sonardyne, "
    "TSK, UNB; .env of Bellhop with its .ssp; netCDF of Argo, WOA and Turo; any of them in .gz, .bz2 or .zip"
)
"""What is read, for refusals."""

MAX_BYTES: Final = 1 << 26


def read_cast(
    path: Path, profile: int | None = None, latitude: float | None = None, longitude: float | None = None
) -> CastTable:
    """The cast in a file, as it stands there: nothing is left out, nothing put in order.

    Parameters
    ----------
    path: the file, of any ending.
    profile: which of several casts, from 0; left out: the first, which is noted.
    latitude, longitude: degrees, where a grid holds many places.

    Raises
    ------
    CastError in one line that names the file, and says what is read where it is none of that.
    """
    with named_files.errors_as(CastError, path):
        data = _unpacked(named_files.read(path, MAX_BYTES))
    if data[:3] == b"CDF" or data[:4] == b"\x89HDF":
        table = read_netcdf(path, data, profile, latitude, longitude)
    elif is_sea_bird(data):
        table = read_sea_bird(path, data, _decoded(data))
    else:
        table = _read_text(path, data, profile)
    if len(table.lines) > MAX_ROWS:
        raise CastError(f"{path}: has more than {MAX_ROWS} rows")
    return table


def files_of(path: Path) -> tuple[Path, ...]:
    """The files that are read for a cast: it, and what an environment of Bellhop has beside it."""
    beside = ranges_beside(path)
    return (path, beside) if path.suffix.lower() == ".env" and beside.is_file() else (path,)


def _read_text(path: Path, data: bytes, profile: int | None) -> CastTable:
    text = _decoded(data)
    if "\0" in text[:4096]:
        raise CastError(f"{path}: is not a text file, nor netCDF; read are {READ}")
    table = read_bellhop(path, text, profile) if is_bellhop(text) else read_fixed_columns(path, text, profile or 0)
    try:
        table = table or read_named_columns(path, text)
    except CastError:
        if is_range_dependent(text):
            line = "is a .ssp of Bellhop, sound speeds without depths: give the .env beside it, which has them"
            raise CastError(f"{path}: {line}") from None
        raise
    if profile and not table.several:
        raise CastError(f"{path}: has no profile {profile}: it holds one cast")
    return table


def _decoded(data: bytes) -> str:
    """Text of UTF-8, of UTF-16 with its mark, else of Latin-1, with one kind of line end."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", "replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    return re.sub("\r+\n?", "\n", text)


UNPACKING: Final = (
    OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile, NotImplementedError, RuntimeError,
    UnicodeDecodeError,
)  # fmt: skip
"""What a damaged archive may bring."""


def _unpacked(data: bytes) -> bytes:
    """What a packed file of one file holds, of MAX_BYTES at most. Raises FileError."""
    try:
        if data[:2] == b"\x1f\x8b":
            return _bounded(gzip.GzipFile(fileobj=io.BytesIO(data)))
        if data[:3] == b"BZh":
            return _bounded(bz2.BZ2File(io.BytesIO(data)))
        if data[:4] == b"PK\x03\x04":
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                files = [info for info in archive.infolist() if not info.is_dir()]
                if len(files) != 1:
                    raise named_files.FileError(f"is an archive of {len(files)} files, not of one cast")
                with archive.open(files[0]) as member:
                    return _bounded(member)
    except UNPACKING as error:
        raise named_files.FileError(f"cannot be unpacked ({' '.join(str(error).split())[:80]})") from None
    return data


def _bounded(file: Any) -> bytes:
    data: bytes = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise named_files.FileError(f"unpacks to more than {MAX_BYTES >> 20} MiB")
    return data
