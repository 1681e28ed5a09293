"""Sources that move, that are not alike in all directions, and that are only heard: against slow sums by themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Track
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import LowPass, PositionTable, Sonar, elements
from sonarsynth.scattering import Isotropic
from sonarsynth.signals import DirectSum
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.snap_models import Gabor
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball

C, RATE, STILL = 1500.0, 400e3, np.zeros(3)
WATER = Medium(
    Environment(depth=200.0, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none")),
    Profile(np.array([0.0]), np.array([C])),
)
TONE = Gabor(frequency=50e3, cycles=20.0)
SONAR = Sonar(sampling_frequency=RATE, filter=LowPass(cutoff=150e3))
ARRAY = elements(PositionTable(positions=((0.0, -0.4, 0.0), (0.0, 0.4, 0.1), (0.0, 0.0, -0.3))))
POSE = Pose(np.array([0.0, 0.0, -100.0]), quaternion(0.5 * np.pi))
SOURCE, PLACE = np.array([3.0, 6.0, -103.0]), np.array([12.0, -1.0, -99.0])


def traced(snap: Emission, sonar: Floats = STILL) -> Arrivals:
    receiver = Receiver(POSE, ARRAY, SONAR, Track(POSE, sonar))
    laws, none = (Isotropic(strength=1.0),), Tolerances(negligible=0.0)
    return trace(
        FrameContext(0.0, (ball(PLACE, 0.05, subdivisions=1),), (snap,), WATER, receiver, laws, none),
        AutoTracing(bounces=0),
    )


def heard(found: Arrivals, snap: Emission, start: float, samples: int) -> Floats:
    return np.asarray(
        DirectSum().signals(found, (snap,), Reception(ARRAY, SONAR, None, start, samples)).pressure, float
    )


def tone(time: Floats) -> Floats:
    """The pulse at 1 m, at times (...) s, in closed form."""
    deviation = TONE.cycles / TONE.frequency / np.sqrt(8.0 * np.log(2.0))
    return np.asarray(np.cos(2.0 * np.pi * TONE.frequency * time) * np.exp(-0.5 * (time / deviation) ** 2))


def emitted(snap: Emission, end: Floats, time: Floats) -> tuple[Floats, Floats]:
    """When what is at `end` (xyz) at times (sample,) was emitted, and how far away the source was then, by the root of
    t' + |end - x(t')|/c = t."""
    sent = time.copy()
    for _ in range(30):
        away = np.linalg.norm(end - snap.position - (sent - snap.time)[:, None] * snap.velocity, axis=1)
        sent = time - away / C
    return sent, away


def seen_from_another_side(snap: Emission, place: Floats) -> float:
    """Error, over the peak, of the Doppler of the array centre in place of that at a hydrophone: the phase that the
    pulse turns by, where its envelope times the time from its middle is largest."""
    sides = np.array([place - snap.position, POSE.position - snap.position])
    change = snap.velocity @ (sides / np.linalg.norm(sides, axis=1)[:, None]).T @ [1.0, -1.0] / C
    deviation = TONE.cycles / TONE.frequency / np.sqrt(8.0 * np.log(2.0))
    return float(2.0 * np.pi * TONE.frequency * abs(change) * deviation * np.exp(-0.5))


@pytest.mark.parametrize("velocity", [(25.0, 0.0, 0.0), (-8.0, -20.0, 5.0)])
def test_a_source_that_moves_is_heard_as_its_retarded_time_says(velocity: tuple[float, float, float]) -> None:
    snap = Emission(SOURCE, 0.0, TONE, None, velocity=np.array(velocity))
    found = traced(snap)
    for some, by_target in ((found.select(found.direct), False), (found.select(~found.direct), True)):
        start, samples = float(some.delay.min()) - 1.5e-3, 1200
        time = start + np.arange(samples) / RATE
        ours = heard(some, snap, start, samples)
        resting = heard(replace(some, doppler=0.0 * some.doppler), snap, start, samples)
        for sensor, place in enumerate(POSE.to_world(ARRAY.position)):
            truth, left_out = np.zeros(samples), 0.0
            if by_target:
                for row in range(len(some.delay)):
                    back = np.linalg.norm(place - some.point[row])
                    sent, away = emitted(snap, some.point[row], time - back / C)
                    truth += some.scattering[row] * tone(sent) / (away * back)
            else:
                sent, away = emitted(snap, place, time)
                truth, left_out = tone(sent) / away, seen_from_another_side(snap, place)
            most = np.abs(truth).max()
            assert np.abs(ours[sensor] - truth).max() / most == pytest.approx(left_out, abs=1e-3)
            assert np.abs(resting[sensor] - truth).max() > 0.1 * most


@dataclass(frozen=True)
class Dipole:
    """Louder along an axis, and of opposite sign behind it."""

    axis: tuple[float, float, float]

    def __call__(self, direction: Floats) -> Floats:
        return np.asarray(direction @ np.array(self.axis))


def test_the_directivity_is_that_of_the_direction_in_which_each_path_leaves() -> None:
    plain = Emission(SOURCE, 0.0, TONE, None)
    dipole = replace(plain, directivity=Dipole((-0.8, 0.6, 0.0)))
    every, some = traced(plain), traced(dipole)
    start, samples = float(every.delay.min()) - 1e-3, 1024

    def towards(end: Floats) -> Floats:
        away = end - SOURCE
        return np.asarray(away @ np.array([-0.8, 0.6, 0.0]) / np.linalg.norm(away, axis=-1))

    hydrophones = POSE.to_world(ARRAY.position)
    expected = heard(every.select(every.direct), plain, start, samples) * towards(hydrophones)[:, None]
    got = heard(some.select(some.direct), dipole, start, samples)
    np.testing.assert_allclose(got, expected, atol=2e-4 * np.abs(expected).max())
    assert (towards(hydrophones) < 0.0).all() and np.ptp(towards(hydrophones)) > 0.05
    echoes, weighed = every.select(~every.direct), some.select(~some.direct)
    np.testing.assert_array_equal(echoes.facet, weighed.facet)
    np.testing.assert_allclose(weighed.amplitude, echoes.amplitude * towards(echoes.point), rtol=1e-12)


def test_a_source_that_does_not_illuminate_is_heard_directly_alone() -> None:
    plain = Emission(SOURCE, 0.0, TONE, None)
    every, alone = traced(plain), traced(replace(plain, illuminates=False))
    assert not every.direct.all() and alone.direct.all()
    for name, value in every.select(every.direct).columns.items():
        np.testing.assert_array_equal(alone.columns[name], value, err_msg=name)


def test_a_source_that_moves_with_the_array_is_at_rest_for_it() -> None:
    """The direct pulse of what the array tows comes at another time, but is not stretched."""
    velocity = np.array([12.0, 9.0, 0.0])
    found = traced(Emission(SOURCE, 0.0, TONE, None, velocity=velocity), velocity)
    assert found.doppler[found.direct] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(found.doppler[~found.direct]).min() > 1e-3
