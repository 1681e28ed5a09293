"""A recipe's digest is that of what decides its numbers."""

from pathlib import Path

import pytest

from sonarsynth.recipe import Recipe, reading
from tests.scenes import remus

TEXT = """\
seed: 1
scene:
  world:
    environment:
      depth: 20 m
      sound_speed: {kind: cast, path: cast.csv}
    targets:
      - name: thing
        shape: {kind: mesh_file, path: thing.obj}
        motion: {kind: still, position: [10, 0, -5]}
    sources: [{kind: snapping_shrimp, position: [8, -3]}]
"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def _recipe(folder: Path, speed: float = 1540.0, corner: str = "v 0 0 1") -> Recipe:
    folder.mkdir(parents=True)
    (folder / "cast.csv").write_text(f"depth,sound_speed\n0,{speed}\n20,{speed}\n")
    (folder / "thing.obj").write_text(TETRAHEDRON.replace("v 0 0 1", corner))
    (folder / "recipe.yaml").write_text(TEXT)
    return reading.load(folder / "recipe.yaml")


def test_where_files_lie_does_not_matter_and_what_they_hold_does(tmp_path: Path) -> None:
    here = _recipe(tmp_path / "a")
    assert _recipe(tmp_path / "b").digest == here.digest
    assert _recipe(tmp_path / "c", speed=1541.0).digest != here.digest
    assert _recipe(tmp_path / "d", corner="v 0 0 2").digest != here.digest


def test_frames_are_numbered_from_0_and_no_others_exist() -> None:
    recipe = remus(frames=3)
    assert [recipe.frame(i)[1].step for i in range(3)] == [0, 1, 2]
    for index in (-1, 3):
        with pytest.raises(IndexError, match=r"outside 0\.\.2"):
            recipe.frame(index)
