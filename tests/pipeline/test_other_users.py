"""Clusters of ours are for who started them: without the key of the run nobody reaches them, nor finds any web page."""

from __future__ import annotations

import os
import pwd
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from distributed import Client, Security

from sonarsynth.schedule import connecting

ROOT = Path(__file__).resolve().parents[2]
ATTACK = """\
import os, re, socket, ssl, sys
from pathlib import Path

said = []
for port in map(int, sys.argv[1].split(",")):
    with socket.create_connection(("127.0.0.1", port), 60) as plain:
        plain.settimeout(60)
        try:
            plain.sendall(b"GET /info/main/workers.html HTTP/1.0\\r\\n\\r\\n")
            if plain.recv(1):
                said.append(f"{port} answers in plain")
        except OSError:
            pass
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    try:
        with context.wrap_socket(socket.create_connection(("127.0.0.1", port), 60)) as coded:
            coded.sendall(b"hello")
            if coded.recv(1):
                said.append(f"{port} answers without a certificate")
    except OSError:
        pass
for process in sys.argv[2].split(","):
    for name in ("environ", "mem"):
        try:
            Path(f"/proc/{process}/{name}").open("rb").read(1)
            said.append(f"{name} of {process} can be read")
        except OSError:
            pass
for file in (Path(folder, name) for folder, _, names in os.walk(sys.argv[3]) for name in names):
    try:
        new = file.stat().st_mtime >= float(sys.argv[4])
        if new and file.is_file() and re.match(b"-----BEGIN [A-Z ]*PRIVATE KEY", file.read_bytes()):
            said.append(f"{file} can be read")
    except OSError:
        pass
print(*said, sep="; ", end="")
"""


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with connecting.connected(1) as connected:
        yield connected


def processes() -> list[psutil.Process]:
    us = psutil.Process()
    return [us, *us.children(recursive=True)]


def ports() -> set[int]:
    """Ports that this process and those that it started listen on."""
    found = [connection for process in processes() for connection in process.net_connections(kind="tcp")]
    return {connection.laddr.port for connection in found if connection.status == psutil.CONN_LISTEN}


def test_a_dashboard_is_there_where_it_is_asked_for() -> None:
    with connecting.connected(1, dashboard=True) as connected:
        page = connected.dashboard_link.replace("/status", "/health")
        assert urllib.request.urlopen(page).read() == b"ok"


def test_a_client_without_the_key_of_the_run_is_refused(client: Client) -> None:
    address = client.scheduler.address
    assert address.startswith("tls://127.0.0.1:")
    assert client.dashboard_link == ""
    strangers = {address: Security.temporary(), address.replace("tls://", "tcp://"): Security()}
    for place, security in strangers.items():
        with pytest.raises(OSError):
            Client(place, security=security, timeout=3, set_as_default=False)
    assert client.submit(abs, -1).result() == 1


def test_nothing_answers_without_a_certificate(client: Client) -> None:
    """Not the scheduler, the workers, nor any web server; whoever asks, as another user does below."""
    assert attacked() == ""


@pytest.mark.long
def test_another_user_reaches_neither_scheduler_workers_nor_keys(client: Client) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    nobody = pwd.getpwnam("nobody")
    assert attacked(user=nobody.pw_uid, group=nobody.pw_gid, extra_groups=()) == ""


def attacked(**identity: object) -> str:
    """What a process without keys can reach, or why it failed; another user asks for memory and files too."""
    system = next(p for p in ("/usr/bin/python3", "/usr/local/bin/python3", sys.executable) if os.access(p, os.X_OK))
    ours = ",".join(str(process.pid) for process in processes()) if identity else "0"
    began = str(psutil.Process().create_time())  # what was in /tmp before is none of ours
    command = [system, "-I", "-c", ATTACK, ",".join(map(str, ports())), ours, "/tmp" if identity else os.devnull, began]
    done = subprocess.run(command, cwd="/", capture_output=True, text=True, check=False, timeout=600, **identity)  # type: ignore[call-overload]
    return str(done.stdout + done.stderr)
