"""Boundaries as people write them: published values by name, and what is refused, in one clear line."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.environment.boundaries import SedimentName
from sonarsynth.environment.boundary_numbers import coefficient, rms_height
from sonarsynth.equations.water.boundary_reflection import (
    SEDIMENTS,
    bubble_loss,
    wind_wave_height,
)

GRAZING = np.radians([5, 10, 20, 30, 45, 60, 90])
MODULUS = {
    "medium sand": [0.9762, 0.9585, 0.9371, 0.8757, 0.4705, 0.3994, 0.3699],
    "fine sand": [0.9606, 0.9268, 0.8565, 0.4736, 0.2925, 0.2513, 0.2328],
    "medium silt": [0.3136, 0.1035, 0.0335, 0.0484, 0.0583, 0.0618, 0.0637],
}
TABLE: dict[str, Any] = {"grazing": ["0 deg", "45 deg", "90 deg"], "phase": ["180 deg", "175 deg", "170 deg"]}


@pytest.mark.parametrize("name", MODULUS)
def test_named_sediments_reflect_as_published(name: Any) -> None:
    got = coefficient(ss.SeaBottom(reflection=ss.Sediment(name=name)), GRAZING)
    np.testing.assert_allclose(np.abs(got), MODULUS[name], rtol=0, atol=5.1e-5)


def test_medium_sand_is_the_bed_unless_said_otherwise() -> None:
    np.testing.assert_allclose(
        np.abs(coefficient(ss.SeaBottom(), GRAZING)), MODULUS["medium sand"], rtol=0, atol=5.1e-5
    )
    assert -20 * np.log10(np.abs(coefficient(ss.SeaBottom(), np.pi / 2))) == pytest.approx(8.64, abs=5e-3)
    np.testing.assert_array_equal(coefficient(ss.SeaSurface(), GRAZING), -1.0)


def test_every_sediment_has_its_numbers() -> None:
    assert get_args(SedimentName) == tuple(SEDIMENTS)
    for name in SEDIMENTS:
        assert ss.Sediment(name=name).name == name


def test_the_sediments_are_those_of_the_handbooks_formulas() -> None:
    """APL-UW TR 9407 (1994), section IV: density and speed ratios from the mean grain size (phi)."""
    sizes = [-1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 6.5, 7, 7.5, 8, 9]
    for name, size in zip(list(SEDIMENTS)[2:], sizes, strict=True):
        if size < 1:
            density = np.polyval([0.007797, -0.17057, 2.3139], size)
            speed = np.polyval([0.002709, -0.056452, 1.2778], size)
        elif size < 5.3:
            density = np.polyval([-0.0165406, 0.2290201, -1.1069031, 3.0455], size)
            speed = np.polyval([-0.0014881, 0.0213937, -0.1382798, 1.3425], size)
        else:
            density, speed = np.polyval([-0.0012973, 1.1565], size), np.polyval([-0.0024324, 1.0019], size)
        np.testing.assert_allclose(SEDIMENTS[name][:2], (density, speed), rtol=0, atol=6e-4, err_msg=name)


def test_the_handbook_goes_from_hard_to_soft() -> None:
    density, speed, _ = np.array(list(SEDIMENTS.values())).T
    assert np.all(np.diff(density) <= 0.0)
    assert np.all(np.diff(speed) < 0.0)


def test_the_published_example_of_a_fluid_bed() -> None:
    bottom = ss.SeaBottom(reflection=ss.FluidHalfSpace(density_ratio=1200 / 1022.72, speed_ratio=1600 / 1539.087))
    got = coefficient(bottom, np.radians([45, 90]))
    np.testing.assert_allclose(got, [0.1198, 0.0990], rtol=0, atol=5.1e-5)
    below, above = np.radians([15.861 - 0.01, 15.861 + 0.01])
    assert np.abs(coefficient(bottom, below)) == pytest.approx(1.0, abs=1e-14)
    assert np.abs(coefficient(bottom, above)) < 0.95


def test_wind_makes_the_published_height_and_coherent_loss() -> None:
    """0.0053 U^2; 7.4 dB at 25 kHz, 29 dB at 50 kHz for 2.6 m/s at 10 degrees grazing."""
    sea = ss.SeaSurface(wind_speed=2.6)
    assert rms_height(sea) == pytest.approx(0.0053 * 2.6**2, rel=0.01)
    k = 2 * np.pi * np.array([25e3, 50e3]) / 1500
    loss = 10 * np.log10(np.e) * (2 * k * rms_height(sea) * np.sin(np.radians(10))) ** 2
    np.testing.assert_allclose(loss, [7.5, 30.0], atol=0.2)
    assert wind_wave_height(10.0) == pytest.approx(0.5332, abs=1e-4)


@pytest.mark.parametrize(
    ("wind", "frequency", "degrees", "loss"),
    [(10, 50e3, 10, 7.50), (10, 50e3, 30, 2.60), (10, 85e3, 10, 11.77), (10, 10e3, 90, 0.331)],
)
def test_bubbles_take_the_published_loss(wind: float, frequency: float, degrees: float, loss: float) -> None:
    assert bubble_loss(wind, frequency, np.radians(degrees)) == pytest.approx(loss, abs=6e-3)
    surface = ss.SeaSurface(wind_speed=wind, bubbles=True)
    got = coefficient(surface, np.radians(degrees), frequency)
    assert -20 * np.log10(-got.real) == pytest.approx(loss, abs=6e-3)


def test_bellhops_example_of_a_table() -> None:
    bottom = ss.SeaBottom(reflection=ss.ReflectionTable(modulus=(1.0, 0.95, 0.90), **TABLE))
    got = coefficient(bottom, np.radians([0, 22.5, 45, 90]))
    np.testing.assert_allclose(np.abs(got), [1.0, 0.975, 0.95, 0.90], rtol=1e-14)
    np.testing.assert_allclose(np.degrees(np.angle(got)), [180, 177.5, 175, 170], rtol=1e-13)


RECIPE = """
scene:
  world:
    environment:
      depth: 12 m
      sound_speed: {kind: isovelocity, speed: 1540}
      surface: {wind_speed: 5 m/s, bubbles: true}
      bottom: {reflection: {kind: sediment, name: fine sand}, rms_height: 1 cm}
    sources:
      - {kind: snapping_shrimp, position: [30, 1]}
  sonar: {}
  trajectory:
    sonar: {kind: still, position: [0, 0, -5]}
