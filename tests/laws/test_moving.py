"""Moving targets and arrays: against times solved point by point on the moving world."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.acoustics.arrays import aperture_terms
from sonarsynth.tracing.moving import Moving
from tests.laws.test_traced_families import ARRAY, ONE, ROMANIS, SONAR, SOURCE, C, ball, images, run


def heard(emitted: float, centre, v, u, source, array) -> float:
    """When sound emitted at a time from a source (image) is heard by an array (image), by iteration."""
    met = emitted
    for _ in range(100):
        met = emitted + np.linalg.norm(centre + v * met - source) / C
    at = met
    for _ in range(100):
        at = met + np.linalg.norm(centre + v * met - (array + u * at)) / C
    return at


@pytest.mark.parametrize("v", [(0.0, 0.0, 0.0), (1.4, 0.0, 0.0), (-3.0, 2.0, 0.5), (0.0, -1.4, 0.0)])
@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (2.0, -1.0, 0.3)])
def test_delays_and_stretches_of_echoes(v, u) -> None:
    v, u = np.array(v), np.array(u)
    body = ball()
    found = run(bodies=(body,), bounces=1, moving=Moving(v[None, :], u))
    centre = body.pose.to_world(body.mesh.centroid)
    seen = set()
    for i in np.flatnonzero(~found.direct)[:400]:
        options = []
        for source, s1, b1 in images(SOURCE, 1):
            for array, s2, b2 in images(ARRAY, 1):
                if (s1 + s2, b1 + b2) == (found.surface[i], found.bottom[i]) and (s2 > 0) + 2 * (
                    b2 > 0
                ) == found.arrives_by[i]:
                    flip = np.array([1.0, 1.0, -1.0 if s2 + b2 else 1.0])
                    at, later = (heard(t, centre[found.facet[i]], v, flip * u, source, array) for t in (0.0, 1e-3))
                    options.append((at, (later - at) / 1e-3 - 1.0))
        at, stretch = min(options, key=lambda o: abs(o[0] - found.delay[i]))
        fast = np.linalg.norm(v) + np.linalg.norm(u)
        assert found.delay[i] == pytest.approx(at, abs=2e-12)
        assert found.stretch[i] == pytest.approx(stretch, abs=2e-9 + 3e-6 * (fast > 0) * fast)
        seen.add((found.surface[i], found.bottom[i]))
    assert len(seen) == 3


@pytest.mark.parametrize("time", [0.05, -0.05, 1.0])
def test_times_are_exact_long_after_and_before_the_instant_of_the_frame(time: float) -> None:
    """A target that has passed a metre and more by then; to the sound speed over the speed, cubed, of that."""
    v, u = np.array([-3.0, 2.0, 0.5]), np.array([1.0, -0.5, 0.1])
    body = ball()
    found = run(bodies=(body,), bounces=0, moving=Moving(v[None, :], u), time=time)
    centre = body.pose.to_world(body.mesh.centroid)
    for i in np.flatnonzero(~found.direct)[::20]:
        assert found.delay[i] == pytest.approx(heard(time, centre[found.facet[i]], v, u, SOURCE, ARRAY), abs=1e-10)
    direct = heard(time, SOURCE, np.zeros(3), u, SOURCE, ARRAY)  # met where it is emitted
    assert found.delay[found.direct] == pytest.approx(direct, abs=1e-10)


def test_still_things_change_nothing_and_a_receding_target_stretches_the_pulse() -> None:
    a, b = run(bounces=1), run(bounces=1, moving=Moving(np.zeros((1, 3)), np.zeros(3)))
    assert all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ("delay", "direction", "radius", "stretch"))
    away = run(
        bodies=(ball((15.0, 0.0, -5.0)),), bounces=0, array=ONE, moving=Moving(np.array([[2.0, 0.0, 0.0]]), np.zeros(3))
    )
    echoes = away.stretch[~away.direct]
    assert (echoes > 0).all() and echoes.max() < 2 * 2.0 / C * 1.01
    assert away.stretch[away.direct] == pytest.approx(0.0, abs=0)


def test_an_echo_comes_from_where_the_target_is_when_the_sound_meets_it() -> None:
    v = np.array([0.0, 30.0, 0.0])
    found = run(bounces=0, moving=Moving(v[None, :], np.zeros(3)))
    still = run(bounces=0)
    met = np.linalg.norm(still.point - SOURCE, axis=1) / C
    echo = ~found.direct
    expected = (still.radius[:, None] * still.direction)[echo] + np.outer(met[echo], [0.0, 30.0, 0.0])
    np.testing.assert_allclose((found.radius[:, None] * found.direction)[echo], expected, atol=30.0**2 * 2e-5)


def test_a_moving_array_meets_the_wavefront_at_every_sensor_when_it_is_there() -> None:
    u, q = np.array([1.5, -0.5, 0.2]), ROMANIS.position
    found = run(bodies=(), bounces=1, array=ROMANIS, moving=Moving(np.zeros((0, 3)), u))
    far = np.linalg.norm(found.radius[:, None, None] * found.direction[:, None, :] - q, axis=-1)
    terms = found.delay_terms @ aperture_terms(q, ROMANIS.aperture).T
    late = found.delay[:, None] + (far - found.radius[:, None]) / found.sound_speed + terms
    places = {(s, b): source for source, s, b in images(SOURCE, 1)}
    for i in range(len(late)):
        source = places[found.surface[i], found.bottom[i]]
        at = late[i].copy()
        for _ in range(50):
            at = np.linalg.norm(SONAR.to_world(q) + u * at[:, None] - source, axis=1) / C
        assert abs(late[i] - at).max() < 2e-8  # second order; without the linear terms it is 3e-7


def test_an_echo_spreads_from_where_the_target_is_when_the_sound_meets_it() -> None:
    """1/r of the way from there to the array, and the amplitude with it."""
    v = np.array([-3.0, 20.0, 0.5])
    found, still = (run(bounces=0, moving=moving) for moving in (Moving(v[None, :], np.zeros(3)), None))
    echo = ~found.direct
    met = np.linalg.norm(still.point - SOURCE, axis=1) / C  # to v/c of it
    from_there = np.linalg.norm(found.point + np.outer(met, v) - ARRAY, axis=1)
    np.testing.assert_allclose(found.spreading_in[echo], 1.0 / from_there[echo], rtol=1e-3 * 20.0 / C)
    assert np.abs(found.spreading_in / still.spreading_in - 1.0)[echo].max() > 5e-4
    ratio = found.amplitude / still.amplitude
    np.testing.assert_allclose(ratio[echo], (found.spreading_in / still.spreading_in)[echo], rtol=1e-12)
    np.testing.assert_allclose(ratio[~echo], 1.0, rtol=0.0)
