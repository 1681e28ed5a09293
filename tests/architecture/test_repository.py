"""What the repository holds, and what it must not."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 300

LONG: dict[str, str] = {}
"""Files of the package that may be longer, and why."""

TOP = {
    ".ci",
    ".github",
    ".gitignore",
    "LICENSE",
    "README.md",
    "configs",
    "pyproject.toml",
    "sonarsynth",
    "tests",
    "tools",
}

HOSTS = (
    "www.apache.org",
    "json-schema.org",
    "doi.org",
    "spdx.org",
    "cfconventions.org",
    "creativecommons.org",
    "schema.org",
    "mlcommons.org/croissant",
    "purl.org",
    "orcid.org",
)
"""Hosts that are names of things, not places to fetch from."""

FORBIDDEN = {
    "a path of one machine": r"(?<![\w./<\"'$}])/(?:home|root|opt|mnt|work|Users)/",
    "an address": r"https?://(?!" + "|".join(map(re.escape, HOSTS)) + ")",
    "an unfinished mark": r"\b(?:TO[D]O|FIX[M]E|XX[X]|HA[C]K)\b",
    "how it came about": r"\b(?i:ag[e]nts?|(?<!scope=\")s[e]ssions?|h[e]lpers?|iss[u]es?|workt[r]ees?)\b",
}


def tracked() -> list[str]:
    """Files that belong to the repository: those that git tracks or would track; without git, all but hidden ones."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode == 0:
        return [name for name in sorted(set(listed.stdout.splitlines())) if (ROOT / name).is_file()]
    every = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
    return sorted(str(path) for path in every if not any(part[0] in "._" for part in path.parts[:-1]))


def texts() -> list[tuple[str, str]]:
    """Name and text of every file of the repository that is text, and ours."""
    found = []
    for name in tracked():
        if name == "LICENSE":
            continue
        data = (ROOT / name).read_bytes()
        if b"\0" not in data:
            found.append((name, data.decode()))
    return found


def test_the_package_was_found() -> None:
    assert "sonarsynth/conventions.py" in tracked()


def test_files_are_short() -> None:
    lengths = {
        name: len((ROOT / name).read_text().splitlines()) for name in tracked() if name.startswith("sonarsynth/")
    }
    assert {name: n for name, n in lengths.items() if n > LONGEST and name not in LONG} == {}
    assert [name for name in LONG if lengths.get(name, 0) <= LONGEST] == []


def test_the_top_folder_holds_only_what_belongs_there() -> None:
    assert {Path(name).parts[0] for name in tracked()} <= TOP


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_file_holds(what: str) -> None:
    pattern = re.compile(FORBIDDEN[what])
    lines = [
        f"{name}:{number}: {line.strip()[:100]}"
        for name, text in texts()
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]
    assert lines == []


@pytest.mark.parametrize(
    ("what", "line"),
    [
        ("a path of one machine", "data in " + "/home/" + "someone"),
        ("an address", "https:" + "//example.org/simple"),
        ("an unfinished mark", "# TO" + "DO later"),
        ("how it came about", "written in a ses" + "sion"),
    ],
)
def test_what_is_forbidden_would_be_found(what: str, line: str) -> None:
    assert re.search(FORBIDDEN[what], line)


def test_the_lock_is_by_hash_and_without_addresses() -> None:
    text = (ROOT / "tools" / "requirements.lock").read_text()
    entries = re.split(r"^(?=[^\s#])", text, flags=re.MULTILINE)[1:]
    assert len(entries) > 50
    assert [entry for entry in entries if not re.match(r"[a-z0-9][\w.-]*==\S+ .*\\\n    --hash=sha256:", entry)] == []
    assert "://" not in text


def test_the_lock_holds_every_dependency() -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = [*project["project"]["dependencies"], *project["dependency-groups"]["dev"]]
    names = {re.split(r"[^\w.-]", entry)[0].lower().replace(".", "-") for entry in wanted}
    locked = set(re.findall(r"^([a-z0-9][\w.-]*)==", (ROOT / "tools" / "requirements.lock").read_text(), re.MULTILINE))
    assert names - locked == set()
