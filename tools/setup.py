#!/usr/bin/env python3
"""Sets up `.venv` beside this folder: the locked packages, the project itself, and system libraries for Open3D.

    python3 tools/setup.py

Standard library only. Run again at any time: it does nothing when nothing changed. What it could not do it says; only
what the core pipeline needs makes it fail (exit 1, one line). Open3D is optional.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

OLDEST = (3, 11)
ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
LOCK = ROOT / "tools" / "requirements.lock"
STAMP = VENV / "setup.stamp"
PYTHON = VENV / "bin" / "python"
PIP = (PYTHON, "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet", "--retries", "2")
LIBRARIES = VENV / "lib"  # Open3D's run path leads here


class CannotSetUp(Exception):
    """What is missing, in one line."""


def say(text: str) -> None:
    print(f"setup: {text}", file=sys.stderr, flush=True)


def run(*command: str | Path, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run a command quietly; the caller looks at returncode."""
    text = [str(part) for part in command]
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    try:
        return subprocess.run(text, cwd=cwd, capture_output=True, text=True, env=environment, check=False)
    except FileNotFoundError:
        return subprocess.CompletedProcess(text, 127, "", f"{text[0]} is not installed")


def reason(result: subprocess.CompletedProcess[str]) -> str:
    """The line of a failed command that says most: pip's and uv's first error, else the last line."""
    lines = [line.strip() for line in (result.stderr + result.stdout).splitlines() if line.strip()]
    telling = [line for line in lines if re.match(r"(error|×|E:)", line, re.IGNORECASE)]
    return (telling or lines[-1:] or [f"exit status {result.returncode}"])[0]


def stamp() -> str:
    """What the set-up depends on: the lock, the project's description, this file, and where all of it stands."""
    digest = hashlib.sha256(str(ROOT).encode())
    for path in (LOCK, ROOT / "pyproject.toml", Path(__file__)):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def up_to_date() -> bool:
    return PYTHON.exists() and STAMP.is_file() and STAMP.read_text() == stamp()


def make_environment() -> None:
    """A virtual environment with pip in it; one that works, and was made here, is kept."""
    usable = f"import pip, sys; sys.exit(sys.version_info < {OLDEST})"
    if PYTHON.exists() and made_here() and run(PYTHON, "-c", usable).returncode == 0:
        return
    check_writable()
    say(f"making {VENV.name} with Python {sys.version.split()[0]}")
    result = run(sys.executable, "-m", "venv", "--clear", VENV)
    if result.returncode != 0:
        raise CannotSetUp(f"cannot make a virtual environment (Debian: apt install python3-venv): {reason(result)}")


def check_writable() -> None:
    """The environment stands in the checkout. Raises CannotSetUp where nothing can be written there."""
    try:
        with tempfile.TemporaryFile(dir=ROOT):
            pass
    except OSError as problem:
        place = Path(tempfile.gettempdir()) / "sonarsynth"
        raise CannotSetUp(
            f"{ROOT} cannot be written ({problem.strerror}), where the environment is made: work in a copy, such as "
            f"cp -r {ROOT} {place} && {place}/tools/setup.py"
        ) from None


def made_here() -> bool:
    """False for an environment that was copied or moved: its scripts name the place where it was made."""
    return (VENV / "pyvenv.cfg").read_text().rstrip().endswith(str(VENV))


def install_packages() -> None:
    """Everything in the lock, by hash, with the locked uv; with pip where uv cannot."""
    with tempfile.TemporaryDirectory() as folder:
        only_uv = Path(folder) / "uv.lock"
        only_uv.write_text(locked("uv"))
        result = run(*PIP, "--require-hashes", "-r", only_uv)
        if result.returncode != 0:
            raise CannotSetUp(f"pip cannot get uv from a package registry: {reason(result)}")
    say("installing the locked packages")
    install("the locked packages", "--require-hashes", "-r", LOCK)


def install(what: str, *arguments: str | Path) -> None:
    """By uv, by pip where that cannot."""
    result = run(*uv("install"), *arguments)
    if result.returncode != 0:
        say(f"uv could not ({reason(result)}); trying pip")
        result = run(*PIP, *arguments)
    if result.returncode != 0:
        raise CannotSetUp(f"cannot install {what}: {reason(result)}")


