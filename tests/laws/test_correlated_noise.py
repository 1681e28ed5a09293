"""Noise that is not independent between hydrophones: what is drawn has the cross spectral density that is stated."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
import pytest

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.description import description
from sonarsynth.environment.noise import FlatNoise, NoiseField
from sonarsynth.equations.noise.filters import response
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver import PlanarLattice, Sonar, elements
from sonarsynth.signals import add_noise
from sonarsynth.signals.filtered_pulse import fir

PAGE = (Path(__file__).resolve().parents[2] / "tools" / "docs" / "how-to" / "extending.md").read_text()
SONAR = Sonar()
ARRAY = elements(PlanarLattice(columns=3, rows=2, pitch=0.007))
DRAWS, SAMPLES = 600, 256


def isotropic() -> NoiseField:
    """The noise of the page on extending."""
    (text,) = re.findall(r"^```python file=environment/noise/isotropic_noise.py\n(.*?)^```", PAGE, re.S | re.M)
    module = sys.modules["isotropic_noise"] = ModuleType("isotropic_noise")
    exec(compile(text, "extending.md", "exec"), vars(module))
    found: NoiseField = module.IsotropicNoise(level=120.0)
    del sys.modules["isotropic_noise"]
    return found


@description
class Matrix(NoiseField):
    """Flat noise that is independent between hydrophones, but says so by a matrix."""

    kind: Literal["matrix"] = "matrix"

    def density(self, frequency: Floats) -> Floats:
        return np.ones(frequency.shape)

    def cross_spectral_density(self, frequency: Floats, position: Floats) -> Floats:
        return np.ones((len(frequency), 1, 1)) * np.eye(len(position))


@description
class PlaneWave(NoiseField):
    """A distant ship: one plane wave along x of the world, by its one factor."""

    kind: Literal["plane_wave"] = "plane_wave"

    def density(self, frequency: Floats) -> Floats:
        return np.ones(frequency.shape)

    def factors(self, frequency: Floats, position: Floats) -> Complexes:
        return np.exp(-2j * np.pi * frequency[:, None] * position[:, 0] / 1500.0)[..., None]


@description
class Impossible(Matrix):
    """Two hydrophones that hear more of each other than of themselves."""

    kind: Literal["impossible"] = "impossible"  # type: ignore[assignment]

    def cross_spectral_density(self, frequency: Floats, position: Floats) -> Floats:
        return np.ones((len(frequency), 1, 1)) * (2.0 - np.eye(len(position)))


def spectra(noise: NoiseField, pose: Pose | None = None) -> tuple[Floats, Complexes]:
    """Frequencies (bin,) in the band, and spectra (draw, sensor, bin) in which noise of 1 Pa2/Hz has a power of 1."""
    quiet = Signals(np.zeros((ARRAY.count, SAMPLES), np.float32), 0.0, SONAR.sampling_frequency, 0.0, 0, 0)
    taper = np.hanning(SAMPLES)
    f = np.fft.rfftfreq(SAMPLES, 1.0 / SONAR.sampling_frequency)
    inside = (f > 35e3) & (f < 75e3)
    scale = response(f[inside], fir(SONAR.antialias)) * np.sqrt(0.5 * SONAR.sampling_frequency * np.sum(taper**2))
    found = [
        np.fft.rfft(add_noise(quiet, noise, SONAR, ARRAY, stream(7, "draw", n), pose).pressure * taper)[:, inside]
        for n in range(DRAWS)
    ]
    return f[inside], np.array(found) / scale


@pytest.mark.parametrize("which", ["isotropic", "plane wave"])
def test_the_covariance_of_what_is_drawn_is_the_cross_spectral_density(which: str) -> None:
    noise, pose = (
        (isotropic(), None)
        if which == "isotropic"
        else (PlaneWave(), Pose(np.array([3.0, 1.0, -5.0]), quaternion(0.7)))
    )
    f, x = spectra(noise, pose)
    measured = np.einsum("dqf,drf->fqr", x, x.conj()) / DRAWS
    position = ARRAY.position if pose is None else pose.to_world(ARRAY.position)
    factors: Any = noise.factors(f, position)
    stated = factors @ np.conj(np.swapaxes(factors, 1, 2))
    power = noise.density(f)[:, None, None]
    error = (measured - stated) / power
    assert np.sqrt(np.mean(np.abs(error) ** 2)) < 1.5 / np.sqrt(DRAWS)
    assert np.abs(error.mean(axis=0)).max() < 0.05  # over the band: a bias would stay
    assert np.abs(stated / power - np.eye(ARRAY.count)).max() > 0.5, "or the law says nothing"


def test_a_matrix_on_the_diagonal_sounds_as_its_density() -> None:
    _, of_matrix = spectra(Matrix())
    _, of_density = spectra(FlatNoise(level=120.0))
    for x in (of_matrix, of_density):
        power = (np.abs(x) ** 2).mean(axis=0)
        assert power.mean() == pytest.approx(1.0, abs=0.02)
        assert (np.abs(x) ** 4).mean() == pytest.approx(2.0, abs=0.1), "Gaussian: the power is exponential"
        across = np.einsum("dqf,drf->qr", x, x.conj()) / x[:, 0].size
        assert np.abs(across - np.eye(len(across))).max() < 0.05
    assert Matrix().correlated and not FlatNoise(level=120.0).correlated


def test_near_hydrophones_hear_the_same_and_their_singular_matrix_is_no_trouble() -> None:
    near = elements(PlanarLattice(columns=16, rows=16, pitch=1e-7))
    factors: Any = isotropic().factors(np.array([30e3, 80e3]), near.position)
    assert np.isfinite(factors).all()
    np.testing.assert_allclose(factors @ np.swapaxes(factors, 1, 2), np.ones((2, 256, 256)), atol=1e-6)


def test_a_matrix_that_no_noise_has_is_refused() -> None:
    with pytest.raises(ValueError, match=r"impossible noise: its cross spectral density is not that of any noise"):
        Impossible().factors(np.array([50e3]), ARRAY.position)
