"""Directions from delays: bias, errors and bounds against worked values (508 elements, pitch 49.53 mm, 1540 m/s)."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.spherical_wave import plane_wave, spherical_wave, wavefront_delays
from sonarsynth.ranging.location.locating import fit_pulse
from sonarsynth.receiver import Band, PlanarLattice, Romanis, Sonar, elements
from tests.heard import RATE, add_noise, hear_direct, pulse_spectrum

C = 1540.0
ARRAY = elements(Romanis())
Q = ARRAY.position


def test_the_aperture_has_its_published_moments():
    assert np.sum(Q[:, 1] ** 2) == pytest.approx(50.41614, abs=1e-5)
    assert np.sum(Q[:, 2] ** 2) == pytest.approx(50.41614, abs=1e-5)
    assert np.sum(Q[:, 1] * Q[:, 2]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("radius", "bias", "residual"),
    [(5.0, -1.93e-3, 7.4e-6), (10.0, -0.484e-3, 3.7e-6), (20.0, -0.121e-3, 1.9e-6), (50.0, -0.019e-3, 0.75e-6)],
)
def test_a_plane_through_a_sphere_is_biased(radius, bias, residual):
    u = direction(np.radians(25.0), 0.0)
    found, _ = plane_wave(wavefront_delays(Q, u, 1 / radius, C), Q, C)
    assert found[1] - u[1] == pytest.approx(bias, rel=0.025)
    straight = wavefront_delays(Q, direction(0.0, 0.0), 1 / radius, C)
    found, time = plane_wave(straight, Q, C)
    assert np.std(straight - time + Q @ found / C) == pytest.approx(residual, rel=0.02)
    assert found[1:] == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(("radius", "error"), [(5.0, 3.0e-3), (10.0, 1.2e-2), (20.0, 4.8e-2), (50.0, 0.30)])
def test_range_from_curvature_alone(radius, error):
    u = direction(0.0, 0.0)
    wave = spherical_wave(wavefront_delays(Q, u, 1 / radius, C), Q, C, np.ones(len(Q)), u)
    assert wave is not None
    assert 1 / wave.curvature == pytest.approx(radius, rel=1e-10)
    assert 0.1e-6 * np.sqrt(wave.covariance[2, 2]) * radius**2 == pytest.approx(error, rel=0.03)


def test_the_fisher_matrix_of_a_position_is_the_same_in_other_coordinates():
    source = np.array([9.0, -5.0, -6.0])
    g = (source - Q) / (C * np.linalg.norm(source - Q, axis=1, keepdims=True))
    fisher = g.T @ g - np.outer(g.sum(axis=0), g.sum(axis=0)) / len(Q)
    r = np.linalg.norm(source)
    wave = spherical_wave(wavefront_delays(Q, source / r, 1 / r, C), Q, C, np.ones(len(Q)), source / r)
    assert wave is not None
    jacobian = np.column_stack([*(wave.tangents * r), -wave.direction * r**2])
    assert np.allclose(jacobian @ wave.covariance[:3, :3] @ jacobian.T, np.linalg.inv(fisher), rtol=1e-6)


@pytest.mark.parametrize("decibels", [20.0, 30.0])
def test_directions_reach_the_bound(decibels):
    """Ratio to the Cramer-Rao bound 0.9 to 1.2, delays and all; point sensors, white noise in every sample."""
    array = elements(PlanarLattice(columns=10, rows=10, pitch=0.1, face=0.0))
    sonar = Sonar(band=Band(low=22e3, high=88e3), assumed_sound_speed=C, sampling_frequency=RATE)
    source = 300.0 * direction(0.3, -0.2)
    clean = hear_direct(array, source, C)
    f = np.linspace(22e3, 88e3, 4001)
    pulse = pulse_spectrum(f) / 300.0
    energy = 2 * np.trapezoid(np.abs(pulse) ** 2, f)  # both signs of frequency
    noise = np.sqrt(2 * energy / 10 ** (decibels / 10) * RATE / 2)  # d2 = 2E/N0, N0 = 2 variance/rate
    bandwidth = np.sqrt(f**2 @ np.abs(pulse) ** 2 / np.sum(np.abs(pulse) ** 2))
    timing = 1 / (2 * np.pi * bandwidth * 10 ** (decibels / 20))  # Van Trees (2002), section 8.2
    bound = C * timing / np.sqrt(np.sum(array.position[:, 1] ** 2))
    random = np.random.default_rng(4)
    errors, predicted = [], []
    for _ in range(150):
        noisy = add_noise(clean, noise, random)
        found = fit_pulse(noisy, array, sonar, 300.0 / C, array.aperture / C + 3.2e-4, np.zeros((1, 3)), np.inf)
        assert not isinstance(found, int)
        errors.append(found[0].direction[1:] - source[1:] / 300.0)
        predicted.append(found[0].time)
    ratio = np.sqrt(np.mean(np.square(errors))) / bound
    assert 0.9 < ratio < 1.2
