"""What reflecting waves as plane ones at a fast bottom leaves out, against Sommerfeld's integral of a spherical one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.special import jv

from sonarsynth import plan
from sonarsynth.conventions import Floats
from sonarsynth.equations.water.boundary_reflection import SEDIMENTS, plane_wave_error, rayleigh
from sonarsynth.recipe import reading

REMUS = Path(__file__).parents[2] / "configs" / "remus.yaml"
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)


def integral(k: float, distance: float, grazing: float, bottom: tuple[float, float, float] | None) -> complex:
    """Pressure of the plane waves of a point source after their reflection, in a unit of its own; None: V = 1.

    Over the sine of the grazing angle, from 1 to 0 (by the angle, which keeps it smooth) and on to -i infinity.
    """
    r, h = distance * np.cos(grazing), distance * np.sin(grazing)

    def waves(sine: Floats) -> Floats:
        value = np.exp(-1j * k * h * sine) * jv(0, k * r * np.sqrt(1.0 - sine**2 + 0j))
        if bottom is None:
            return value
        density, speed, loss = bottom
        n = (1.0 - 1j * loss) / speed
        w = np.sqrt((n - 1.0) * (n + 1.0) + sine**2 + 0j)
        w = np.where(w.imag > 0.0, -w, w)
        return value * (density * sine - w) / (density * sine + w)

    def over(first: float, last: float, parts: int) -> tuple[Floats, Floats]:
        edges = np.linspace(first, last, parts + 1)
        half = 0.5 * np.diff(edges)[:, None]
        return edges[:-1, None] + half * (1.0 + POINTS), half * WEIGHTS

    angle, real = over(0.5 * np.pi, 0.0, int(k * distance / 3.0) + 100)
    decay, imaginary = over(0.0, 40.0 / (k * h), 200)
    return complex(np.sum(real * np.cos(angle) * waves(np.sin(angle))) - 1j * np.sum(imaginary * waves(-1j * decay)))


@pytest.mark.parametrize("bottom", ["medium sand", "fine sand", "rock"])
@pytest.mark.parametrize(("distance", "frequency"), [(2.0, 25e3), (6.0, 25e3), (6.0, 55e3), (19.0, 55e3)])
def test_the_worst_error_of_plane_waves_is_what_is_said(bottom: str, distance: float, frequency: float) -> None:
    """Within five degrees of the critical angle 0.6 to 1.4 of it; fourteen degrees beyond a third at most."""
    k, sediment = 2.0 * np.pi * frequency / 1540.0, SEDIMENTS[bottom]
    critical = np.arccos(1.0 / sediment[1])

    def error(grazing: float) -> float:
        reflected, whole = integral(k, distance, grazing, sediment), integral(k, distance, grazing, None)
        return float(abs(reflected / whole - rayleigh(grazing, *sediment)))

    predicted = float(plane_wave_error(distance, k))
    worst = max(error(critical + np.deg2rad(off)) for off in np.arange(-5.0, 3.0, 0.5))
    assert 0.6 < worst / predicted < 1.4
    assert error(critical + np.deg2rad(14.0)) < predicted / 3.0


def test_a_plan_says_it_of_bottoms_with_a_critical_angle_that_are_asked_to_reflect() -> None:
    def rows(bottom: str, bounces: int) -> list[str]:
        settings = [f"scene.physics.tracing={{kind: auto, bounces: {bounces}}}", "scene.trajectory.frames=1"]
        settings += [f"scene.world.environment.bottom.reflection={bottom}"]
        left_out = plan(reading.load(REMUS, settings), ["paths"]).left_out
        return [row.bound for row in left_out if row.what == "curvature of waves at the bottom"]

    (bound,) = rows("{kind: sediment, name: medium sand}", 1)
    assert bound.startswith(f"up to {float(plane_wave_error(15.68, 2.0 * np.pi * 25e3 / 1540.0)):.1g} of a wave")
    assert "32 deg" in bound
    assert rows("{kind: sediment, name: medium sand}", 0) == []
    assert rows("{kind: sediment, name: clay}", 1) == []
    assert rows("{kind: rigid}", 1) == []
