"""Keys of recipes that have another name now: read with a note, and no number is another."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.pipeline import render
from sonarsynth.recipe.reading import RecipeError, RenamedKey, dump, load, loads

OLD = """
seed: 4
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1500 m/s}, bed: {rms_height: 1 cm}}
    shrimp:
      - {position: [14, -5], snap_times: [0, 5 ms]}
  physics: {visibility: hydrophones, faintest: 30}
grid:
  - {path: scene.world.shrimp.0.position.1, values: [-5, -6]}
variations:
  - {name: x, path: scene.world.shrimp.0.position.0, kind: uniform, low: 4 m, high: 9 m}
  - {name: h, path: scene.world.shrimp.0.height, kind: sobol, low: 0 m, high: 1 m}
"""
NEW = (
    OLD.replace("bed:", "bottom:")
    .replace("      - {position", "      - {kind: snapping_shrimp, position")
    .replace("shrimp:\n", "sources:\n")
    .replace("visibility: hydrophones, faintest", "occlusion: sensors, dynamic_range")
    .replace("world.shrimp", "world.sources")
)
FIRST_DRAWN = [6.286896010179364, 0.19604593887925148, 8.067603436455116, 0.6183403013274074]  # by the version before


def test_old_keys_make_the_same_recipe_with_a_note_of_each() -> None:
    with pytest.warns(RenamedKey) as notes:
        old = loads(OLD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        new = loads(NEW)
        assert loads(dump(old)) == new
    assert old == new
    said = [str(note.message) for note in notes]
    assert len(said) == 7 and all(" is called " in line for line in said)
    assert "recipe: scene.world.environment.bed is called scene.world.environment.bottom now" in said


def test_a_new_name_draws_the_same_numbers() -> None:
    spanned = loads(NEW).spanned
    drawn = [float(str(s.value.value).removesuffix(" m")) for n in range(2) for s in spanned.drawn(n)]
    np.testing.assert_allclose(drawn, FIRST_DRAWN, rtol=1e-9)


def test_settings_of_the_command_line_may_be_old_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "new.yaml"
    file.write_text(NEW)
    with pytest.warns(RenamedKey, match=r"scene.world.shrimp.0.height is called scene.world.sources.0.height now"):
        recipe = load(file, ["scene.world.shrimp.0.height=2 m"])
    assert recipe.scene.world.sources[0].height == 2.0
    assert run(app, ["plan", str(file), "--set", "scene.physics.faintest=40", "--products", "truth"]) == 0
    assert "note: " in capsys.readouterr().err


def test_both_names_at_once_are_refused_where_they_stand() -> None:
    with pytest.raises(RecipeError, match=r"recipe:8: scene.physics.faintest: 'faintest' is the old name of"):
        loads(OLD.replace("faintest: 30", "faintest: 30, dynamic_range: 30"))


def test_errors_under_an_old_key_name_its_line() -> None:
    with pytest.raises(RecipeError, match=r"recipe:7: scene.world.sources.0.position"), pytest.warns(RenamedKey):
        loads(OLD.replace("[14, -5]", "[14, north]"))


def test_frames_by_old_and_new_keys_are_the_same() -> None:
    with pytest.warns(RenamedKey):
        frames = [render(loads(text), 0) for text in (OLD, NEW)]
    for node in frames[0].subtree:
        assert node.to_dataset().identical(frames[1][node.path].to_dataset()) or node.path == "/"
