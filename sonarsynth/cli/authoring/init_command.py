"""`sonarsynth init`: a first recipe, copied or made of answers to questions."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from sonarsynth.cli.authoring.recipe_text import DEFAULTS, SHAPES, Answers, array_of, positive
from sonarsynth.cli.authoring.shipped_recipes import copy_beside, text_of
from sonarsynth.cli.running import BadOption


def ask(folder: Path) -> Answers:
    """Ask for a first recipe that will be in a folder; a question is asked again until its answer can be used."""
    d = DEFAULTS
    try:
        return Answers(
            title=_asked("Title", d.title, _printable),
            depth=_asked("Depth of the water (m)", d.depth, positive),
            water=_asked("Sound speed (m/s), or a cast file in this folder", d.water, _number_or_file(folder)),
            target=_asked(f"Target: {', '.join(SHAPES)}, or a mesh file in this folder", d.target, _shape(folder)),
            range=_asked("Range of the target (m)", d.range, positive),
            array=_asked("Array: romanis (508 hydrophones), or columns x rows 5 cm apart", "20x16", array_of),
            frames=_asked("Frames", d.frames, _whole_number(1)),
            seed=_asked("Seed of everything that is drawn at random", d.seed, _whole_number(0)),
        )
    except typer.Abort:
        raise KeyboardInterrupt from None


def _asked(question: str, default: object, read: Callable[[str], Any]) -> Any:
    def value(text: str) -> Any:
        try:
            return read(str(text))
        except ValueError as error:
            raise typer.BadParameter(f"'{text}' cannot be used: {error}") from None

    shown = f"{default:g}" if isinstance(default, float) else str(default)
    return typer.prompt(question, default=shown, value_proc=value)


def _printable(text: str) -> str:
    if not text.strip() or not text.isprintable():
        raise ValueError("a line of text is needed")
    return text.strip()


def _whole_number(least: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        if int(text) < least:
            raise ValueError(f"{least} at least")
        return int(text)

    return read


def _file(text: str, folder: Path) -> str:
    """A file as the recipe names it: relative to its folder, which it must be in."""
    path = Path(text.strip()).expanduser()
    if not (path := folder / path).is_file():
        raise ValueError(f"there is no such file in {folder.absolute()}")
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(f"a recipe names files in its own folder: copy it to {folder.absolute()}")
    return path.resolve().relative_to(folder.resolve()).as_posix()


def _number_or_file(folder: Path) -> Callable[[str], float | str]:
    def read(text: str) -> float | str:
        try:
            return positive(text)
        except ValueError:
            return _file(text, folder)

    return read


def _shape(folder: Path) -> Callable[[str], str]:
    return lambda text: text.strip() if text.strip() in SHAPES else _file(text, folder)


NAMES = "remus, reef, thermocline, crowd, deep, tank, l_shape, grid, boat, survey, ping, harbour."


def init(
    file: Annotated[Path, typer.Argument(help="Where to write the recipe; never over another file.")] = Path(
        "recipe.yaml"
    ),
    source: Annotated[
        str | None, typer.Option("--from", metavar="NAME", help=f"Copy a shipped recipe with its comments: {NAMES}")
    ] = None,
) -> None:
    """Write a first recipe, with comments: a copy of a shipped one, or one of a few answers on a terminal.

    Without --from and without a terminal: a small one of a REMUS-100 that crosses ahead.
    """
    from sonarsynth.cli.authoring.recipe_text import DEFAULTS, recipe_text
    from sonarsynth.recipe import reading

    if file.exists() or file.is_symlink():
        raise BadOption(f"{file} exists already: nothing was written")
    if not file.name.isprintable():
        raise BadOption("the name of the file holds what cannot be printed")
    if not file.parent.is_dir():
        raise BadOption(f"{file.parent}: no such folder")
    missing: list[str] = []
    if source is not None:
        text, beside, missing = text_of(source, file)
        copy_beside(beside, file.parent)
    else:
        asked = sys.stdin.isatty() and sys.stdout.isatty()
        answers = ask(file.parent) if asked else DEFAULTS
        text = recipe_text(answers, file)
        reading.loads(text, str(file), file.parent)
    with file.open("x", encoding="utf-8") as new:
        new.write(text)
    typer.echo(str(file))
    for name in missing:
        typer.echo(f"note: {name} does not come with it: put yours beside {file}, or name it by --set")
    typer.echo(f"next: sonarsynth preview {file}, sonarsynth plan {file}")
