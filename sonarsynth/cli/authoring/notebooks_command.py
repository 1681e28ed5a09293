"""`sonarsynth notebooks FOLDER`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from sonarsynth.cli.authoring.shipped_recipes import shipped, shipped_notebooks
from sonarsynth.cli.running import BadOption


def notebooks(
    folder: Annotated[Path, typer.Argument(help="Where to write them; never over another file.", show_default=False)],
) -> None:
    """Write the notebooks for Jupyter, and the recipes that they read.

    Every plot of them is made when they are run; they come without results.
    """
    texts = {
        folder / f"{name}.ipynb": json.dumps(as_notebook(file.read_text(encoding="utf-8")), indent=1) + "\n"
        for name, file in shipped_notebooks().items()
    }
    if not texts:
        raise BadOption("the notebooks did not come with this installation")
    texts |= {folder / "configs" / file.name: file.read_text(encoding="utf-8") for file in shipped().values()}
    existing = [file for file in texts if file.exists() or file.is_symlink()]
    if existing:
        raise BadOption(f"{existing[0]} exists already: nothing was written")
    (folder / "configs").mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        with file.open("x", encoding="utf-8") as new:
            new.write(text)
        if file.suffix == ".ipynb":
            typer.echo(str(file))


def as_notebook(text: str) -> dict[str, Any]:
    """A notebook (nbformat 4.5) of Python with cell marks, jupytext's percent format."""
    cells: list[dict[str, Any]] = []
    for cell in re.split(r"^# %%", text, flags=re.MULTILINE)[1:]:
        mark, _, body = cell.partition("\n")
        kind = "markdown" if "[markdown]" in mark else "code"
        body = body.strip("\n")
        if kind == "markdown":
            body = re.sub(r"^# ?", "", body, flags=re.MULTILINE)
        lines = body.splitlines(keepends=True)
        results: dict[str, Any] = {"execution_count": None, "outputs": []} if kind == "code" else {}
        cells.append({"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}, "source": lines} | results)
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return {"nbformat": 4, "nbformat_minor": 5, "metadata": kernel, "cells": cells}
