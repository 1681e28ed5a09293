"""The page about a store: its numbers are those of the store, and nothing in it leads out."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import planning, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation import cloud_scores
from sonarsynth.pictures.report_figures import numbers_of
from sonarsynth.pictures.report_figures.report_numbers import leakage
from sonarsynth.recipe import reading

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


@pytest.fixture(scope="module")
def store(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten frames of five sequences in three splits, whose title would be a script."""
    noise = "{name: noise, path: environment.noise.level, kind: uniform, low: 30 dB, high: 50 dB}"
    text = small_text.replace("frames: 20", "frames: 2").replace("title: small", "title: '<script>alert(1)</script>'")
    text = text.replace("columns: 5, rows: 4", "columns: 12, rows: 8")  # which has points
    text = text.replace("{kind: box, size: [1, 1, 1], edge: 0.25}", "{kind: sphere, radius: 0.4, edge: 0.1}")
    text += f"variations: [{noise}]\nrepeats: 6\nsplits: {{train: 0.6, validation: 0.2, test: 0.2}}\n"
    path = tmp_path_factory.mktemp("report") / "s.zarr"
    plan = planning.plan(reading.loads(text), products={"image", "cloud"})
    assert schedule.build(plan, path, frames=range(10), workers=0).ok
    return path


