"""Scattering strengths of bottom and surface against the published ones, and what no law may break."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.reverberation.bottom_strength import GRAIN_SIZE, Angles, lambert, sediment
from sonarsynth.equations.reverberation.surface_strength import facets
from sonarsynth.scattering.boundaries import BoundarySite, RoughSediment, StrengthTable, WindySurface

WAVENUMBER = 2.0 * np.pi * 50e3 / 1528.0
GRAZING = np.deg2rad([5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0])
PUBLISHED = {  # dB at 50 kHz, of the closed forms of APL-UW TR 9407 computed by another program from the text alone
    "sandy gravel": (-38.4, -28.3, -21.0, -18.1, -16.5, -14.2, -9.7),
    "coarse sand": (-41.8, -31.6, -24.2, -21.1, -20.2, -17.6, -6.7),
    "medium sand": (-45.7, -35.2, -27.1, -23.6, -22.5, -20.4, -5.7),
    "fine sand": (-48.8, -37.9, -28.8, -24.9, -23.9, -22.7, -6.3),
    "very fine sand": (-46.0, -35.4, -26.9, -25.7, -24.5, -23.6, -6.4),
    "coarse silt": (-40.4, -32.0, -27.8, -26.4, -25.0, -24.1, -5.1),
    "medium silt": (-41.3, -35.6, -31.7, -29.9, -28.3, -27.4, -6.1),
}


def back(grazing: np.ndarray) -> Angles:
    """Towards where it came from."""
    return Angles(np.sin(grazing), np.sin(grazing), np.full(np.shape(grazing), -1.0))


def any_angles(count: int = 200) -> Angles:
    """Pairs of directions, at random."""
    draw = np.random.default_rng(5)
    return Angles(*(draw.uniform(0.0, 1.0, count) for _ in range(2)), np.cos(draw.uniform(0.0, np.pi, count)))


def albedo(strength: np.ndarray, sine_out: np.ndarray, solid_angle: np.ndarray, sine_in: float) -> float:
    """Share of the power that arrives at this sine of grazing which is scattered: int sigma dOmega/sin q_i."""
    return float(np.sum(np.where(sine_out > 0.0, strength, 0.0) * solid_angle) / sine_in)


def hemisphere(zeniths: int = 160, azimuths: int = 160) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sines of grazing angles, cosines of azimuths and weights (sr) of directions: denser near grazing and forward."""
    (x, wx), (t, wt) = (np.polynomial.legendre.leggauss(n) for n in (zeniths, azimuths))
    x, t = 0.5 * (x + 1.0), 0.5 * (t + 1.0)
    s, f = (a.ravel() for a in np.meshgrid(x**2, np.cos(np.pi * t**2)))
    return s, f, np.outer(2.0 * np.pi * t * wt, x * wx).ravel()


@pytest.mark.parametrize("name", PUBLISHED)
def test_backscattering_of_sediments_is_the_published_one(name: str) -> None:
    found = 10.0 * np.log10(sediment(back(GRAZING), WAVENUMBER, name))
    assert np.abs(found - PUBLISHED[name]).max() < 0.6


def test_roughness_scatters_less_the_longer_the_wave_down_to_none(recwarn: pytest.WarningsRecorder) -> None:
    """Aside of the mirror direction as k^(4 - 3.25); a band that begins at 1e-297 Hz divided by zero."""
    angles = back(GRAZING[:1])
    volume = sediment(angles, 1e-290, "sandy gravel")
    rough = [float((sediment(angles, k, "sandy gravel") - volume)[0]) for k in (1e-3, 1e-2, 1e-1)]
    assert np.log10(rough[1] / rough[0]) == pytest.approx(0.75, abs=0.01)
    assert np.log10(rough[2] / rough[1]) == pytest.approx(0.75, abs=0.01)
    assert np.isfinite(volume).all() and not recwarn.list


def test_sediment_between_two_directions_is_the_published_one() -> None:
    sine = np.full(5, np.sin(np.deg2rad(20.0)))
    angles = Angles(sine, sine, np.cos(np.deg2rad([0.0, 45.0, 90.0, 135.0, 180.0])))
    found = 10.0 * np.log10(sediment(angles, WAVENUMBER, "medium sand"))
    assert np.abs(found - (7.92, -24.72, -26.94, -27.13, -27.12)).max() < 0.3


