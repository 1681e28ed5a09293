"""A folder of objects at a URL, by fsspec: s3://, gs://, memory://, and https to read from.

Objects appear whole or not at all, cannot be renamed, and are not locked. Credentials are those that the driver finds
in the environment: a URL may hold none, so none goes into the store, the log, or the arguments of a task. What the
driver raises for whatever reason becomes one line; what is simply not there is a FileNotFoundError, as on a disk.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Final

OPTIONS: Final[Mapping[str, Mapping[str, Any]]] = {
    "s3": {"config_kwargs": {"connect_timeout": 10, "retries": {"max_attempts": 3}}},
}
"""Settings of drivers: no minutes of waiting for a server that is not there."""

READ_ONLY: Final = ("http", "https")
"""Schemes that can neither be written nor listed."""

_STAMPS: Final = ("ETag", "LastModified", "etag", "updated", "generation", "created", "modified")

MOST_REMOVED: Final = 1000
"""Objects that are removed at a time."""

AT_ONCE: Final = 64
"""Objects that are under way at a time."""


class Unreachable(RuntimeError):
    """A URL that leads nowhere, or where this may not be done; str() is one line."""


@dataclass(frozen=True)
class Remote:
    """A place at a URL: an object, or what lies beneath it."""

    url: str

    def __post_init__(self) -> None:
        scheme, separator, address = self.url.partition("://")
        host, _, path = address.partition("/")
        if not separator or "::" in self.url or not re.fullmatch(r"[a-z][a-z0-9+.-]*", scheme):
            raise Unreachable(f"{self.url}: is not the URL of a store, such as s3://bucket/remus.zarr")
        if "@" in host:
            shown = f"{scheme}://...@{host.rpartition('@')[2]}/{path}"
            raise Unreachable(f"{shown}: a URL may hold no credentials: the driver takes them from the environment")
        if "?" in address or "#" in address:
            raise Unreachable(f"{self.url.partition('?')[0].partition('#')[0]}: a URL may hold no ? and no #")
        if not path.strip("/") and not (scheme == "memory" and host):
            raise Unreachable(f"{self.url}: names no place in {host or scheme}: add a name, such as /remus.zarr")
        object.__setattr__(self, "url", self.url.rstrip("/"))

    def __str__(self) -> str:
        return self.url

    def __truediv__(self, name: str) -> Remote:
        return Remote(f"{self.url}/{name}")

    @property
    def scheme(self) -> str:
        """Such as s3."""
        return self.url.partition("://")[0]

    @property
    def name(self) -> str:
        """The last part."""
        return self.url.rpartition("/")[2]

    def with_name(self, name: str) -> Remote:
        """A place beside this one."""
        return Remote(f"{self.url.rpartition('/')[0]}/{name}")

    @property
    def listed(self) -> bool:
        """True where one can ask what lies beneath."""
        return self.scheme not in READ_ONLY

    @property
    def shared(self) -> bool:
        """True where other processes see the same."""
        return self.scheme != "memory"

    @cached_property
    def _reached(self) -> tuple[Any, str]:
        """The driver, and the path as it names it."""
        import fsspec

        with self._told():
            options = OPTIONS.get(self.scheme, {})
            filesystem: tuple[Any, str] = fsspec.core.url_to_fs(self.url, use_listings_cache=False, **options)
        return filesystem

    @property
    def driver(self) -> Any:
        """The fsspec file system."""
        return self._reached[0]

    @property
    def path(self) -> str:
        """The path as the driver names it."""
        return self._reached[1]

    def exists(self) -> bool:
        """True for an object, or where there is one beneath."""
        return self.is_file() or self.is_dir()

    def is_file(self) -> bool:
        """True for an object."""
        with self._told():
            try:
                return bool(self.driver.info(self.path)["type"] == "file")
            except FileNotFoundError:
                return False

    def is_dir(self) -> bool:
        """True where there is an object beneath."""
        if not self.listed:
            return (self / "zarr.json").is_file() or (self / ".marks/layout.json").is_file()
        with self._told():
            try:
                return any(self.driver.ls(self.path, detail=False))
            except (FileNotFoundError, NotADirectoryError):
                return False

    def sizes(self) -> dict[str, int]:
        """Every object beneath, by its name from here, and its size in bytes; in the order of the names."""
        return {name: int(facts["size"] or 0) for name, facts in self._beneath().items()}

    def stamps(self) -> dict[str, object]:
        """What tells of each object beneath whether it was written again; nothing where it cannot be listed."""
        objects = self._beneath() if self.listed else {}
        return {name: tuple(str(facts.get(key)) for key in _STAMPS) for name, facts in objects.items()}

    def age(self) -> float:
        """Seconds since an object was written; 0 where nobody knows, or it is not there."""
        with self._told():
            try:
                return float((datetime.now(UTC) - self.driver.modified(self.path)).total_seconds())
            except (NotImplementedError, FileNotFoundError, TypeError):
                return 0.0

    def _beneath(self) -> dict[str, dict[str, Any]]:
        if not self.listed:
            raise Unreachable(f"{self.url}: cannot be listed")
        with self._told():
            try:
                objects = self.driver.find(self.path, detail=True)
            except FileNotFoundError:
                return {}
        start = len(self.path.rstrip("/")) + 1
        return {path[start:]: facts for path, facts in sorted(objects.items()) if len(path) > start}

    def read_bytes(self) -> bytes:
        """The content of an object. Raises FileNotFoundError."""
        with self._told():
            content: bytes = self.driver.cat_file(self.path)
        return content

    def read_text(self, encoding: str = "utf-8", errors: str = "strict") -> str:
        """The content of an object as text. Raises FileNotFoundError."""
        return self.read_bytes().decode(encoding, errors)

    def read_each(self, names: Iterable[str]) -> Iterator[tuple[str, bytes | OSError]]:
        """The contents of objects beneath, many at a time; FileNotFoundError for those that are not there."""
        waiting = list(names)
        for first in range(0, len(waiting), AT_ONCE):
            batch = waiting[first : first + AT_ONCE]
            paths = {f"{self.path}/{name}": name for name in batch}
            with self._told():
                contents = self.driver.cat(list(paths), on_error="return") if len(paths) > 1 else self._one(*paths)
            for path, name in paths.items():
                content = contents.get(path, FileNotFoundError(name))
                if isinstance(content, Exception) and not isinstance(content, FileNotFoundError):
                    with self._told():
                        raise content
                yield name, content

    def _one(self, path: str) -> dict[str, bytes | Exception]:
        try:
            return {path: self.driver.cat_file(path)}
        except FileNotFoundError as error:
            return {path: error}

    def write_bytes(self, content: bytes) -> None:
        """Write an object, whole."""
        self._writable()
        with self._told(writing=True):
            self.driver.pipe_file(self.path, content)

    def write_each(self, contents: Mapping[str, bytes]) -> None:
        """Write objects beneath, many at a time."""
        self._writable()
        names = list(contents)
        for first in range(0, len(names), AT_ONCE):
            batch = {f"{self.path}/{name}": contents[name] for name in names[first : first + AT_ONCE]}
            with self._told(writing=True):
                self.driver.pipe(batch)

    def write_if_absent(self, content: bytes) -> bool:
        """Write an object that is not there; False where it is. At once, where the driver can do that (S3 can)."""
        self._writable()
        with self._told(writing=True):
            try:
                self.driver.pipe_file(self.path, content, mode="create")
            except FileExistsError:
                return False
            except NotImplementedError:
                if self.driver.exists(self.path):
                    return False
                self.driver.pipe_file(self.path, content)
        return True

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove an object. Raises FileNotFoundError."""
        self._writable()
        with self._told():
            try:
                self.driver.rm_file(self.path)
            except FileNotFoundError:
                if not missing_ok:
                    raise

    def unlink_each(self, names: Iterable[str]) -> None:
        """Remove objects beneath, which are there, many at a time."""
        self._writable()
        waiting = [f"{self.path}/{name}" for name in names]
        with self._told():
            for first in range(0, len(waiting), MOST_REMOVED):
                self.driver.rm(waiting[first : first + MOST_REMOVED])

    def zarr_store(self) -> Any:
        """The store as zarr and xarray open it, to read. Raises Unreachable where only whole files can be had."""
        from zarr.storage import FsspecStore

        with self._told():
            if not self.listed and len(self.driver.cat_file(f"{self.path}/zarr.json", start=0, end=2)) != 2:
                raise Unreachable(f"{self.url}: the server gives no parts of files (HTTP ranges), which chunks need")
            options = {"use_listings_cache": False, **OPTIONS.get(self.scheme, {})}
            return FsspecStore.from_url(self.url, storage_options=options, read_only=True)

    def _writable(self) -> None:
        if not self.listed:
            raise Unreachable(f"{self.url}: can be read, not written")

    @contextmanager
    def _told(self, *, writing: bool = False) -> Iterator[None]:
        """Turn what a driver raises into one line; but FileNotFoundError, where something is read."""
        try:
            yield
        except (Unreachable, NotADirectoryError, FileExistsError):
            raise
        except FileNotFoundError as error:
            if not writing:
                raise
            raise Unreachable(f"{self.url}: there is no such place: {_line(error)}") from None
        except ImportError as error:
            raise Unreachable(f"{self.url}: a package is missing: {_line(error)}") from None
        except PermissionError as error:
            raise Unreachable(f"{self.url}: not permitted: {_line(error)}") from None
        except Exception as error:  # whatever a driver has for what went wrong
            raise Unreachable(f"{self.url}: {_line(error)}") from None


def _line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text[:300] if text else type(error).__name__