class Page(HTMLParser):
    """Elements of a page, its tables, and the text of the element `numbers`."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.rows: list[list[str]] = []
        self.numbers = ""
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = "numbers" if dict(attrs).get("id") == "numbers" else tag
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "numbers":
            self.numbers += data
        elif self._inside in ("td", "th"):
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def page(store: Path) -> Page:
    assert run(app, ["report", str(store), "--out", str(store.with_name("page.v2"))]) == 0
    return Page(store.with_name("page.v2.html").read_text())


def test_the_numbers_of_the_page_are_those_of_the_store(store: Path, page: Page) -> None:
    tree, found = ss.open(store), json.loads(page.numbers)
    built = range(10)
    split = tree["split"].values[list(built)]
    names = ["train", "validation", "test"]
    assert found["splits"] == {names[n]: int((split == n).sum()) for n in dict.fromkeys(split.tolist())}
    assert found["frames"] == 10 and found["sequences"] == 5 and found["frames_of_the_recipe"] == 12
    assert sum(found["categories"]["target"].values()) == found["objects"] == 10
    away = np.linalg.norm(tree["truth/targets/box_centre"].values[list(built), 0], axis=1)
    counts = np.sum(list(found["histograms"]["range"]["counts"].values()), axis=0)
    np.testing.assert_array_equal(counts, np.histogram(away, found["histograms"]["range"]["edges"])[0])
    for kind in ("peaks", "cfar"):
        figures = ss.evaluate(store, ss.detect(store, kind)).as_json()
        mine = found["baselines"][kind]
        assert mine["ap_2m"] == figures["ap_2m"] and mine["detections"] == figures["detections"]
        assert mine["by_snr"] == json.loads(json.dumps(figures["by_snr"]))
        (row,) = (row for row in page.rows if row and row[0] == kind)
        assert row[4] == f"{figures['ap_2m']:.3f}"
    clouds = cloud_scores(tree, np.arange(10))
    assert found["clouds"] == clouds and clouds["points"] == int(tree["cloud/count"].values[:10].sum()) > 0
    assert ["frames", "10 of 12 built, 5 sequences"] in page.rows


def test_hardest_frames_are_those_with_most_errors(store: Path, page: Page) -> None:
    found = json.loads(page.numbers)
    missed = sum(row["missed"] for row in found["hardest"])
    false = sum(row["false_alarms"] for row in found["hardest"])
    peaks = found["baselines"]["peaks"]
    near = peaks["errors"]["azimuth"]["count"]
    assert missed == peaks["objects"] - near and false == peaks["detections"] - near
    errors = [row["missed"] + row["false_alarms"] for row in found["hardest"]]
    assert errors == sorted(errors, reverse=True)


def test_nothing_leads_out_of_the_page_and_no_text_is_markup(page: Page) -> None:
    leading = [attrs for tag, attrs in page.elements if attrs.get("src") or attrs.get("href") or tag in ("link", "img")]
    assert leading == []
    scripts = [attrs for tag, attrs in page.elements if tag == "script"]
    text = json.loads(page.numbers)["title"]
    assert text == "<script>alert(1)</script>"
    assert len(scripts) < 12 and not re.search(r"alert\(1\)", "".join(map(str, page.elements)))


def test_leaks_between_splits_are_counted(store: Path) -> None:
    tree = ss.open(store)
    names = ["train", "validation", "test"]
    split = [names[n] for n in tree["split"].values[:10]]
    apart = leakage(tree, np.arange(10), split)
    assert apart["sequences"] == 0
    torn = ["train" if n % 2 else "test" for n in range(10)]
    assert leakage(tree, np.arange(10), torn)["sequences"] == 5
    # bodies of this recipe are where they are in each sequence: frames of one step are equal
    assert apart["equal_frames"] == 10
    for name in ("position", "orientation", "mesh"):
        other = tree.copy(deep=True)
        values = other[f"truth/targets/{name}"].copy(deep=True)
        values[:] = values.values + np.arange(12).reshape(12, *[1] * (values.ndim - 1))
        other["truth/targets"] = xr.DataTree(other["truth/targets"].to_dataset().assign({name: values}))
        assert leakage(other, np.arange(10), split)["equal_frames"] == 0, name


def test_what_a_threshold_finds_is_said_to_be_trivial(store: Path) -> None:
    found = numbers_of(ss.open(store))
    reached = found["baselines"]["peaks"]["ap_2m"]
    assert any("a threshold reaches" in text for text in found["warnings"]) == (reached > 0.95)


def test_a_store_without_images_or_frames(small_text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = planning.plan(reading.loads(small_text), products=())
    path = tmp_path / "t.zarr"
    assert schedule.build(plan, path, frames=(3,), workers=0).ok
    assert run(app, ["report", str(path), "--out", str(tmp_path / "r.html")]) == 0
    found = json.loads(Page((tmp_path / "r.html").read_text()).numbers)
    assert found["baselines"] == {} and found["objects"] == 1 and found["range_errors"]["points"] == 0
    empty = tmp_path / "e.zarr"
    ss.build(reading.loads(small_text), empty, frames=(), workers=0)
    capsys.readouterr()
    assert run(app, ["report", str(empty)]) == 2
    assert "no frame has been built" in capsys.readouterr().err


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_a_browser_without_a_network_draws_the_page(store: Path, page: Page, tmp_path: Path) -> None:
    """Every figure is drawn, with the numbers of the page in it, and nothing is asked of a network or goes wrong."""
    assert CHROMIUM is not None
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'browser'}"]
    options += ["--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom"]
    nowhere = "--host-resolver-rules=MAP * ~NOTFOUND"
    file = store.with_name("page.v2.html").resolve().as_uri()
    done = subprocess.run([CHROMIUM, *options, nowhere, file], capture_output=True, text=True, timeout=120, check=True)
    drawn = Page(done.stdout)
    classes = [str(attributes.get("class")) for _, attributes in drawn.elements]
    figures = sum("js-plotly-plot" in name.split() for name in classes)
    written = sum("plotly-graph-div" in str(attributes.get("class")) for _, attributes in page.elements)
    assert figures == written >= 4
    assert any(tag == "image" for tag, _ in drawn.elements), "the film shows no image"
    assert sum(name == "main-svg" for name in classes) >= figures
    assert json.loads(drawn.numbers) == json.loads(page.numbers) and drawn.rows[: len(page.rows)] == page.rows
    bars = sum(name == "point" for name in classes)
    assert bars > 10, "the histograms have no bars"
    assert not re.findall(r"CONSOLE.*(?:Uncaught|error|Failed to load)", done.stderr)
