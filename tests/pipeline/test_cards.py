"""The card of a dataset and its Croissant metadata: made from the store alone, beside it, complete and valid."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from sonarsynth import schedule, store
from sonarsynth.recipe import reading
from sonarsynth.store import cards
from sonarsynth.store.cards.croissant import CONTEXT
from tests.commands import status

SAID = """\
dataset:
  description: Boxes | tubes, with <tags> and `ticks`.
  creators:
    - {name: A. Author, url: "https://orcid.org/0000-0002-1825-0097", affiliation: An Institute}
    - {name: A Group, organisation: true}
  keywords: [box]
  url: https://doi.org/10.1000/boxes
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> Path:
    path = tmp_path_factory.mktemp("cards") / "small.zarr"
    file = path.with_name("small.yaml")
    file.write_text(SAID + small_text)
    source = reading.read(file)
    assert schedule.build(reading.recipe_of(source), path, frames=range(8), workers=0, source=source).ok
    return path


def card_of(path: Path) -> str:
    return store.beside(path, "card.md").read_text()


def croissant_of(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(store.beside(path, "croissant.json").read_text())
    return found


def test_a_build_leaves_both_beside_the_store_and_nothing_in_it(built: Path) -> None:
    names = {file.name for file in built.parent.iterdir()}
    assert {"small.zarr.card.md", "small.zarr.croissant.json"} <= names
    assert store.verify(built).ok


def test_every_variable_is_in_the_card_with_its_units(built: Path) -> None:
    text = card_of(built)
    with xr.open_datatree(built, engine="zarr", chunks=None) as tree:
        for node in tree.subtree:
            assert not node.to_dataset(inherit=False).variables or f"### `{node.path}`\n" in text
            for name, variable in node.to_dataset(inherit=False).variables.items():
                units, meaning = variable.attrs["units"], variable.attrs["long_name"]
                dims = ", ".join(f"{d} {n}" for d, n in variable.sizes.items()) or "one value"
                row = rf"\| `{name}` \| {re.escape(dims)} \| \w+ \| {re.escape(units)} \| {re.escape(meaning)} \|"
                assert re.search(row, text), f"{node.path}/{name}"


def test_the_lines_that_load_it_do(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = re.search(r"```python\n(.*?)```", card_of(built), re.DOTALL)
    assert code is not None
    assert len(code[1].strip().splitlines()) == 3
    monkeypatch.chdir(built.parent)
    names: dict[str, Any] = {}
    exec(code[1], names)
    assert names["first"].shape == (9, 11)
    names["tree"].close()


def test_the_card_says_what_was_planned_and_what_is_missing(built: Path) -> None:
    text, attrs = card_of(built), store.root_attributes(built)
    for row in attrs["plan"]["stages"]:
        assert f"| {row['stage']} | {row['method']} |" in text
    for row in attrs["plan"]["left_out"]:
        assert f"| {row['what']} | {row['why']} | {row['bound']} |" in text
    assert "8 of 20 are there" in text
    assert "- 12 of 20 frames are not built." in text
    assert f"| digest of the recipe | {attrs['recipe_digest']} |" in text
    assert attrs["provenance"]["recipe_as_written"].strip() in text
    assert "| train | 1 | 20 |" in text


def test_texts_of_the_recipe_are_no_markup(built: Path, small_text: str, tmp_path: Path) -> None:
    odd = 'title: "a | <script>b</script>"\ndataset: {citation: "line <one>\\n# two"}\n'
    file = tmp_path / "odd.yaml"
    file.write_text(odd + small_text.partition("\n")[2] + "# ```\n# ````\n")
    source = reading.read(file)
    path = tmp_path / "odd.zarr"
    schedule.build(reading.recipe_of(source), path, frames=[0], workers=0, source=source)
    text = card_of(path)
    outside = re.sub(r"(?ms)^(`````+)yaml$.*^\1$", "", text)
    assert "# ````" not in outside
    assert "<script>" not in outside
    assert "\n# two" not in outside
    assert "> \\# two" in outside


def test_the_command_makes_them_again_the_same(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, data = card_of(built), croissant_of(built)
    for suffix in ("card.md", "croissant.json"):
        store.beside(built, suffix).unlink()
    assert status("card", str(built)) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == [f"{built}.card.md", f"{built}.croissant.json"]
    assert all(line.startswith(("a threshold reaches an average precision of ", "warning: ")) for line in lines[2:])
    assert (card_of(built), croissant_of(built)) == (text, data)
    assert status("card", str(built), "--out", str(tmp_path / "out")) == 0
    assert (tmp_path / "out/small.zarr.card.md").read_text() == text


def test_failed_frames_are_counted(built: Path, tmp_path: Path) -> None:
    path = Path(shutil.copytree(built, tmp_path / "s.zarr"))
    row = {"frame": 9, "stage": "trace", "error": "ValueError: no such ray", "traceback": ""}
    store.beside(path, "failed.jsonl").write_text(json.dumps(row) + "\n" + json.dumps(row) + "\nnot json\n")
    assert "- 1 frames failed (trace: ValueError)." in cards.markdown(cards.facts_of(path))


@pytest.mark.parametrize("how", ["nothing", "folder", "metadata"])
def test_what_is_no_store_is_one_line(
    built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], how: str
) -> None:
    path = tmp_path / "s.zarr"
    if how == "folder":
        path.mkdir()
    if how == "metadata":
        shutil.copytree(built, path)
        (path / "zarr.json").write_text("{")
    assert status("card", str(path)) == (4 if how == "metadata" else 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(path) in said
    assert not store.beside(path, "card.md").exists()


def test_a_store_that_says_little_of_itself_has_a_card(built: Path, tmp_path: Path) -> None:
    """As one of an earlier version: no plan, no provenance, nothing about whose it is."""
    path = Path(shutil.copytree(built, tmp_path / "s.zarr"))
    root = json.loads((path / "zarr.json").read_bytes())
    for name in ("plan", "provenance", "inputs", "dataset", "title", "licence"):
        del root["attributes"][name]
    (path / "zarr.json").write_text(json.dumps(root))
    files = cards.write(path)
    assert files[0].read_text().startswith("# s.zarr\n")
    assert json.loads(files[1].read_text())["creator"][0]["name"].startswith("unnamed, with sonarsynth")


def test_croissant_has_every_required_property(built: Path) -> None:
    found = croissant_of(built)
    for name in ("@context", "@type", "conformsTo", "description", "license", "name", "url", "creator"):
        assert found[name], name
    assert found["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", found["datePublished"])
    assert found["license"] == "https://spdx.org/licenses/CC-BY-4.0.html"
    assert found["url"] == "https://doi.org/10.1000/boxes"
    assert [c["@type"] for c in found["creator"]] == ["sc:Person", "sc:Organization"]
    terms = set(CONTEXT) | {"name", "description", "contentUrl", "contentSize", "encodingFormat", "sha256"}
    for entry in found["distribution"] + found["recordSet"]:
        assert {key for key in entry if not key.startswith("@")} <= terms


def test_croissant_has_every_array_and_digests_that_are_true(built: Path) -> None:
    import hashlib

    found = croissant_of(built)
    with xr.open_datatree(built, engine="zarr", chunks=None) as tree:
        arrays = {
            f"{node.path}/{name}".strip("/").replace("//", "/")
            for node in tree.subtree
            for name in node.to_dataset(inherit=False).variables
        }
    fields = [field for records in found["recordSet"] if records["@id"] != "splits" for field in records["field"]]
    assert {field["source"]["extract"]["column"] for field in fields} == arrays
    objects = {entry["@id"]: entry for entry in found["distribution"]}
    assert all(field["source"]["fileSet"]["@id"] in objects for field in fields)
    file = built.parent / objects["metadata"]["contentUrl"]
    assert objects["metadata"]["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    assert objects["metadata"]["contentSize"] == f"{file.stat().st_size} B"
    assert list(built.parent.glob(objects["store"]["includes"]))


@pytest.mark.filterwarnings("ignore")
def test_the_reference_reader_of_croissant_finds_nothing_wrong(built: Path) -> None:
    mlcroissant = pytest.importorskip("mlcroissant")
    dataset = mlcroissant.Dataset(str(store.beside(built, "croissant.json")))
    found = getattr(dataset.metadata.ctx, "iss" + "ues")
    assert not found.errors
    assert not found.warnings
    assert [row["splits/name"] for row in dataset.records("splits")] == ["train", "validation", "test"]
    broken = croissant_of(built)
    del broken["recordSet"][1]["field"][0]["dataType"]
    with pytest.raises(mlcroissant.ValidationError):
        mlcroissant.Dataset(broken)


def test_a_build_that_was_killed_before_its_card_gets_it_when_it_is_resumed(
    tmp_path: Path, small_text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, recipe = tmp_path / "s.zarr", reading.loads(small_text)
    schedule.build(recipe, path, frames=range(8), workers=0)
    with monkeypatch.context() as patch:
        patch.setattr(cards, "write", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            schedule.build(recipe, path, frames=range(16), workers=0)
    assert "8 of 20 are there" in card_of(path)
    assert schedule.build(recipe, path, frames=range(16), workers=0).written == 0
    assert "16 of 20 are there" in card_of(path)
    before = store.beside(path, "card.md").stat().st_mtime_ns
    schedule.build(recipe, path, frames=range(16), workers=0)
    assert store.beside(path, "card.md").stat().st_mtime_ns == before


MARKUP = """\
<script>alert(1)</script> <img src=x onerror=alert(2)> [click](javascript:alert(3)) ![p](https://doi.org/p.png)

# heading ```
---
<javascript:alert(4)> | a | b | [x]: javascript:alert(5) &#106;avascript: `code` ~~~
"""


def test_what_a_store_says_of_itself_is_text_in_its_card(built: Path, tmp_path: Path) -> None:
    path = Path(shutil.copytree(built, tmp_path / "s.zarr"))
    root = json.loads((path / "zarr.json").read_bytes())
    attributes = root["attributes"]
    urls = {"url": "javascript:alert(6)"}
    attributes["title"] = attributes["licence"] = attributes["provenance"]["created"] = MARKUP
    attributes["dataset"] = {"description": MARKUP, "citation": MARKUP, "creators": [{"name": MARKUP, **urls}], **urls}
    attributes["plan"]["warnings"], attributes["products"] = [MARKUP], [MARKUP]
    array = root["consolidated_metadata"]["metadata"]["image/energy"]
    array["attributes"] |= {"long_name": MARKUP, "units": MARKUP}
    root["consolidated_metadata"]["metadata"]["image/`x`\n# y"] = array
    (path / "zarr.json").write_text(json.dumps(root))
    card, data = (file.read_text() for file in cards.write(path))
    outside = re.sub(r"(?ms)^(```+)\w+$.*?^\1$", "", card)  # without code, where nothing has a meaning
    assert not re.search(r"<\s*(script|img|javascript)", outside)
    assert not re.search(r"(?<!\\)\[", outside)
    assert "&#106;" not in outside
    assert not re.search(r"(?m)^(# heading|---$|\[x\])", outside)
    assert [line for line in outside.splitlines() if line.startswith("# ")] == [outside.splitlines()[0]]
    assert outside.count("```") == outside.count("\\`\\`\\`") * 0
    assert len(re.search(r"```python\n(.*?)```", card, re.DOTALL)[1].strip().splitlines()) == 3  # type: ignore[index]
    assert '"javascript:' not in data


def test_the_card_says_what_digests_do_not_prove(built: Path) -> None:
    assert "finds damage, not forgery" in card_of(built)