"""


def test_boundaries_are_written_and_read_as_yaml() -> None:
    recipe = ss.loads(RECIPE)
    water = recipe.scene.world.environment
    assert water.bottom == ss.SeaBottom(reflection=ss.Sediment(name="fine sand"), rms_height=0.01)
    assert water.surface == ss.SeaSurface(wind_speed=5.0, bubbles=True)
    assert ss.loads(ss.dump(recipe)) == recipe
    assert isinstance(hash(water), int)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "name: fine sand",
            "name: find sand",
            "bottom.reflection.name: 'find sand' is not a sediment here; did you mean",
        ),
        ("name: fine sand", "name: 7", "bottom.reflection.name: "),
        ("kind: sediment", "kind: sand", "bottom.reflection.kind: 'sand' is not a kind here; "),
        (
            "kind: sediment, name: fine sand",
            "name: fine sand",
            "bottom.reflection: needs a kind: one of pressure_release",
        ),
        ("rms_height: 1 cm", "rms_height: -1 cm", "bottom.rms_height: must be greater than or equal to 0"),
        ("rms_height: 1 cm", "roughness: 1 cm", "bottom.roughness: 'roughness' is not a field here"),
        ("wind_speed: 5 m/s", "rms_height: 1 cm", "surface.bubbles: need wind_speed"),
        ("bubbles: true", "rms_height: 1 cm", "surface.wind_speed: give either rms_height or wind_speed"),
    ],
)
def test_wrong_boundaries_are_named_with_their_line_and_field(old: str, new: str, message: str) -> None:
    assert old in RECIPE
    with pytest.raises(ss.RecipeError) as caught:
        ss.loads(RECIPE.replace(old, new))
    text = str(caught.value)
    assert f"scene.world.environment.{message}" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"grazing": [0, 1, 1, "90 deg"]}, "must rise, but entry 2 (1 rad) is not above entry 1 (1 rad)"),
        ({"grazing": ["0 deg", "20 deg", "60 deg"]}, "must reach from 0 to 90 deg, but ends at 60 deg"),
        ({"grazing": ["5 deg", "20 deg", "90 deg"]}, "must reach from 0 to 90 deg, but begins at 5 deg"),
        ({"grazing": [0, 45, 90]}, "must be within two turns, not 45 rad"),
        ({"grazing": [0]}, "at least 2"),
        ({"modulus": [1, 0.5]}, "has 2 entries, but grazing has 3"),
        ({"modulus": [1, 0.5, 1.1]}, "less than or equal to 1"),
        ({"modulus": [1, 0.5, float("nan")]}, "finite"),
        ({"modulus": None}, "give either modulus or loss"),
        ({"loss": ["0 dB", "1 dB", "2 dB"]}, "give either modulus or loss"),
        ({"modulus": None, "loss": [0, -1, 2]}, "greater than or equal to 0"),
        ({"phase": [180, 175, 170]}, "must be within two turns, not 180 rad"),
        ({"phase": ["180 deg", "175 deg"]}, "has 2 entries, but grazing has 3"),
    ],
)
def test_wrong_tables_are_refused_in_one_line(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        ss.ReflectionTable(**TABLE | {"modulus": [1.0, 0.95, 0.9]} | fields)
    named = "loss" if "loss" in fields or message == "give either modulus or loss" else next(iter(fields))
    said = [part for part in str(caught.value).partition(": ")[2].split("; ") if message in part]
    assert said and said[0].startswith(named) and "\n" not in str(caught.value)


@pytest.mark.parametrize("fields", [{"density_ratio": 0.0}, {"speed_ratio": -1.0}, {"loss_tangent": -0.1}])
def test_impossible_media_are_refused(fields: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"FluidHalfSpace: {next(iter(fields))}: must be greater than"):
        ss.FluidHalfSpace(**{"density_ratio": 1.5, "speed_ratio": 1.1} | fields)