@pytest.mark.parametrize(
    ("wind", "published"),
    [
        (3.0, (-47.5, -47.5, -47.4, -46.6, -34.3, -1.8)),
        (5.0, (-38.3, -38.2, -38.1, -38.0, -31.3, -0.4)),
        (10.0, (-33.0, -29.7, -24.9, -22.2, -18.9, 0.5)),
    ],
)
def test_backscattering_of_the_surface_is_the_published_one(wind: float, published: tuple[float, ...]) -> None:
    site = BoundarySite(50e3, WAVENUMBER, np.ones_like, wind, rms_height=1.0)  # all of the facets' power is incoherent
    found = 10.0 * np.log10(WindySurface().strength(back(np.deg2rad([5.0, 10.0, 20.0, 30.0, 60.0, 80.0])), site))
    assert np.abs(found - published).max() < 0.3


@pytest.mark.parametrize("name", GRAIN_SIZE)
def test_a_sediment_is_reciprocal_and_gives_back_less_than_arrives(name: str) -> None:
    angles = any_angles()
    swapped = Angles(angles.sine_out, angles.sine_in, angles.forward)
    there, and_back = (sediment(one, WAVENUMBER, name) for one in (angles, swapped))
    assert np.allclose(there, and_back, rtol=1e-12) and (there >= 0.0).all() and np.isfinite(there).all()
    sine, forward, weight = hemisphere()
    for grazing in np.deg2rad([3.0, 10.0, 30.0, 60.0]):
        out = sediment(Angles(np.full(sine.size, np.sin(grazing)), sine, forward), WAVENUMBER, name)
        assert 0.0 < albedo(out, sine, weight, float(np.sin(grazing))) < 1.0


def test_lambert_gives_back_pi_mu() -> None:
    sine, forward, weight = hemisphere()
    out = lambert(Angles(np.full(sine.size, 0.3), sine, forward), 0.1)
    assert albedo(out, sine, weight, 0.3) == pytest.approx(0.1 * np.pi, rel=1e-6)


@pytest.mark.parametrize("grazing", [0.0, 10.0, 90.0])
def test_a_table_gives_back_no_more_than_arrives(grazing: float) -> None:
    """Integrated here in all directions: the strongest table that is taken gives back all."""

    def table(level: float) -> StrengthTable:
        return StrengthTable(grazing=(np.deg2rad(grazing),), strength_db=(level,))

    sine, forward, weight = hemisphere()
    site, given = BoundarySite(50e3, WAVENUMBER, np.ones_like), np.sin(np.deg2rad(max(grazing, 1.0)))
    low, high = -60.0, 10.0
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        try:
            strength = table(middle).strength(Angles(np.full(sine.size, given), sine, forward), site)
            share, low = albedo(strength, sine, weight, float(given)), middle
        except ValueError as refused:
            assert "what arrives at a grazing angle of" in str(refused)
            high = middle
    assert share == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("height", [None, 0.0, 0.2e-3, 1e-3, 3e-3, 1.0])
@pytest.mark.parametrize("wind", [0.0, 1.0, 3.0, 5.0, 20.0])
def test_facets_and_coherent_reflection_give_back_all_and_never_more(wind: float, height: float | None) -> None:
    """Eckart's coherent power and the albedo of facets, at any grazing angle: none of a smooth sea, all of waves far
    higher than the wavelength. height: rms in m; none: that of the wind. Waves that hide each other keep some."""
    sine, forward, weight = hemisphere()
    height = 0.00533 * wind**2 if height is None else height  # Pierson and Moskowitz
    for grazing in (0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 45.0, 80.0):
        down = float(np.sin(np.deg2rad(grazing)))
        coherent = np.exp(-((2.0 * WAVENUMBER * height * down) ** 2))
        angles = Angles(np.full(sine.size, down), sine, forward)
        whole = coherent + albedo(facets(angles, WAVENUMBER, wind, height), sine, weight, down)
        assert (0.91 if grazing >= 45.0 else 0.84) < whole < 1.01, grazing


def test_rock_is_refused() -> None:
    with pytest.raises(ValueError, match="'rock' has no law; known"):
        RoughSediment(name="rock")
