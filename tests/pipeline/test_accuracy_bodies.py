"""The accuracy of echoes by facets: rows within their bounds, references that agree, wrong figures seen, pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1

from sonarsynth.equations.scattering.modal_series import Fluid, cylinder_amplitude, sphere_amplitude
from sonarsynth.validation import REFERENCES, Row
from sonarsynth.validation.bodies.body_cases import BAND, SOUND_SPEED, Point, order, trade_rows, wavenumber
from sonarsynth.validation.bodies.cylinder import lit_cylinder
from sonarsynth.validation.bodies.facet_integral import exact_triangle, triangle_rows
from sonarsynth.validation.bodies.sphere import front_echo
from sonarsynth.validation.report import write

BODIES = ("sphere", "cylinder", "plate")
PART: Mapping[str, set[str]] = {
    "sphere": {"at the mirror angle", "square to an edge", "amplitude", "level", "order less 2", "error as expected"}
    | {"backscatter", "bistatic, 0 to 60 deg", "bistatic, 105 to 120 deg", "front, 0 to 60 deg", "left out"},
    "cylinder": {"amplitude", "order less 2", "error as expected", "broadside", "side, 90 to 45 deg"},
    "plate": {"amplitude", "straight back", "nulls", "null"},
}


@pytest.fixture(scope="module")
def rows() -> dict[str, list[Row]]:
    return {name: REFERENCES[name](True) for name in BODIES}


@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_echoes_of_facets_are_within_every_bound(rows: dict[str, list[Row]], name: str) -> None:
    of = rows[name]
    assert [row for row in of if not row.ok] == []
    assert PART[name] <= {row.quantity for row in of}
    assert all(row.cost > 0 and row.counts["facets"] > 0 and row.counts["values"] > 0 for row in of)
    for knob in {row.knob for row in of if row.knob}:
        trade = [row for row in of if row.knob == knob]
        assert len(trade) >= 3
        facets = [row.counts["facets"] for row in trade]
        assert facets == sorted(facets)


def test_triangles_of_many_digits_are_those_of_closed_forms() -> None:
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0]])
    assert exact_triangle(corners, np.zeros(3)) == (pytest.approx(3.0, abs=1e-15), 3.0)
    for a in (1e-9, 0.7, 40.0):  # along x: int_0^2 3 (1 - x/2) exp(i a x) dx
        with mp.workdps(40):
            b = mp.mpf(a)
            closed = complex(3 * (1j / b + (1 - mp.exp(2j * b)) / (2 * b * b)))
        assert abs(exact_triangle(corners, np.array([a, 0.0, 5.0]))[0] - closed) < 1e-15
    wave, middle = np.array([3.0, -7.0, 2.0]), corners.mean(axis=0)
    parts = [np.array([corners[i], corners[i - 2], middle]) for i in range(3)]
    assert abs(sum(exact_triangle(part, wave)[0] for part in parts) - exact_triangle(corners, wave)[0]) < 1e-15


def test_the_integral_over_a_cylinder_is_that_of_quadrature_and_near_the_series() -> None:
    a, length = 0.1, 0.8
    for k in (5.0, 104.7, 460.0):
        for aspect in (0.3, 1.2, 0.5 * np.pi):
            x = 2 * k * a * np.sin(aspect)
            around = [
                quad(lambda q, g=g, x=x: np.cos(q) * g(x * np.cos(q)), 0, np.pi / 2, limit=400)[0]
                for g in (np.cos, np.sin)
            ]
            side = a * np.sin(aspect) * length * np.sinc(k * length * np.cos(aspect) / np.pi) * 2 * complex(*around)
            end = np.pi * a * a * np.cos(aspect) * 2 * j1(x) / x * np.exp(1j * k * length * np.cos(aspect))
            exact = 0.5j * k / np.pi * (side + end)
            assert abs(lit_cylinder(aspect, k, a, length) - exact) < 1e-9 * abs(0.5 * k / np.pi * a * length)
    k = wavenumber(BAND)
    assert np.abs(lit_cylinder(0.0, k, a, length)) == pytest.approx(np.pi * a * a * BAND / SOUND_SPEED)
    series = cylinder_amplitude(BAND, 0.5 * np.pi, radius=a, length=length)
    assert np.abs(lit_cylinder(0.5 * np.pi, k, a, length) / series - 1).max() < 0.06


@pytest.mark.parametrize("away", [0.0, 0.8])
def test_the_front_echo_of_a_sphere_as_heavy_as_can_be_is_that_of_a_rigid_one(away: float) -> None:
    front = front_echo(BAND, away, 0.25, Fluid(1e9, 1.0), SOUND_SPEED)
    whole = sphere_amplitude(BAND, np.pi - away, radius=0.25)
    assert np.abs(front / whole - 1).max() < 0.03
    through = front_echo(BAND, away, 0.25, Fluid(1.0, 1.0), SOUND_SPEED)
    assert np.abs(through).max() < 1e-9


def points(power: float, factor: float) -> list[Point]:
    edges = np.array([0.04, 0.02, 0.01])
    rise = BAND / BAND[-1]
    return [
        Point(100, e, 1.0, np.full((4, 1), factor * (e / 0.1) ** power) * rise, (e / 0.1) ** 2 * rise) for e in edges
    ]


def test_what_is_wrong_is_seen() -> None:
    assert order(points(1.7, 1.0)) == pytest.approx(1.7)
    for power, factor, wrong in (
        (2.0, 1.0, set()),
        (2.0, 0.4, {"error as expected"}),
        (2.0, 3.0, {"amplitude", "error as expected"}),
        (1.7, 1.0, {"order less 2"}),
    ):
        assert {row.quantity for row in trade_rows("a", "b", points(power, factor)) if not row.ok} == wrong


def test_a_wrong_integral_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    from sonarsynth.validation.bodies.facet_integral import triangle_integral

    monkeypatch.setattr(
        "sonarsynth.validation.bodies.facet_integral.triangle_integral",
        lambda x, w: triangle_integral(x, w) * (1 + 1e-11),
    )
    assert not any(row.ok for row in triangle_rows(True) if row.quantity == "1e-8 off the mirror angle")


def test_rows_and_picture_are_written(rows: dict[str, list[Row]], tmp_path: Path) -> None:
    files = write(rows["plate"], tmp_path, "plate")
    assert [file.name for file in files] == ["plate.json", "plate.png"]
    answer = json.loads(files[0].read_text())
    assert {"case", "quantity", "bound", "error", "ok", "cost", "cost_unit", "facets", "knob"} <= set(answer[0])
    assert files[1].stat().st_size > 30_000
