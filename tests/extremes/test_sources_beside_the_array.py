"""A source at the array, or among its hydrophones: a line that names the field, or a right result; never silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss

TANK = Path(__file__).resolve().parents[2] / "configs" / "tank.yaml"
FEW = ["scene.sonar.beams.azimuths=11", "scene.sonar.beams.elevations=11"]


def tank(x: float, y: float, z: float, *sets: str) -> ss.Recipe:
    """The tank, its sonar at (0, 0, -0.15) with hydrophones 1 cm from each other, and its shrimp elsewhere."""
    return ss.load(TANK, [f"scene.world.sources.0.position={[x, y, z]}", *FEW, *sets])


@pytest.mark.parametrize(
    ("position", "line"),
    [
        ((0.0, 0.0, -0.15), "is at the centre of the array at frame 0"),
        ((0.0, 0.005, -0.155), r"is at hydrophone \d+ of the array at frame 0"),
        ((0.0, 0.0052, -0.155), r"is at hydrophone \d+ of the array at frame 0"),
        (
            (0.0, 0.002, -0.15),
            r"is 0.002 m from the centre of the array at frame 0, among its hydrophones, which reach",
        ),
        ((0.03, 0.01, -0.15), r"is 0.0316 m from the centre .* it cannot be located, so there would be no image"),
    ],
)
def test_a_source_at_the_array_is_refused_in_one_line(position: tuple[float, float, float], line: str) -> None:
    with pytest.raises(ss.FieldError, match=rf"scene\.world\.sources\.0\.position: {line}") as refused:
        ss.plan(tank(*position))
    assert "\n" not in str(refused.value)


def test_among_the_hydrophones_its_signals_alone_are_right() -> None:
    """As if each hydrophone were traced by itself."""
    array = "scene.sonar.array={kind: planar_lattice, columns: 6, rows: 4, pitch: 2 cm}"
    near, exact = (
        ss.render(ss.plan(tank(0.02, 0.01, -0.15, array, *how), products=["signals"]), 0)["signals/pressure"].values
        for how in ((), ("scene.physics.subarrays=sensors",))
    )
    assert np.isfinite(near).all() and np.abs(near).max() > 1e3
    assert np.linalg.norm(near - exact) < 2e-3 * np.linalg.norm(exact)


def test_beside_the_hydrophones_it_is_located_and_imaged() -> None:
    beside = ss.render(tank(0.1, 0.0, -0.15), 0)
    assert np.isfinite(beside["image/energy"].values).all()
    assert float(beside["source_estimates/time"][0]) == pytest.approx(
        float(beside["truth/emissions/arrival"][0]), abs=1e-7
    )
