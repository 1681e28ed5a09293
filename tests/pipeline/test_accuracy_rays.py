"""The accuracy of eigenrays: the references agree with each other, errors are seen, rows, picture and command."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer

from sonarsynth.cli.accuracy_command import accuracy
from sonarsynth.cli.running import run
from sonarsynth.validation import REFERENCES, Row, ray_accuracy
from sonarsynth.validation.rays.eigenray_checks import image_rays
from sonarsynth.validation.rays.ray_matching import Bounds, Rays, errors, matched, miscounted, nearest
from sonarsynth.validation.references.rays.mpmath_layers import Layers, exact_rays
from sonarsynth.validation.references.rays.one_gradient import Gradient, gradient_rays
from sonarsynth.validation.references.rays.shooting import munk, shooting_rays
from sonarsynth.validation.references.rays.slowness_fan import count_rays
from sonarsynth.validation.report import write


def ends(bottom_depth: float, farthest: float, pairs: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(pairs)
    start, end = rng.uniform(0.0, bottom_depth, (2, pairs))
    return start, end, np.geomspace(0.01, 1.0, pairs) * farthest


def within(got: Rays, exact: Rays, bounds: Bounds) -> bool:
    return all(error <= bound for _, error, bound in errors(got, exact, np.ones(len(got.pair), bool), bounds).values())


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return ray_accuracy(quick=True)


def test_the_search_is_within_every_bound(rows: list[Row]) -> None:
    assert [row for row in rows if not row.ok] == []
    assert {"isovelocity", "5 layers", "50 layers", "thermocline", "duct", "jumps", "noisy cast"} <= {
        row.case for row in rows
    }
    assert {"count", "family", "time", "angle", "amplitude", "caustics"} <= {row.quantity for row in rows}
    assert all(row.counts["rays"] > 0 and row.cost > 0 and row.cost_unit == "us a ray" for row in rows)


@pytest.mark.parametrize(
    ("slope", "bottom_depth", "farthest"), [(0.0163, 4e3, 6e4), (-4.3, 20.0, 300.0), (1e-6, 100.0, 1e4)]
)
def test_circles_digits_and_fan_agree(slope: float, bottom_depth: float, farthest: float) -> None:
    start, end, distance = ends(bottom_depth, farthest)
    circles = gradient_rays(Gradient(1500.0, slope, bottom_depth), start, end, distance, 5)
    depth, speed = np.array([0.0, bottom_depth]), np.array([1500.0, 1500.0 + slope * bottom_depth])
    p = np.cos(circles.start_angle) / np.interp(start[circles.pair], depth, speed)
    digits = exact_rays(Layers(depth, speed), circles, p, start, end, distance)
    assert circles.families == digits.families
    assert within(circles, digits, Bounds(time=1e-15, relative_time=1e-15, angle=1e-14, amplitude=1e-12))
    one_sided = {
        f: n for f, n in count_rays(depth, speed, start, end, distance, 5, 5).items() if f[3 if slope > 0 else 2] == 0
    }
    assert miscounted(circles, Counter(one_sided)) == 0


def test_images_digits_and_fan_agree() -> None:
    start, end, distance = ends(100.0, 1e4)
    images = image_rays(1500.0, 100.0, start, end, distance, 4)
    assert len(images.pair) == 9 * len(start)
    depth, speed = np.array([0.0, 100.0]), np.full(2, 1500.0)
    digits = exact_rays(Layers(depth, speed), images, np.cos(images.start_angle) / 1500.0, start, end, distance)
    assert images.families == digits.families
    assert within(images, digits, Bounds(time=1e-14, angle=1e-14, amplitude=1e-14))
    assert miscounted(images, count_rays(depth, speed, start, end, distance, 4, 4)) == 0


def test_shooting_in_a_smooth_profile_is_reciprocal() -> None:
    there = shooting_rays(munk(), 1000.0, np.array([1500.0]), 5e4, 8)
    back = shooting_rays(munk(), 1500.0, np.array([1000.0]), 5e4, 8)
    assert len(there.pair) == len(back.pair) > 1
    i, j = (np.argsort(rays.travel_time) for rays in (there, back))
    np.testing.assert_allclose(there.travel_time[i], back.travel_time[j], rtol=1e-13)
    np.testing.assert_allclose(there.start_angle[i], -back.end_angle[j], rtol=1e-9)
    np.testing.assert_allclose(there.amplitude[i], back.amplitude[j], rtol=1e-8)
    assert there.caustics[i].tolist() == back.caustics[j].tolist()


def test_what_is_wrong_is_seen() -> None:
    start, end, distance = ends(100.0, 1e4)
    exact = image_rays(1500.0, 100.0, start, end, distance, 3)
    sound = np.ones(len(exact.pair), bool)
    late, loud = exact.travel_time.copy(), exact.amplitude.copy()
    late[3] += 2e-13
    loud[5] *= 1.0 + 2e-6
    wrong = errors(replace(exact, travel_time=late, amplitude=loud), exact, sound, Bounds())
    verdicts = {name: error <= bound for name, (_, error, bound) in wrong.items()}
    assert verdicts == {"time": False, "angle": True, "amplitude": False, "caustics": True}
    gone = errors(replace(exact, travel_time=np.full(len(late), np.nan)), exact, sound, Bounds())
    assert not gone["time"][1] <= gone["time"][2]
    families = Counter(exact.families)
    assert miscounted(exact, families) == 0
    assert miscounted(exact.select(np.arange(1, len(exact.pair))), families) == 1
    assert miscounted(exact.select(np.append(np.arange(len(exact.pair)), 0)), families) == 1


def test_rays_are_matched_by_family_and_time() -> None:
    exact = image_rays(1500.0, 100.0, *ends(100.0, 1e4), 2)
    order = np.random.default_rng(1).permutation(len(exact.pair))
    mixed = exact.select(order)
    for match in (matched, nearest):
        i, j = match(mixed, exact)
        assert sorted(j.tolist()) == list(range(len(exact.pair)))
        assert np.array_equal(order[i], j)
    i, j = matched(exact.select(np.zeros(0, int)), exact)
    assert len(i) == len(j) == 0


def test_rows_and_picture_are_written(rows: list[Row], tmp_path: Path) -> None:
    files = write(rows, tmp_path / "new", "rays")
    assert [file.name for file in files] == ["rays.json", "rays.png"]
    answer = json.loads(files[0].read_text())
    assert len(answer) == len(rows)
    assert {"case", "quantity", "bound", "error", "ok", "cost", "cost_unit", "pairs", "rays"} <= set(answer[0])
    assert files[1].stat().st_size > 10_000
    lost = Row("a", "b", "time", "s", 1e-13, float("nan"), 1.0, "us a ray", {"pairs": 1, "rays": 1})
    assert not lost.ok
    assert lost.as_json()["error"] is None


def test_the_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    app = typer.Typer()
    app.command()(accuracy)
    good = Row(
        "a case", "a reference", "time", "s", 1e-13, 1e-15, 0.7, "us a ray", {"pairs": 3, "rays": 9}, note="a note"
    )
    monkeypatch.setitem(REFERENCES, "rays", lambda quick: [good])
    assert run(app, ["--reference", "rays", "--out", str(tmp_path)]) == 0
    out = capfd.readouterr().out
    assert "a case" in out
    assert "ok (1)" in out and "(1) a note" in out
    assert "1 rows, all within their bounds" in out
    assert str(tmp_path / "rays.png") in out
    monkeypatch.setitem(REFERENCES, "rays", lambda quick: [good, replace(good, error=1e-12)])
    assert run(app, ["--json", "--out", str(tmp_path)]) == 1
    assert [row["ok"] for row in json.loads(capfd.readouterr().out)] == [True, False]
    assert run(app, ["--reference", "nothing", "--out", str(tmp_path)]) == 2
    assert capfd.readouterr().err == f"sonarsynth: --reference nothing is not one of {', '.join(REFERENCES)}\n"


def test_without_mpmath_one_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    app = typer.Typer()
    app.command()(accuracy)
    monkeypatch.setattr("sonarsynth.validation.rays.eigenray_checks.find_spec", lambda name: None)
    assert run(app, ["--out", str(tmp_path)]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'sonarsynth[accuracy]'" in said
