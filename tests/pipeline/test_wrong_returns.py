"""A method that returns what its family does not, or NaN, is named in one line, before NumPy stumbles over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.description.method import WrongReturn
from sonarsynth.detection import ImagePeaks, Region, SonarView, detections_of
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.environment.scatterers.stones import Stones
from sonarsynth.imaging import Capon
from sonarsynth.planning import Plan
from sonarsynth.planning.notes.source_notes import locator
from sonarsynth.propagation import Refracted
from sonarsynth.ranging.cancelling.reflection_cancelling import WavefrontCancelling
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes
from sonarsynth.scattering.boundaries.lambert_boundary import Lambert
from sonarsynth.scattering.components import CoherentKirchhoff
from sonarsynth.sources.shrimp import SnappingShrimp

Spoiled = Callable[[Any], Any]

BOTTOM = "scene.world.reverberation={bottom: {kind: lambert}}"
STONES = "scene.world.scatterers=[{kind: stones, positions: [[10, 0], [11, 0]]}]"
NOISE = "scene.world.environment.noise={kind: flat, level: 41 dB}"
HUM = (
    "scene.world.noise_sources=[{name: hum, motion: {kind: still, position: [5, 5, -3]}, "
    "sound: {kind: flat, level: 120 dB}}]"
)
KIRCHHOFF = "scene.physics.scattering={kind: kirchhoff}"
CAPON = "scene.processing.beamforming={kind: capon}"
BENT = [
    "scene.physics.tracing={kind: refracted}",
    "scene.world.environment.sound_speed={kind: linear, surface_speed: 1500 m/s, gradient: 1}",
]
CANCEL = "scene.processing.cancelling={kind: wavefront}"


def column(**changes: Spoiled) -> Spoiled:
    """A table with some columns changed."""
    return lambda table: replace(table, **{name: change(getattr(table, name)) for name, change in changes.items()})


def short(array: Any) -> Any:
    return np.asarray(array)[:-1]


def longer(array: Any) -> Any:
    return np.append(array, 0.0)


def unknown(array: Any) -> Any:
    return np.full_like(array, np.nan)


def unknown_between(density: Any) -> Any:
    """Where a few frequencies over the band would not show it."""
    return np.where(np.arange(len(density)) == len(density) // 2 + 1, np.nan, density) if len(density) > 17 else density


def nothing(_: Any) -> None:
    return None


CASES: list[tuple[str, Callable[[Plan], Any], str, list[str], Spoiled, str]] = [
    ("energies", lambda p: p.choices.beamforming, "energies", [], short, r"shape \(8, 11\), not .* \(9, 11\)"),
    ("energies", lambda p: p.choices.beamforming, "energies", [], unknown, "NaN"),
    ("picks", lambda p: p.choices.picking, "picks", [], column(energy=longer), r"shape \(\d+,\) as energy"),
    ("picks", lambda p: p.choices.picking, "picks", [], lambda _: PickedEchoes(*9 * [np.full(1, np.nan)]), "NaN as"),
    ("picks", lambda p: p.choices.picking, "picks", [], nothing, "a NoneType, not a PickedEchoes"),
    ("place", lambda p: p.choices.placing, "place", [], column(position=np.transpose), r"as position, not .* 3\)"),
    ("signals", lambda p: p.choices.synthesis, "signals", [], column(pressure=short), r"\(19, \d+\) as pressure"),
    ("signals", lambda p: p.choices.synthesis, "signals", [], nothing, "a NoneType as pressure, not an array"),
    ("amplitude", lambda p: p.scene.laws[0], "amplitude", [], lambda a: np.atleast_1d(a)[..., None], "shape"),
    ("amplitude", lambda p: p.scene.laws[0], "amplitude", [], unknown, "NaN"),
    ("connect", lambda p: p.propagation, "connect", [], column(travel_time=short), "as travel_time, not an array"),
    ("connect", lambda p: p.propagation, "connect", [], column(spreading=unknown), "NaN as spreading"),
    ("locate", lambda p: locator(p.scene), "locate", [], column(position=short), r"\(0, 3\) as position"),
    (
        "cancel",
        lambda _: WavefrontCancelling(),
        "cancel",
        [CANCEL],
        column(pressure=short),
        "as pressure",
    ),
    ("density", lambda _: FlatNoise(level=40.0), "density", [], lambda d: d[0], r"shape \(\), not .* \(17,\)"),
    ("density", lambda _: FlatNoise(level=40.0), "density", [], unknown, "NaN"),
    ("density", lambda _: FlatNoise(level=40.0), "density", [NOISE], unknown_between, "NaN"),
    ("density", lambda _: FlatNoise(level=40.0), "density", [HUM], unknown_between, "NaN"),
    ("velocity", lambda _: SnappingShrimp, "velocity", [], short, r"\(2,\), not .* \(3,\)"),
    ("directivity", lambda _: SnappingShrimp, "directivity", [], lambda _: lambda u: u[..., 0] * np.nan, "NaN"),
    ("directivity", lambda _: SnappingShrimp, "directivity", [], lambda _: np.abs, r"shape \(.*3\), not an array"),
    ("part", lambda _: CoherentKirchhoff, "amplitude", [KIRCHHOFF], lambda a: a[..., None], "shape"),
    ("beside", lambda _: Refracted, "beside", BENT, lambda r: r._replace(spreading=unknown(r.spreading)), "NaN"),
    ("beside", lambda _: Refracted, "beside", BENT, lambda r: r._replace(departure=r.spreading), "as departure"),
    ("steered", lambda _: Capon, "steered", [CAPON], lambda f: lambda u: f(u)[:, :-1], "shape"),
    ("position", lambda _: SnappingShrimp(position=(1.0, 1.0)), "position_at", [], short, r"\(2,\), not .* \(3,\)"),
    ("strength", lambda _: Lambert(), "strength", [BOTTOM], short, "shape"),
    ("scatterers", lambda _: Stones, "scatterers", [STONES], column(sign=unknown), "NaN as sign"),
    ("pulse", lambda p: p.scene.sources[0].model(12.0), "pulse", [], column(strength=short), "as strength"),
]


@pytest.mark.parametrize(("kind", "method", "name", "settings", "spoil", "said"), CASES)
def test_it_is_named_with_what_was_expected(
    small_file: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch, kind: str, method: Callable[[Plan], Any],
    name: str, settings: list[str], spoil: Spoiled, said: str,
) -> None:  # fmt: skip
    found = method(small_plan)
    of = found if isinstance(found, type) else type(found)
    right = getattr(of, name)
    monkeypatch.setattr(of, name, lambda *args, **named: spoil(right(*args, **named)))
    line = rf"^sonarsynth\.\S+\.{of.__name__}\.{name} returned .*{said}"
    with pytest.raises(WrongReturn, match=line):
        ss.render(ss.plan(ss.load(small_file, settings)), 3)


@pytest.mark.parametrize(
    ("region", "said"),
    [
        (Region(np.array([1]), np.array([[1, 2]]), 1.0), r"shape \(1, 2\) as columns, not an array of shape \(2,\)"),
        (Region(np.zeros(0, int), np.array([1]), 1.0), r"shape \(0,\) as rows, not an array of shape \(1,\)"),
        (Region(np.array([1]), np.array([2]), np.nan), "NaN as score"),
        ((1, 2), "a tuple as rows"),
    ],
)
def test_regions_of_detectors_are_looked_at(monkeypatch: pytest.MonkeyPatch, region: Any, said: str) -> None:
    view = SonarView(np.ones((9, 11)), np.arange(11.0), np.arange(9.0), np.ones(2), np.zeros((0, 4)))
    monkeypatch.setattr(ImagePeaks, "regions", lambda self, view: [region])
    with pytest.raises(WrongReturn, match=rf"image_peaks\.ImagePeaks\.regions returned .*{said}"):
        detections_of(view, ImagePeaks())


@pytest.mark.parametrize(
    ("matrix", "said"), [(np.eye(3), r"\(3, 3\), not .* \(2, 3, 3\)"), (np.full((2, 3, 3), np.nan), "NaN")]
)
def test_cross_spectra_of_noise_are_looked_at(monkeypatch: pytest.MonkeyPatch, matrix: Any, said: str) -> None:
    monkeypatch.setattr(FlatNoise, "cross_spectral_density", lambda self, frequency, position: matrix)
    with pytest.raises(WrongReturn, match=rf"FlatNoise\.cross_spectral_density returned .*{said}"):
        NoiseField.factors(FlatNoise(level=40.0), np.array([1e4, 2e4]), np.eye(3))