def uv(command: str) -> list[str | Path]:
    """A command of uv, which fails where it cannot have a cache unless it is told to go on without."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    known = next(path for path in (base, *base.parents) if path.exists())
    cache = () if "UV_CACHE_DIR" in os.environ or os.access(known, os.W_OK) else ("--no-cache",)
    return [VENV / "bin" / "uv", "pip", command, "--quiet", "--python", PYTHON, *cache]


def locked(name: str) -> str:
    """The lines of one package in the lock."""
    found = re.search(rf"^{re.escape(name)}==(?:.*\\\n)*.*\n", LOCK.read_text(), re.MULTILINE)
    if found is None:
        raise CannotSetUp(f"{LOCK.relative_to(ROOT)} does not hold {name}: run tools/lock")
    return found.group()


def install_project() -> None:
    """The project where it stands, with the locked build back end."""
    install("the project", "--no-deps", "--no-build-isolation", "--editable", ROOT)


def open3d_module() -> Path | None:
    """Open3D's extension module, where the lock has a wheel for this platform and Python."""
    return next(VENV.glob("lib/python*/site-packages/open3d/**/pybind*.so"), None)


def missing_libraries(module: Path) -> list[str]:
    """Shared libraries that the loader does not find, also those that libraries need."""
    return sorted(set(re.findall(r"^\s*(\S+) => not found", run("ldd", module).stdout, re.MULTILINE)))


def debian_package(library: str) -> str:
    """The package of a shared library, by the rule of the Debian policy manual 8.1: libX11.so.6 is in libx11-6."""
    if library.startswith("libGLdispatch"):
        return "libglvnd0"
    name, _, version = library.partition(".so.")
    name = name.lower().replace("_", "-")
    return f"{name}-{version}" if name[-1].isdigit() else f"{name}{version}"


def install_system_libraries() -> str:
    """Unpack what Open3D lacks of the system into the environment, without root. Returns what could not be done."""
    module = open3d_module()
    if module is None:
        return "no wheel for this Python and platform"
    tried: set[str] = set()
    with tempfile.TemporaryDirectory() as folder:
        while missing := missing_libraries(module):
            packages = sorted({debian_package(library) for library in missing})
            if tried.issuperset(packages):
                return f"it lacks {', '.join(missing)}; Debian: apt install {' '.join(packages)}"
            say(f"fetching system libraries for Open3D: {' '.join(packages)}")
            tried.update(packages)
            unpack(packages, Path(folder))
    result = run(PYTHON, "-W", "ignore", "-c", "import open3d")
    return "" if result.returncode == 0 else reason(result)


def unpack(packages: list[str], folder: Path) -> None:
    """Download Debian packages and copy their shared libraries into the environment."""
    get = [
        "apt-get",
        "-qq",
        "-o",
        "APT::Sandbox::User=root",
        "-o",
        "Debug::NoLocking=1",
        "-o",
        "Acquire::http::Timeout=20",
    ]
    lists, cache = folder / "lists", folder / "cache"
    own_lists = ["-o", f"Dir::State::Lists={lists}", "-o", f"Dir::Cache={cache}"]
    for package in packages:
        if run(*get, "download", package, cwd=folder).returncode == 0:
            continue
        if not lists.exists():  # the machine's package lists are absent or stale: fetch some of our own, once
            (lists / "partial").mkdir(parents=True)
            (cache / "archives" / "partial").mkdir(parents=True)
            run(*get, *own_lists, "update")
        run(*get, *own_lists, "download", package, cwd=folder)
    for archive in folder.glob("*.deb"):
        run("dpkg", "-x", archive, folder / "root")
        archive.unlink()
    for library in (folder / "root").rglob("lib*.so.*"):
        if library.is_file():
            shutil.copy2(library, LIBRARIES / library.name)


def open3d_lack() -> str:
    """What keeps Open3D from working, after trying to get it; never an error."""
    try:
        return install_system_libraries()
    except OSError as problem:
        return str(problem)


def set_up() -> None:
    """Bring the environment up to date, one process at a time."""
    began = time.monotonic()
    with open(__file__) as only_one:
        fcntl.flock(only_one, fcntl.LOCK_EX)
        if up_to_date():
            return
        make_environment()
        STAMP.unlink(missing_ok=True)
        install_packages()
        install_project()
        if lack := open3d_lack():
            say(f"Open3D will not work: {lack}. It is optional: without it rays are cast with Embree alone.")
        STAMP.write_text(stamp())
    say(f"done in {time.monotonic() - began:.0f} s")


def main() -> int:
    """Exit status 0 when the project can run."""
    try:
        if sys.version_info < OLDEST:
            raise CannotSetUp(f"needs Python {OLDEST[0]}.{OLDEST[1]} or newer, this is {sys.version.split()[0]}")
        if not up_to_date():
            set_up()
    except (CannotSetUp, OSError) as problem:
        say(f"failed: {problem}")
        return 1
    except KeyboardInterrupt:
        say("interrupted; run it again to go on")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
