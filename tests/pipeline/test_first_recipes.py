"""`init`: a recipe that works, in an empty folder, and never over another file."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import sonarsynth as ss
from sonarsynth.cli import app
from sonarsynth.cli.authoring import init_command, shipped_recipes
from sonarsynth.cli.authoring.init_command import ask
from sonarsynth.cli.authoring.recipe_text import SHAPES, Answers, recipe_text
from sonarsynth.cli.running import run
from tools.same_numbers import harbour

NAMES = sorted(shipped_recipes.shipped())


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_shipped_recipe_is_found() -> None:
    assert {"remus", "grid", "harbour"} <= set(NAMES)
    assert sorted(init_command.NAMES.rstrip(".").split(", ")) == NAMES  # as the help of `--from` has them


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_recipe_is_copied_with_its_comments_and_works(name: str, empty: Path) -> None:
    assert run(app, ["init", "mine.yaml", "--from", name]) == 0
    written, shipped = Path("mine.yaml").read_text(), shipped_recipes.shipped()[name]
    assert written.count("#") == shipped.read_text().count("#") - 1 and "$schema" not in written
    assert f"configs/{name}.yaml" not in written
    sets = harbour.written(empty) if name == "harbour" else ()
    assert ss.load("mine.yaml", sets) == ss.load(shipped, sets)


def test_of_a_recipe_with_files_the_missing_ones_are_named(empty: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(app, ["init", "--from", "harbour"]) == 0
    assert "note: castaway_ctd.csv does not come with it" in capfd.readouterr().out


def test_files_that_lie_by_a_shipped_recipe_come_with_it(empty: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As long as none of them is there already."""
    home = empty / "home"
    (home / "configs").mkdir(parents=True)
    (home / "sonarsynth").mkdir()
    sets = dict(part.split("=") for part in harbour.written(home / "configs"))
    text = shipped_recipes.shipped()["harbour"].read_text()
    text = text.replace("castaway_ctd.csv", "cast.csv").replace("rexrov.stl", "hull.stl")
    (home / "configs" / "harbour.yaml").write_text(text)
    monkeypatch.setattr(shipped_recipes, "PACKAGE", home / "sonarsynth")
    assert run(app, ["init", "--from", "harbour"]) == 0
    assert ss.load("recipe.yaml").title
    assert sets and {path.name for path in empty.iterdir()} == {"home", "recipe.yaml", "cast.csv", "hull.stl"}
    assert run(app, ["init", "other.yaml", "--from", "harbour"]) == 2
    assert not (empty / "other.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["there.yaml"], "there.yaml exists already: nothing was written"),
        (["there.yaml", "--from", "remus"], "there.yaml exists already: nothing was written"),
        (["link.yaml"], "link.yaml exists already"),
        (["none/a.yaml"], "none: no such folder"),
        (["a.yaml", "--from", "../remus2"], "'remus2' is none of boat, crowd"),
        (["a\nb.yaml"], "cannot be printed"),
    ],
)
def test_what_cannot_be_written_is_one_line(
    arguments: list[str], said: str, empty: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    Path("there.yaml").write_text("mine")
    Path("link.yaml").symlink_to("nowhere.yaml")
    assert run(app, ["init", *arguments]) == 2
    error = capfd.readouterr().err
    assert said in error and error.count("\n") == 1
    assert Path("there.yaml").read_text() == "mine"
    assert sorted(path.name for path in empty.iterdir()) == ["link.yaml", "there.yaml"]


def test_without_a_terminal_a_small_recipe_is_written(empty: Path) -> None:
    assert run(app, ["init"]) == 0
    made = ss.load("recipe.yaml")
    assert (made.frames, made.scene.world.targets[0].shape.kind) == (8, "remus100")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("depth", [0.5, 10.0, 4000.0])
def test_answers_make_a_recipe_whose_target_is_in_the_water(shape: str, depth: float) -> None:
    made = ss.loads(recipe_text(Answers(depth=depth, target=shape, array=None), Path("a.yaml")))
    for step in (0, made.steps(0) - 1):
        (body,) = made.scene.frame(step).moment.bodies
        assert body.box[:, 2].min() > -depth and body.box[:, 2].max() < 0.0


@pytest.fixture
def answered(empty: Path) -> Callable[..., tuple[Answers | None, str]]:
    """Answer the questions, a line each; what comes of them, and what was printed."""
    found: list[Answers] = []
    asking = typer.Typer()

    @asking.command()
    def command() -> None:
        found.append(ask(empty))

    def answer(*lines: str) -> tuple[Answers | None, str]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = CliRunner().invoke(asking, [], input="".join(f"{line}\n" for line in lines))
        return (found[-1] if found else None), result.output

    return answer


def test_questions_have_answers_that_can_be_taken(answered: Callable[..., tuple[Answers | None, str]]) -> None:
    assert answered(*[""] * 8)[0] == Answers()


def test_an_answer_that_cannot_be_used_is_asked_again(
    answered: Callable[..., tuple[Answers | None, str]], empty: Path
) -> None:
    harbour.written(empty)
    lines = ('A "quay": #1', "no", "25 m", "none.csv", "cast.csv", "../x.stl", "hull.stl", "nan", "18", "9")
    found, said = answered(*lines, "12x8", "0", "4", "-1", "7")
    assert found == Answers('A "quay": #1', 25.0, "cast.csv", "hull.stl", 18.0, (12, 8), 4, 7)
    assert said.count("cannot be used") == 7
    made = ss.loads(recipe_text(found, empty / "a.yaml"), "a.yaml", empty)
    assert (made.title, made.seed, made.frames) == ('A "quay": #1', 7, 4)
    assert len(made.scene.mesh_of(0).faces) > 0
