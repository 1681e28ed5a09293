"""Formulas out of their range: in the plan, once, with the field; never as a warning of Python."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pytest

import sonarsynth as ss
from sonarsynth import cli
from sonarsynth.cli.running import run
from sonarsynth.description import FieldError

RECIPE = """
scene:
  world:
    environment:
      depth: 12 m
      sound_speed: {kind: isovelocity, speed: 1540}
      surface: {}
      bottom: {}
      absorption: {}
      noise: {kind: flat, level: 40}
    targets:
      - {name: box, shape: {kind: box, size: [1, 1, 1], edge: 0.25}, motion: {kind: still, position: [0, 15, -6]}}
    sources:
      - {kind: snapping_shrimp, position: [20, 1]}
  sonar:
    array: {kind: planar_lattice, columns: 4, rows: 3, pitch: 5 cm}
    beams: {azimuths: 3, elevations: 3}
  trajectory:
    frames: 2
    sonar: {kind: still, position: [0, 0, -5], heading: 0 deg}
  physics: {tracing: {kind: auto, bounces: 1}}
"""
WATER = "scene.world.environment."
COLD = "{kind: temperature_salinity, depth: [0, 12], temperature: [0.5, 1], salinity: [35, 35]}"
CASES = {
    "nothing": ("bottom: {}", "bottom: {}", []),
    "cold water": (
        "{kind: isovelocity, speed: 1540}",
        COLD,
        [f"{WATER}sound_speed: Mackenzie (1981): temperature 0.5"],
    ),
    "two of one water": (
        "{kind: isovelocity, speed: 1540}",
        COLD.replace("[35, 35]", "[0, 0]"),
        [
            f"{WATER}sound_speed: Mackenzie (1981): temp",
            f"{WATER}sound_speed: Mackenzie (1981): salinity 0 psu is outs",
        ],
    ),
    "hot absorption": (
        "absorption: {}",
        "absorption: {temperature: 32}",
        [f"{WATER}absorption: Francois and Garrison (1982): temperature 32 degC is outside -2 to 30 degC; ainslie_mcc"],
    ),
    "fresh absorption": (
        "absorption: {}",
        "absorption: {formula: ainslie_mccolm, salinity: 1}",
        [f"{WATER}absorption: Ainslie and McColm (1998): salinity 1 psu is outside 5 to 50 psu"],
    ),
    "a gale's noise": (
        "kind: flat, level: 40",
        "kind: wenz, wind_speed: 20",
        [f"{WATER}noise: Wenz's noise as of Coates (1989): wind speed 20 m/s is outside 0 to 15 m/s"],
    ),
    "a breeze": (
        "surface: {}",
        "surface: {wind_speed: 5, bubbles: true}",
        [f"{WATER}surface.wind_speed: waves of Pierson and Moskowitz (1964): wind speed 5 m/s is outside 10 to 21 m/s"],
    ),
    "a strong wind": ("surface: {}", "surface: {wind_speed: 12, bubbles: true}", []),
    "rock": (
        "bottom: {}",
        "bottom: {reflection: {kind: sediment, name: rock}}",
        [f"{WATER}bottom.reflection: Rayleigh's bottom without shear waves: speed ratio 2.5 is outside 0 to 1.5"],
    ),
    "a fluid as fast as rock": (
        "bottom: {}",
        "bottom: {reflection: {kind: fluid, density_ratio: 2, speed_ratio: 2}}",
        [f"{WATER}bottom.reflection: Rayleigh's bottom without shear waves: speed ratio 2 is outside 0 to 1.5"],
    ),
    "low frequencies": (
        "    beams:",
        "    band: {low: 2 kHz, high: 8 kHz}\n    beams:",
        [f"{WATER}bottom.reflection: sediments of APL-UW TR 9407 (1994): frequency 2 kHz is outside 10 to 100 kHz"],
    ),
}


def _notes(made: ss.Plan) -> list[str]:
    return [note for note in made.warnings if note.startswith("scene.")]


BREEZE = f"{WATER}surface.wind_speed: waves of Pierson and Moskowitz (1964): wind speed 5 m/s is outside"


@pytest.mark.parametrize(
    ("sea", "expected"),
    [
        ("", []),
        ("chorus: {reach: 20, images: 2}", [BREEZE]),
        ("reverberation: {bottom: null, bounces: 0}", [BREEZE]),
        ("reverberation: {surface: null, bounces: 1}", [BREEZE]),
        ("reverberation: {surface: null, bounces: 0}", []),
        (
            "reverberation: {bottom: null, surface: {kind: wind, wind_speed: 30}}",
            [BREEZE, "scene.world.reverberation.surface: waves of Pierson and Moskowitz (1964): wind speed 30 m/s is"],
        ),
    ],
)
def test_boundaries_that_chorus_and_reverberation_meet_are_said_too(sea: str, expected: list[str]) -> None:
    """Without reflections of snaps nothing was said of them, and a wind of the reverberation's own warned in frames."""
    text = RECIPE.replace("surface: {}", "surface: {wind_speed: 5}").replace("    targets:", f"    {sea}\n    targets:")
    made = ss.plan(ss.loads(text.replace("{kind: auto, bounces: 1}", "{kind: auto}")), ["signals"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.render(made, 0)
    found = [note for note in _notes(made) if "Pierson" in note]
    assert len(found) == len(expected)
    assert all(note.startswith(beginning) for note, beginning in zip(found, expected, strict=True))


@pytest.mark.parametrize("case", CASES)
def test_a_plan_says_each_once_with_its_field(case: str) -> None:
    old, new, expected = CASES[case]
    assert old in RECIPE
    recipe = ss.loads(RECIPE.replace(old, new))
    for _ in range(2 if new.startswith(COLD[:20]) else 1):  # the second time, profiles are kept
        found = _notes(ss.plan(recipe))
        assert len(found) == len(expected)
        for note, beginning in zip(found, expected, strict=True):
            assert note.startswith(beginning)
            assert "\n" not in note


def test_boundaries_that_no_path_meets_are_not_noted() -> None:
    text = RECIPE.replace("bottom: {}", "bottom: {reflection: {kind: sediment, name: rock}}")
    assert _notes(ss.plan(ss.loads(text.replace("bounces: 1", "bounces: 0")))) == []


def test_what_the_sonar_believes_in_is_noted_as_well() -> None:
    text = RECIPE + "  processing: {placing: {kind: refracted, profile: " + COLD + "}}\n"
    (note,) = _notes(ss.plan(ss.loads(text)))
    assert note.startswith("scene.processing.placing.profile: Mackenzie (1981): temperature 0.5 degC is outside 2 to")
    missing = RECIPE + "  processing: {placing: {kind: refracted, profile: {kind: cast, path: none.csv}}}\n"
    with pytest.raises(ValueError, match=r"none\.csv"):
        ss.plan(ss.loads(missing))


def test_frames_are_made_without_a_word(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    everything = RECIPE
    for case in ("cold water", "hot absorption", "a gale's noise", "a breeze", "rock"):
        old, new, _ = CASES[case]
        everything = everything.replace(old, new)
    path = tmp_path / "all.yaml"
    path.write_text(everything)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(cli.app, ["plan", str(path)]) == 0
        said = "".join(capfd.readouterr().out.split())
        assert run(cli.app, ["build", str(path), str(tmp_path / "s.zarr"), "--workers", "0"]) == 0
    out, err = capfd.readouterr()
    notes = _notes(ss.plan(ss.loads(everything)))
    assert len(notes) == 5
    for note in notes:
        assert said.count("".join(note.split())) == 1
    assert "OutOfRange" not in out + err


def test_teos10_without_gsw_names_the_field_and_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gsw", None)
    water = COLD.replace("[0.5, 1]", "[0.25, 1]").replace("]}", "], formula: teos10}")
    with pytest.raises(FieldError, match=r"sound_speed: teos10 needs gsw \(pip install 'sonarsynth\[teos10\]'\): "):
        ss.plan(ss.loads(RECIPE.replace("{kind: isovelocity, speed: 1540}", water)))


@pytest.mark.parametrize(
    ("written", "message"),
    [
        (
            "temperature: [300, 1]",
            r"temperature\.0: must be at most 60 degC, not 300 \(26\.85 degC if it is in kelvin\)",
        ),
        (
            "temperature: [0.5, 80]",
            r"temperature\.1: must be at most 60 degC, not 80 \(26\.67 degC if it is in degrees F",
        ),
        ("temperature: [0.5, 1e3]", r"temperature\.1: must be less than or equal to 60, not 1000"),
        ("temperature: [0.5, 5 K]", r"temperature\.1: has unit 'K'; use one of degC"),
        ("temperature: [-40, 1]", r"temperature\.0: must be greater than or equal to -5, not -40"),
        ("depth: [-3, 12]", r"depth\.0: must be greater than or equal to 0, not -3"),
        ("salinity: [35, -1]", r"salinity\.1: must be greater than or equal to 0, not -1"),
        ("latitude: 36", "latitude: 36 could be 36 deg or 36 rad: write the unit"),
        (
            "formula: eos80",
            r"formula: must be 'mackenzie', 'medwin', 'chen_millero', 'del_grosso' or 'teos10', not 'eos80'",
        ),
    ],
)
def test_water_that_is_none_is_refused_in_one_line(written: str, message: str) -> None:
    fields = {"kind": "temperature_salinity", "depth": "[0, 12]", "temperature": "[0.5, 1]", "salinity": "[35, 35]"}
    name, value = written.split(": ", 1)
    water = "{" + ", ".join(f"{k}: {v}" for k, v in (fields | {name: value}).items()) + "}"
    with pytest.raises(ss.RecipeError, match=message) as refused:
        ss.loads(RECIPE.replace("{kind: isovelocity, speed: 1540}", water))
    assert "\n" not in str(refused.value)
