"""An object store on loopback, a web server, and what lies in a place."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from sonarsynth.store import Folder, Remote
from tools.fault_injection import corrupt


def contents(folder: Folder) -> dict[str, bytes]:
    """Every file beneath."""
    if isinstance(folder, Remote):
        return {name: found for name, found in folder.read_each(folder.sizes()) if isinstance(found, bytes)}
    return corrupt.contents(folder)


class _Parts(http.server.SimpleHTTPRequestHandler):
    """Gives files and, as object stores do, parts of files; lists nothing."""

    ranges = True

    def log_message(self, *_: Any) -> None:
        pass

    def do_GET(self) -> None:
        file = Path(self.translate_path(self.path))
        if not file.is_file():
            self.send_error(404)
            return
        content, status = file.read_bytes(), 200
        asked = self.headers.get("Range", "").removeprefix("bytes=")
        if asked and self.ranges:
            first, _, last = asked.partition("-")
            content = content[int(first) : int(last) + 1 if last else None] if first else content[-int(last) :]
            status = 206
        self.send_response(status)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)


class _Whole(_Parts):
    ranges = False


class _Server(http.server.ThreadingHTTPServer):
    request_queue_size = 256  # with 5, those that come at once wait seconds for each other


@contextmanager
def web_server(folder: Path, *, ranges: bool = True) -> Iterator[str]:
    """Serve a folder on loopback; gives its address."""
    handler = partial(_Parts if ranges else _Whole, directory=str(folder))
    with _Server(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http:{'//'}127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()
