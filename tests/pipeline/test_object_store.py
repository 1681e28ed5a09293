"""Stores in S3, on a server on loopback: built by worker processes, killed, resumed, damaged, repaired."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from sonarsynth import schedule, store
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import Recipe
from sonarsynth.schedule.repairing import repair
from sonarsynth.store import Remote
from tests.commands import status
from tests.places import contents
from tests.waiting import wait_until

pytest.importorskip("s3fs")
pytest.importorskip("moto")
ROOT = Path(__file__).resolve().parents[2]
SECRET = "not-to-be-kept-anywhere"
FRAMES = "0:10"
DRIVERS: list[dict[object, object]] = []
"""Kept: drivers that are forgotten complain of their open connections."""


@pytest.fixture(scope="module")
def bucket(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The URL of a bucket of a server that runs while the tests of this file do."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from moto.server import ThreadedMotoServer
    quiet = logging.getLogger("werkzeug")
    level = quiet.level
    quiet.setLevel(logging.CRITICAL)
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", f"http:{'//'}{host}:{port}")
        patch.setenv("AWS_ACCESS_KEY_ID", "someone")
        patch.setenv("AWS_SECRET_ACCESS_KEY", SECRET)
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        patch.setenv("AWS_EC2_METADATA_DISABLED", "true")
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        Remote("s3://bucket/x").driver.mkdir("bucket")
        yield "s3://bucket"
    server.stop()
    quiet.setLevel(level)


@pytest.fixture(scope="module")
def images(small: Recipe) -> Plan:
    """Images alone: a third of the objects, each of which is several requests."""
    return plan(small, {"image"})


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, images: Plan) -> Path:
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    assert schedule.build(images, path, frames=range(10), workers=0).ok
    return path


def same(place: Remote, whole: Path) -> bool:
    """Whether the objects are the files, but for how the store was begun and what follows from that."""
    there, here = contents(place), contents(whole)
    apart = {"zarr.json", *store.marks.MANIFESTS}
    attributes = [store.root_attributes(at) for at in (place, whole)]
    for found in attributes:
        found.pop("provenance")
    alike = {n: c for n, c in there.items() if n not in apart} == {n: c for n, c in here.items() if n not in apart}
    return alike and there.keys() == here.keys() and attributes[0] == attributes[1]


@pytest.mark.long
def test_what_workers_build_is_what_a_folder_would_hold(bucket: str, images: Plan, whole: Path) -> None:
    place = Remote(f"{bucket}/built/s.zarr")
    report = schedule.build(images, place, frames=range(10), workers=1)
    assert (report.ok, report.written, report.workers) == (True, 10, 1)
    assert list(report.stage_cpu) == ["trace", "beamform"], "no range, which nobody asked for"
    assert same(place, whole)
    kept = b"".join(contents(Remote(f"{bucket}/built")).values())
    state = b"".join(file.read_bytes() for file in Path(os.environ["XDG_STATE_HOME"]).rglob("*") if file.is_file())
    assert SECRET.encode() not in kept + state
    assert b"someone" not in kept + state


@pytest.mark.long
def test_damage_in_a_bucket_is_found_and_mended(bucket: str, whole: Path) -> None:
    place = Remote(f"{bucket}/damaged/s.zarr")
    place.write_each(contents(whole))
    flipped = bytearray((place / "image/energy/c.1.0.0").read_bytes())
    flipped[3] ^= 1
    (place / "image/energy/c.1.0.0").write_bytes(bytes(flipped))
    (place / "truth/beams/range/c.0.0.0").unlink()
    (place / "stranger").write_bytes(b"mine")
    where = {problem.where for problem in store.verify(place, quick=True).problems}
    assert where == {"image/energy/c.1.0.0", "truth/beams/range/c.0.0.0", "stranger"}
    assert repair(place, workers=0, quick=True).ok
    assert contents(place) == contents(whole)


@pytest.mark.long
def test_a_killed_build_is_resumed_to_the_same(bucket: str, small_file: Path, images: Plan, whole: Path) -> None:
    """Killed while a shard is written; of those that are not laid out whole, test_remote has a law."""
    place = Remote(f"{bucket}/killed/s.zarr")
    command = [sys.executable, "-m", "sonarsynth", "build", str(small_file), str(place), "--frames", FRAMES]
    command += ["--products", "image", "--workers", "0", "--no-predict"]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    written = place / "image/energy/c.0.0.0"
    with subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as child:
        wait_until(lambda: child.poll() is not None or written.exists())
        child.send_signal(signal.SIGKILL)
        said = child.stderr.read() if child.stderr is not None else b""
    assert child.returncode in (-signal.SIGKILL, 0), said
    for number, mark in store.marks.load_marks(place, store.marks.marked(place)):
        assert isinstance(mark, store.Mark), number
        found = dict(store.files.place.records(place, mark.files))
        assert all(found[name] == kept or kept == store.marks.ABSENT for name, kept in mark.files.items())
    assert schedule.build(images, place, frames=range(10), workers=0).ok
    assert same(place, whole)
    assert store.verify(place, quick=True).ok


def test_commands_take_the_url(bucket: str, whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = Remote(f"{bucket}/read/s.zarr")
    place.write_each(contents(whole))
    assert status("verify", "--quick", str(place)) == 0
    assert status("card", str(place)) == 0
    assert f'xr.open_datatree("{place}", engine="zarr")' in Remote(f"{place}.card.md").read_text()
    capsys.readouterr()
    with (
        xr.open_datatree(place.zarr_store(), engine="zarr", chunks=None) as there,
        xr.open_datatree(whole, engine="zarr", chunks=None) as here,
    ):
        np.testing.assert_array_equal(there["image/energy"][3].values, here["image/energy"][3].values)


def test_a_bucket_or_a_server_that_is_not_there_is_one_line(
    bucket: str, small_file: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*arguments: str) -> str:
        assert status(*arguments) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1, said
        return said

    build = ["build", str(small_file), "s3://nowhere/s.zarr", "--no-predict", "--workers", "0"]
    assert "does not exist" in refused(*build)
    assert "no such store" in refused("verify", "s3://nowhere/s.zarr")
    driver: Any = Remote("s3://bucket/x").driver
    monkeypatch.setattr(type(driver), "_pipe_file", _forbidden)
    assert "not permitted" in refused(*build[:2], f"{bucket}/forbidden/s.zarr", *build[3:])


async def _forbidden(*_: object, **__: object) -> None:
    raise PermissionError("Access Denied")


def test_no_credentials_and_no_server_are_one_line(
    bucket: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from s3fs import S3FileSystem

    for name in [name for name in os.environ if name.startswith("AWS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http:" + "//127.0.0.1:9")
    monkeypatch.setenv("HOME", str(tmp_path))
    for key, said in (("", "credentials"), ("a", "Could not connect")):
        if key:
            monkeypatch.setenv("AWS_ACCESS_KEY_ID", key)
            monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", key)
        DRIVERS.append({})  # none of those of the server of these tests
        monkeypatch.setattr(S3FileSystem, "_cache", DRIVERS[-1])
        assert status("verify", f"{bucket}/x/s.zarr") == 2
        found = capsys.readouterr().err
        assert found.count("\n") == 1, found
        assert said in found
