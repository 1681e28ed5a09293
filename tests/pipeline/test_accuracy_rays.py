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
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation import REFERENCES, Row, ray_accuracy
from sonarsynth.validation.extremes.extreme_rays import circle
from sonarsynth.validation.rays.ray_matching import Bounds, Rays, errors, miscounted, nearest, rays_of
from sonarsynth.validation.references.rays.exact_rays import exact_rays
from sonarsynth.validation.references.rays.shooting import munk, shooting_rays
from sonarsynth.validation.report import write


def ends(bottom_depth: float, farthest: float, pairs: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(pairs)
    start, end = rng.uniform(0.0, bottom_depth, (2, pairs))
    return start, end, np.geomspace(0.01, 1.0, pairs) * farthest


def isovelocity_rays(start: np.ndarray, end: np.ndarray, distance: np.ndarray, vertices: int) -> Rays:
    water = ray_solutions.water(np.array([0.0]), np.array([1500.0]), 100.0)
    return rays_of(ray_solutions.eigenrays(water, start, end, distance, vertices, vertices))


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return ray_accuracy(quick=True)


def test_the_search_is_within_every_bound(rows: list[Row]) -> None:
    assert [row for row in rows if not row.ok] == []
    assert {"isovelocity", "5 layers", "50 layers", "thermocline", "duct", "jumps", "noisy cast"} <= {
        row.case for row in rows
    }
    assert {"count", "family", "time", "angle", "amplitude"} <= {row.quantity for row in rows}
    assert all(row.counts["rays"] > 0 and row.cost > 0 and row.cost_unit == "us a ray" for row in rows)


@pytest.mark.parametrize(
    ("slope", "bottom_depth", "farthest"),
    [(0.0163, 4e3, 6e4), (-4.3, 20.0, 300.0), (1e-6, 100.0, 1e4), (0.0, 1e2, 1e4)],
)
def test_exact_rays_have_the_closed_forms_of_circles_and_images(
    slope: float, bottom_depth: float, farthest: float
) -> None:
    """Every ray that is not reflected: time and amplitude of the circle (the line) through both ends."""
    start, end, distance = ends(bottom_depth, farthest)
    depth, speed = np.array([0.0, bottom_depth]), np.array([1500.0, 1500.0 + slope * bottom_depth])
    water = ray_solutions.water(depth, speed, bottom_depth)
    found = ray_solutions.eigenrays(water, start, end, distance, 1, 0)
    followed = exact_rays(water, rays_of(found), found.slowness, start, end, distance)
    assert len(followed.pair) > 0
    for i, pair in enumerate(followed.pair):
        c = np.interp([start[pair], end[pair]], depth, speed)
        exact = circle(slope, *c.tolist(), float(np.hypot(distance[pair], start[pair] - end[pair])))
        assert followed.travel_time[i] == pytest.approx(exact[0], rel=1e-14)
        assert followed.amplitude[i] == pytest.approx(exact[1], rel=1e-11)


def test_shooting_in_a_smooth_profile_is_reciprocal() -> None:
    there = shooting_rays(munk(), 1000.0, np.array([1500.0]), 5e4, 8)
    back = shooting_rays(munk(), 1500.0, np.array([1000.0]), 5e4, 8)
    assert len(there.pair) == len(back.pair) > 1
    i, j = (np.argsort(rays.travel_time) for rays in (there, back))
    np.testing.assert_allclose(there.travel_time[i], back.travel_time[j], rtol=1e-13)
    np.testing.assert_allclose(there.start_angle[i], -back.end_angle[j], rtol=1e-9)
    np.testing.assert_allclose(there.amplitude[i], back.amplitude[j], rtol=1e-8)


def test_what_is_wrong_is_seen() -> None:
    start, end, distance = ends(100.0, 1e4)
    exact = isovelocity_rays(start, end, distance, 3)
    sound = np.ones(len(exact.pair), bool)
    late, loud = exact.travel_time.copy(), exact.amplitude.copy()
    late[3] += 2e-13
    loud[5] *= 1.0 + 2e-6
    wrong = errors(replace(exact, travel_time=late, amplitude=loud), exact, sound, Bounds())
    verdicts = {name: error <= bound for name, (_, error, bound) in wrong.items()}
    assert verdicts == {"time": False, "angle": True, "amplitude": False}
    gone = errors(replace(exact, travel_time=np.full(len(late), np.nan)), exact, sound, Bounds())
    assert not gone["time"][1] <= gone["time"][2]
    families = Counter(exact.families)
    assert miscounted(exact, families) == 0
    assert miscounted(exact.select(np.arange(1, len(exact.pair))), families) == 1
    assert miscounted(exact.select(np.append(np.arange(len(exact.pair)), 0)), families) == 1


def test_rays_are_matched_by_family_and_time() -> None:
    exact = isovelocity_rays(*ends(100.0, 1e4), 2)
    order = np.random.default_rng(1).permutation(len(exact.pair))
    mixed = exact.select(order)
    i, j = nearest(mixed, exact)
    assert sorted(j.tolist()) == list(range(len(exact.pair)))
    assert np.array_equal(order[i], j)


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
        "a case", "a reference", "time", "s", 1e-13, 1e-15, 0.7, "us a ray", {"pairs": 3, "rays": 9}, "a knob", "a note"
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
    monkeypatch.setattr("sonarsynth.validation.bubbles.find_spec", lambda name: None)
    assert run(app, ["--reference", "bubble", "--out", str(tmp_path)]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'sonarsynth[accuracy]'" in said
