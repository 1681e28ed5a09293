"""`sonarsynth notebooks`: the code of the sources, in cells, beside the recipes that it reads; nothing is replaced."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from sonarsynth.cli import app
from sonarsynth.cli.authoring.shipped_recipes import shipped, shipped_notebooks
from sonarsynth.cli.running import run


def test_notebooks_hold_the_code_of_their_sources_and_come_with_the_recipes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "mine"
    assert run(app, ["notebooks", str(folder)]) == 0
    assert len(shipped_notebooks()) > 6
    for name, source in shipped_notebooks().items():
        cells = json.loads((folder / f"{name}.ipynb").read_text())["cells"]
        code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        assert ast.dump(ast.parse(code)) == ast.dump(ast.parse(source.read_text()))
        texts = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"]
        assert texts[0].startswith("# ") and not any(text.startswith("# #") for text in texts)
    assert all((folder / "configs" / file.name).read_text() == file.read_text() for file in shipped().values())
    capsys.readouterr()
    assert run(app, ["notebooks", str(folder)]) == 2
    assert "exists already" in capsys.readouterr().err
