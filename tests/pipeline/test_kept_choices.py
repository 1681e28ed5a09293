"""Choices that are kept from one process to the next are those that would be made, and no damaged file is believed."""

from __future__ import annotations

from pathlib import Path

import pytest

from sonarsynth import planning, schedule
from sonarsynth.planning import choosing, kept_choices
from sonarsynth.recipe import Recipe, reading
from sonarsynth.store import marks
from sonarsynth.store.provenance import planned


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of choices, empty; what the process remembers is forgotten."""
    monkeypatch.setenv(kept_choices.PLACE, str(tmp_path / "cache"))
    choosing._CHOSEN.clear()
    return tmp_path / "cache" / "choices"


def anew(recipe: Recipe) -> planning.Plan:
    choosing._CHOSEN.clear()
    return planning.plan(recipe)


def refused(*_: object) -> planning.Plan:
    raise AssertionError("measured again")


def test_a_build_is_the_same_with_choices_that_were_kept_and_without(
    kept: Path, small: Recipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also nothing of a plan differs, bit for bit, but the line that says so."""
    made = anew(small)
    assert len(list(kept.iterdir())) == 1 and not made.recalled
    monkeypatch.setattr(choosing, "_choose", refused)
    read = anew(small)
    assert str(kept) in read.recalled and "".join(read.recalled.split()) in "".join(str(read).split())  # in lines
    assert (read.choices, repr(read.errors), planned(read)) == (made.choices, repr(made.errors), planned(made))
    digests = []
    for plan, name in ((made, "a.zarr"), (read, "b.zarr")):
        schedule.build(plan, tmp_path / name, frames=range(8), workers=0)
        mark = marks.load_mark(tmp_path / name, 0)
        assert mark is not None
        digests.append((mark.content, mark.files))
    assert digests[0] == digests[1]


@pytest.mark.parametrize("damage", ["cut", "changed", "of another", "nothing", "folder"])
def test_a_damaged_file_is_planned_anew_and_replaced(damage: str, kept: Path, small: Recipe) -> None:
    made = anew(small)
    (file,) = kept.iterdir()
    whole = file.read_bytes()
    if damage == "folder":
        file.unlink()
        file.mkdir()
    elif damage == "of another":
        name = file.with_name("0" * 64 + file.suffix)
        file.rename(name)
        seal = kept_choices._seal(name, whole.partition(b"\n")[2])
        file.write_bytes(seal + b"\n" + whole.partition(b"\n")[2])
    else:
        cut = {"cut": whole[:-9], "changed": whole.replace(b'"subarrays": 1', b'"subarrays": 2'), "nothing": b""}
        assert cut[damage] != whole
        file.write_bytes(cut[damage])
    again = anew(small)
    assert not again.recalled and again.choices == made.choices
    assert damage == "folder" or file.read_bytes() == whole
    assert damage == "folder" or anew(small).recalled


def test_choices_are_of_a_recipe_its_products_and_the_code(
    kept: Path, small: Recipe, small_text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    anew(small)
    changed = reading.loads(small_text.replace("edge: 0.25", "edge: 0.26"))
    assert changed.digest != small.digest and not anew(changed).recalled
    choosing._CHOSEN.clear()
    assert not planning.plan(small, {"signals"}).recalled
    assert anew(small).recalled
    monkeypatch.setattr(kept_choices, "CODE", "f" * 64)
    assert not anew(small).recalled


def test_the_oldest_files_go_and_no_others(kept: Path, small: Recipe, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_choices, "MOST_FILES", 3)
    made = planning.plan(small)
    (kept / "mine.txt").write_text("kept")
    for key in range(5):
        kept_choices.keep(key, made.choices, made.errors)
    assert [kept_choices.read(key) is not None for key in range(2, 5)] == [True, True, True]
    assert kept_choices.read(0) is None and (kept / "mine.txt").exists() and len(list(kept.iterdir())) == 4


def test_where_nothing_can_be_kept_plans_are_made(
    small: Recipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in ("", "relative", str(tmp_path / "file")):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv(kept_choices.PLACE, place)
        assert not anew(small).recalled and not anew(small).recalled
