"""A Dask cluster started by hand, as in any network: a scheduler and a worker that speak TLS and nothing else."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import dask
import psutil
import pytest

from sonarsynth import store
from sonarsynth.cli import app, main
from sonarsynth.cli.running import run
from sonarsynth.planning import Plan
from sonarsynth.schedule import build
from sonarsynth.schedule.connecting import check_address
from tests.pipeline.test_same_anywhere import contents
from tests.waiting import wait_until

HERE = Path(__file__).resolve().parents[2]
PATIENCE = {"distributed.comm.timeouts.tcp": "600s", "distributed.comm.timeouts.connect": "600s"}
"""A busy machine is slow, not gone."""


def certificate(folder: Path) -> tuple[Path, Path]:
    """A key and a certificate signed by itself."""
    if shutil.which("openssl") is None:
        pytest.skip("needs openssl")
    key, made = folder / "key.pem", folder / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    names = ["-subj", "/CN=localhost", "-days", "2", "-keyout", str(key), "-out", str(made)]
    subprocess.run([*command, *names], check=True, capture_output=True)
    return key, made


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """What every process of the cluster is told, as a site would write into its Dask configuration."""
    key, made = certificate(tmp_path)
    tls = {"CA_FILE": made}
    tls |= {
        f"{who}__{what}": file
        for who in ("SCHEDULER", "WORKER", "CLIENT")
        for what, file in (("KEY", key), ("CERT", made))
    }
    settings = {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(file) for name, file in tls.items()}
    settings |= {f"DASK_{name.upper().replace('.', '__')}": value for name, value in PATIENCE.items()}
    encrypted = {"DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True", "OMP_NUM_THREADS": "1"}
    return {**os.environ, **settings, **encrypted, "PYTHONPATH": str(HERE)}


@pytest.fixture
def address(tmp_path: Path, environment: dict[str, str]) -> Iterator[str]:
    """Address of the scheduler, which has a worker."""
    file = tmp_path / "scheduler.json"
    common = ["--protocol", "tls", "--scheduler-file", str(file), "--no-dashboard"]
    each = {
        "scheduler": ["--host", "127.0.0.1", "--port", "0"],
        "worker": ["--host", "127.0.0.1", "--nthreads", "1"],
    }
    with ExitStack() as stack:
        for name, options in each.items():
            module = f"distributed.cli.dask_{name}"
            with (tmp_path / f"{name}.txt").open("w") as log:
                started = subprocess.Popen(
                    [sys.executable, "-W", "ignore", "-m", module, *common, *options],
                    env=environment, stdout=log, stderr=log, cwd=tmp_path,
                )  # fmt: skip
            stack.callback(ended, started)
        wait_until(lambda: file.exists() and file.read_text().endswith("}"), lambda: started.poll() is None)
        yield json.loads(file.read_text())["address"]


def ended(process: subprocess.Popen[bytes]) -> None:
    """End a process and what it started."""
    children = psutil.Process(process.pid).children(recursive=True) if process.poll() is None else []
    process.kill()
    process.wait()
    for child in children:
        if child.is_running():
            child.kill()


@pytest.mark.long
@pytest.mark.usefixtures("trusted")
def test_a_cluster_that_speaks_tls_makes_the_same_arrays(
    tmp_path: Path, small_file: Path, small_plan: Plan, address: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert address.startswith("tls://127.0.0.1:")
    path, here = tmp_path / "s.zarr", tmp_path / "here.zarr"
    assert run(app, ["build", str(small_file), str(path), "--json", "--scheduler", address]) == 0
    report = json.loads(capfd.readouterr().out)
    assert report["ok"] and report["written"] == 20  # its workers are counted as it begins: one may still be starting
    build(small_plan, here, workers=0)
    assert contents(path) == contents(here)
    assert store.verify(path).ok


NONE_THERE = {f"distributed.comm.tls.{name}": "no/such.pem" for name in ("ca-file", "client.cert", "client.key")}


@pytest.mark.parametrize(
    ("address", "settings", "said"),
    [
        ("tls://127.0.0.1:9", {}, "--scheduler: tls://127.0.0.1:9 needs certificates"),
        ("tls://10.1.2.3:9", NONE_THERE, "certificates of Dask's configuration cannot be used: "),
        ("tcp://127.0.0.1:9", {}, "tcp://127.0.0.1:9: no Dask scheduler answers there"),
        ("nonsense", {}, "--insecure"),
        ("what://127.0.0.1:9", {}, "what://127.0.0.1:9: no Dask scheduler answers there"),
    ],
)
def test_a_scheduler_that_cannot_be_used_is_one_line(
    tmp_path: Path,
    small_file: Path,
    capfd: pytest.CaptureFixture[str],
    address: str,
    settings: dict[str, str],
    said: str,
) -> None:
    path = tmp_path / "n.zarr"
    with dask.config.set({"distributed.comm.timeouts.connect": "1s", **settings}), pytest.raises(SystemExit) as raised:
        main(["build", str(small_file), str(path), "--scheduler", address])
    line = capfd.readouterr().err.splitlines()[-1]
    assert raised.value.code == 2
    assert line.startswith("sonarsynth: ") and said in line
    assert not store.beside(path, "lock").exists()


@pytest.mark.usefixtures("trusted")
def test_certificates_make_an_address_elsewhere_fine() -> None:
    check_address("tls://10.1.2.3:8786", False)


@pytest.fixture
def trusted(environment: dict[str, str]) -> Iterator[None]:
    """The certificates of the cluster, in the Dask configuration of this process."""
    prefix = "DASK_DISTRIBUTED__COMM__TLS__"
    found = {name.removeprefix(prefix): value for name, value in environment.items() if name.startswith(prefix)}
    keys = {name.lower().replace("__", ".").replace("_", "-"): value for name, value in found.items()}
    settings = {f"distributed.comm.tls.{name}": value for name, value in keys.items()}
    with dask.config.set({"distributed.comm.require-encryption": True, **PATIENCE, **settings}):
        yield
