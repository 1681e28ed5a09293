"""Directions for any geometry: found again, and turning with the frame."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.spherical_wave import plane_wave, spherical_wave, tangent_plane, wavefront_delays
from sonarsynth.geometry import rotation_matrix, unit

angles = st.floats(-1.4, 1.4)
turns = st.floats(-3.1, 3.1)


def array_in_space(seed):
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (12, 3))


@given(turns, angles, st.floats(0.0, 0.6), st.integers(0, 9), st.floats(-1.0, 1.0))
def test_a_wave_over_an_array_in_space_is_found_from_any_side(az, el, curvature, seed, time):
    """Three dimensions of sensors: no front-back ambiguity, no start needed but the plane wave's."""
    q, u = array_in_space(seed), direction(az, el)
    delay = time + wavefront_delays(q, u, curvature, 1500.0)
    plane, _ = plane_wave(delay, q, 1500.0)
    wave = spherical_wave(delay, q, 1500.0, np.ones(len(q)), plane)
    assert wave is not None
    assert np.linalg.norm(wave.direction - u) < 1e-7
    assert abs(wave.curvature - curvature) < 1e-6
    assert abs(wave.time - time) < 1e-11


@given(st.floats(-7.0, -3.0), angles, st.floats(0.0, 0.6), st.integers(0, 99), st.integers(1, 4))
def test_a_step_from_a_wave_along_the_plane_of_an_array_stays_at_its_delays(aside, el, curvature, seed, steps):
    """Of 1 ns of noise: on which side of the plane a wave comes from is in its delays to the second order only."""
    random, u = np.random.default_rng(seed), unit(np.array([10.0**aside, np.cos(el), np.sin(el)]))
    q = random.uniform(-0.5, 0.5, (40, 3)) * [0.0, 1.0, 1.0]
    delay = wavefront_delays(q, u, curvature, 1500.0)
    wave = spherical_wave(delay + 1e-9 * random.normal(size=40), q, 1500.0, np.ones(40), u, curvature, steps)
    assert wave is not None
    off = wave.time + wavefront_delays(q, wave.direction, wave.curvature, 1500.0) - delay
    assert np.abs(off).max() < 1e-8


@given(turns, angles, st.floats(0.0, 0.3), st.integers(0, 9), st.tuples(*[st.floats(-1, 1)] * 4))
def test_delays_turn_with_the_frame(az, el, curvature, seed, quaternion):
    assume(np.linalg.norm(quaternion) > 0.1)
    turn = rotation_matrix(unit(quaternion))
    q, u = array_in_space(seed), direction(az, el)
    here, there = wavefront_delays(q, u, curvature, 1500.0), wavefront_delays(q @ turn.T, turn @ u, curvature, 1500.0)
    assert np.allclose(here, there, atol=1e-17)


@given(turns, angles)
def test_tangents_are_square_to_the_direction(az, el):
    u = direction(az, el)
    frame = np.vstack([u, tangent_plane(u)])
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    step = 1e-6
    assert np.allclose(
        (direction(az, el + step) - direction(az, el - step)) / (2 * step), tangent_plane(u)[1], atol=1e-9
    )


@given(turns, angles, st.integers(0, 9), st.floats(1e-7, 1e-1))
def test_delays_are_differences_of_distances(az, el, seed, curvature):
    q, u = array_in_space(seed), direction(az, el)
    distances = np.linalg.norm(u / curvature - q, axis=1) - 1 / curvature
    assert np.allclose(wavefront_delays(q, u, curvature, 1.0), distances, atol=4e-16 / curvature)
