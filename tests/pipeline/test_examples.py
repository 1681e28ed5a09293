"""Every example of the README, of the pages in tools/docs, and of docstrings runs; so do the notebooks."""

from __future__ import annotations

import doctest
import importlib
import inspect
import os
import re
import runpy
import shlex
import shutil
import sys
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import typer

import sonarsynth
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from tools.benchmarks.__main__ import BENCHMARKS

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / ".github").glob("*.md")),
    *sorted((ROOT / "tools" / "docs").rglob("*.md")),
]
LONG = {
    "authoring_a_scene",
    "beams_lobes_and_focus",
    "eigenrays_and_ghosts",
    "hull_from_clouds",
    "recipe_to_cluster",
    "target_strength",
    "training_a_detector",
}
NOTEBOOKS = [
    pytest.param(file, marks=[pytest.mark.long] if file.stem in LONG else [], id=file.stem)
    for file in sorted((ROOT / "tools" / "notebooks").glob("*.py"))
]
QUICK = {"build": ("--frames=0:2", "--workers=0", "--no-predict"), "show": ("--no-film",)}
"""What is added where an example does not say it: every way of building has tests of its own."""
PATHS = r"(?<![\w/~])(?:tools|configs|tests|sonarsynth|\.github|\.ci)/[\w./-]*\w"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where examples run: a copy of what the reader has."""
    import matplotlib as mpl

    monkeypatch.setitem(mpl.rcParams, "backend", "agg")
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


class _Cluster:
    """A cluster of batch jobs, which no test has: it takes what `SLURMCluster` is given."""

    scheduler_address = "tls://127.0.0.1:1"

    def __init__(self, *, cores: int, processes: int, memory: str, walltime: str, **_: Any) -> None:
        pass

    def __enter__(self) -> _Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def adapt(self, *, minimum_jobs: int, maximum_jobs: int) -> None:
        pass


def with_a_cluster(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Stand in for batch jobs; gives the addresses that `build` is called with, which must fit its parameters."""
    called: list[str] = []
    parameters = inspect.signature(sonarsynth.build)

    def build(*given: Any, **named: Any) -> None:
        called.append(parameters.bind(*given, **named).arguments["scheduler"])

    monkeypatch.setitem(sys.modules, "dask_jobqueue", SimpleNamespace(SLURMCluster=_Cluster))
    monkeypatch.setattr(sonarsynth, "build", build)
    return called


def type_in(line: str) -> None:
    """Run a line of a shell: ours in this process, of the other tools nothing but that they are there."""
    words = shlex.split(line, comments=True)
    if words[0] not in ("sonarsynth", "tools/sonarsynth"):
        assert os.access(ROOT / words[0], os.X_OK), line
        return
    added = [option for option in QUICK.get(words[1], ()) if option.split("=")[0] not in words]
    assert run(app, [*words[1:], *added]) == 0, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_example_of_a_page_runs(page: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = page.read_text()
    called = with_a_cluster(monkeypatch) if "dask_jobqueue" in text else None
    names: dict[str, Any] = {"__name__": "__main__"}
    for language, block in re.findall(r"^```(sh|python)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if language == "python":
            exec(compile(block, page.name, "exec"), names)
            continue
        for line in filter(None, map(str.strip, block.replace("\\\n", " ").splitlines())):
            type_in(line)
    if called is not None:
        assert called == [_Cluster.scheduler_address]
    if page.stem == "README":
        assert {file.name for file in folder.glob("*.p*")} >= {"frame.png"}
        assert (folder / "remus.zarr.pictures" / "sheet.png").is_file()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_file_a_page_names_is_there(page: Path) -> None:
    text = page.read_text()
    named = set(re.findall(PATHS, re.sub(r"\]\([^)]*\)", "", text)))
    assert [path for path in sorted(named) if not (ROOT / path).exists()] == []
    linked = re.findall(r"\]\(([^)#]+)[^)]*\)|^\[\w+\]: (\S+)$", text, re.MULTILINE)
    assert [a or b for a, b in linked if not (page.parent / (a or b)).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_and_option_a_page_names_is_there(page: Path) -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    options = {
        name for command in commands.values() for one in command.params for name in one.opts + one.secondary_opts
    }
    text = page.read_text()
    spans = [
        span for span in re.findall(r"`([^`\n]+)`", text) if not re.search(r"tools/(bench|faults|pages)|dask", span)
    ]
    named = {word for span in spans for word in re.findall(r"(?<![\w-])--[a-z-]+", span)}
    assert (
        named - options - {"--arrivals", "--kills", "--nthreads", "--to", "--protocol", "--scheduler-file", "--help"}
        == set()
    )
    assert {span.split()[1] for span in spans if span.startswith("tools/sonarsynth ")} - commands.keys() <= {"COMMAND"}


def test_every_marked_table_is_one_that_a_benchmark_writes() -> None:
    """`tools/bench NAME --page` puts its table there."""
    marks = re.findall(r"^<!-- tools/bench (\w+) -->\n\n\|", "\n".join(map(Path.read_text, PAGES)), re.MULTILINE)
    assert len(marks) == len(set(marks)) >= 5 and set(marks) <= set(BENCHMARKS)


def test_the_readme_has_the_precision_of_detectors_that_their_page_has() -> None:
    said = " ".join(PAGES[0].read_text().split())
    pairs = re.findall(r"(0\.\d\d) and (?:CFAR )?(0\.\d\d) on `(\w+)\.yaml`", said)
    table = (ROOT / "tools/docs/tutorials/train-and-evaluate.md").read_text().partition("tools/bench detectors -->")[2]
    for peaks, cfar, recipe in pairs:
        rows = table.partition(f"`{recipe}.yaml`")[2]
        assert re.findall(r"`(?:peaks|cfar)` \| (0\.\d\d) \|", rows)[:2] == [peaks, cfar]
    assert [recipe for *_, recipe in pairs] == ["reef", "survey"]


def test_the_readme_is_short_and_names_rooms_and_recipes_that_are_there() -> None:
    text = PAGES[0].read_text()
    lines = text.splitlines()
    assert len(lines) <= 140 and max(map(len, lines)) <= 100
    table = text.partition("| step | rooms |")[2].partition("\n\n")[0]
    rooms = re.findall(r"`(\w+)`", table)
    assert len(rooms) > 10
    assert [room for room in rooms if not (ROOT / "sonarsynth" / room / "__init__.py").is_file()] == []
    assert [file.name for file in (ROOT / "configs").glob("*.yaml") if f"`{file.name}`" not in text] == []


def test_the_first_docstring_runs(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sonarsynth, "build", partial(sonarsynth.build, workers=0))  # starting workers takes long
    text = sonarsynth.__doc__ or ""
    indented = "\n".join(line[4:] for line in text.splitlines() if line.startswith("    "))
    exec(compile(indented, "sonarsynth/__init__.py", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.splitlines()[-1] == "True"
    assert (folder / "remus.zarr").is_dir()


@pytest.mark.parametrize("notebook", NOTEBOOKS)
def test_every_notebook_runs_and_draws(notebook: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib import pyplot

    drawn: list[int] = []
    monkeypatch.setattr(pyplot, "show", lambda: drawn.append(len(pyplot.gcf().axes)))
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    monkeypatch.setenv("SEQUENCES", "10")
    runpy.run_path(str(notebook), run_name="__main__")
    pyplot.close("all")
    assert drawn and min(drawn) > 1


def test_every_docstring_example_of_a_public_name_gives_what_it_says() -> None:
    modules: dict[str, ModuleType] = {}
    for name in sonarsynth.__all__:
        home = getattr(getattr(sonarsynth, name, None), "__module__", "")
        if home.startswith("sonarsynth"):
            modules[home] = importlib.import_module(home)
    results = [doctest.testmod(module) for module in modules.values()]
    assert sum(result.failed for result in results) == 0
    assert sum(result.attempted for result in results) >= 4
