"""Cancelling reflections: what is loud and from outside the view goes, echoes and all else stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays.ray_solutions import eigenrays, water
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Track
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.pipeline import beamform_frame, trace_frame
from sonarsynth.planning import plan
from sonarsynth.propagation import AutoTracing
from sonarsynth.ranging import SensorDelays, WavefrontCancelling
from sonarsynth.ranging.cancelling.multipath import (
    CANCELLED,
    DIRECT,
    FAINT,
    OUTSIDE,
    SEEN,
    WEAK,
    Limits,
    cancel,
    in_view,
)
from sonarsynth.ranging.location.candidates import images
from sonarsynth.receiver import BeamGrid, Romanis, Sonar, elements
from sonarsynth.recipe.scene import EchoWindow, Physics, Processing
from sonarsynth.state import Receiver, Survey
from tests.heard import add_noise, cloud_of, hear, silence
from tests.scenes import remus

C = 1540.0
ARRAY = elements(Romanis())
SONAR = Sonar(assumed_sound_speed=C)
WATER = Profile(np.array([0.0]), np.array([C]))
BOTTOM_DEPTH = 10.0
POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(np.pi / 2))
SNAP = np.array([14.0, -5.0, -5.0])
BELOW = np.array([14.0, -5.0, -25.0])  # by the surface, then the bottom
DELAY = np.linalg.norm(BELOW) / C
TARGET = np.array([18.0, 2.0, 1.0])
LIMITS = Limits(bounces=2, search=0.03, excess=15.0, weakest=40.0)
START, SAMPLES = 0.0075, 3200
WINDOW = (0.0165, 0.0225)


def direct(snap=SNAP):
    return hear(silence(ARRAY, START, SAMPLES), ARRAY, snap, 0.0, 1.0)


def with_echo(signals, late=0.0, amplitude=0.01):
    """An echo whose pulse is at the array centre `late` s after the arrival from `BELOW`."""
    return hear(signals, ARRAY, TARGET, DELAY + late - np.linalg.norm(TARGET) / C, amplitude)


def with_arrival(signals, amplitude=0.3, image=BELOW):
    return hear(signals, ARRAY, image, 0.0, amplitude)


def locate(signals, pose=POSE, bottom_depth=BOTTOM_DEPTH):
    return SensorDelays().locate(signals, Receiver(pose, ARRAY, SONAR), Survey(bottom_depth, WATER), 1)


def cancelled(signals, estimates=None, sonar=SONAR, pose=POSE, bottom_depth=BOTTOM_DEPTH, window=WINDOW, limits=LIMITS):
    found = locate(signals, pose, bottom_depth) if estimates is None else estimates
    return cancel(signals, found, Receiver(pose, ARRAY, sonar), bottom_depth, window, limits)


def energy(pressure):
    return float(np.sum(np.asarray(pressure, float) ** 2))


def left(result, without, before):
    """dB of the energy that is left of what `without` lacks."""
    arrival = energy(before.pressure - without.pressure)
    return 10 * np.log10(energy(result.signals.pressure - without.pressure) / arrival)


def reasons(result):
    return {(o.expected.surface, o.expected.bottom): o.reason for o in result.outcomes}


@pytest.mark.parametrize(("late", "most"), [pytest.param(-0.8e-3, -45.0, marks=pytest.mark.long), (0.1e-3, -40.0)])
def test_the_arrival_goes_and_the_echo_stays(late, most):
    """The echo, 11 dB fainter at the sensors, keeps its energy and its delay, even at the same time."""
    clean = with_echo(direct(), late)
    heard = with_arrival(clean)
    estimates = locate(heard)
    result = cancelled(heard, estimates)
    assert left(result, clean, heard) < most
    beam = FocusedDelayAndSum()
    true, got = (beam.image(s, ARRAY, SONAR, *WINDOW) for s in (clean, result.signals))
    top = np.unravel_index(true.energy.argmax(), true.energy.shape)
    assert abs(10 * np.log10(got.energy[top] / true.energy[top])) < 0.05
    points = []
    for s, image in ((clean, true), (result.signals, got)):
        found = cloud_of(s, image, estimates, ARRAY, SONAR, POSE, WATER)
        at = np.argmin(np.hypot(found.azimuth - image.azimuth[top[1]], found.elevation - image.elevation[top[0]]))
        points.append(found.delay[at])
    assert abs(points[1] - points[0]) < 2e-8
    streaks = beam.image(heard, ARRAY, SONAR, *WINDOW).energy
    assert np.max(np.abs(got.energy - true.energy)) < 1e-3 * np.max(streaks - true.energy)


def test_only_what_is_about_the_arrival_changes():
    heard = with_arrival(with_echo(direct(), -0.8e-3))
    result = cancelled(heard)
    t = START + np.arange(SAMPLES) / heard.sampling_frequency
    when = DELAY + (np.linalg.norm(BELOW - ARRAY.position, axis=1) - np.linalg.norm(BELOW)) / C
    far = np.abs(t - when[:, None]) > 0.53e-3
    assert np.array_equal(result.signals.pressure[far], heard.pressure[far])
    assert replace(result.signals, pressure=heard.pressure).quantum == heard.quantum


@pytest.mark.parametrize("noise", [0.0, 1e-5])
@pytest.mark.parametrize("echo", [0.0, 0.3])
def test_without_an_arrival_nothing_changes(noise, echo):
    heard = with_echo(direct(), 0.05e-3, echo) if echo else direct()
    heard = add_noise(heard, noise, np.random.default_rng(3))
    result = cancelled(heard)
    assert result.signals is heard
    assert reasons(result)[1, 1] in {OUTSIDE, FAINT}
    known = Receiver(POSE, ARRAY, SONAR), Survey(BOTTOM_DEPTH, WATER)
    assert WavefrontCancelling().cancel(heard, locate(heard), *known, WINDOW) is heard


def test_nothing_heard_nothing_done():
    quiet = silence(ARRAY, START, SAMPLES)
    assert cancelled(quiet).signals is quiet
    hiss = add_noise(quiet, 1e-3, np.random.default_rng(1))
    pretended = locate(direct())  # a located snap whose arrivals are looked for where there is noise alone
    result = cancelled(hiss, pretended)
    assert result.signals is hiss
    assert all(o.excess < 8 for o in result.outcomes if np.isfinite(o.excess))


def test_what_is_in_view_is_left_alone():
    heard = with_arrival(with_echo(direct()))
    wide = Sonar(assumed_sound_speed=C, beams=BeamGrid(elevation_span=np.deg2rad(116), elevations=117))
    result = cancelled(heard, sonar=wide)  # 58 degrees: the arrival is less than a beam outside
    assert result.signals is heard
    assert SEEN in reasons(result).values()


@pytest.mark.parametrize(("elevation", "seen"), [(0.0, True), (26.0, True), (31.0, False), (-59.0, False)])
def test_a_planar_array_cannot_tell_front_from_back(elevation, seen):
    u = direction(np.deg2rad(10.0), np.deg2rad(elevation))
    assert in_view(u, ARRAY, SONAR) == in_view(u * [-1, 1, 1], ARRAY, SONAR) == seen


def test_a_direct_pulse_is_left_alone():
    """A reflection on its heels cannot be told from the tail of the clock."""
    snap = np.array([14.0, -5.0, -4.9])
    heard = direct(snap)
    result = cancelled(heard, window=(START + 1e-3, 0.02))
    assert result.signals is heard
    assert reasons(result)[0, 1] == DIRECT


def test_an_arrival_far_weaker_than_expected_is_another():
    heard = with_arrival(direct(), amplitude=0.02)
    assert reasons(cancelled(heard, limits=replace(LIMITS, weakest=30.0)))[1, 1] == WEAK
    assert reasons(cancelled(heard))[1, 1] == CANCELLED


@pytest.mark.parametrize("error", [-0.15, 0.2])
def test_the_depth_of_the_bed_may_be_wrong(error):
    """The prediction is off by a beam width, the fit is not."""
    clean = with_echo(direct(), -0.8e-3)
    heard = with_arrival(clean)
    result = cancelled(heard, bottom_depth=BOTTOM_DEPTH + error)
    assert left(result, clean, heard) < -45


@pytest.mark.parametrize("second", [0.3, -0.1])
def test_two_arrivals_at_once(second):
    """By surface from above and by both from below, within half a millisecond; each is fitted with the other gone."""
    pose = Pose(np.array([0.0, 0.0, -9.5]), quaternion(np.pi / 2))
    snap = np.array([14.0, -5.0, -0.5])
    above, below = np.array([14.0, -5.0, 19.5]), np.array([14.0, -5.0, -20.5])
    window = (0.0145, 0.019)
    clean = hear(direct(snap), ARRAY, TARGET, 0.0155 - np.linalg.norm(TARGET) / C, 0.005)
    one = with_arrival(clean, 0.3, above)
    heard = with_arrival(one, second, below)
    result = cancelled(heard, locate(clean, pose), pose=pose, window=window)
    assert reasons(result)[1, 0] == reasons(result)[1, 1] == CANCELLED
    assert left(result, clean, heard) < -33
    assert energy(result.signals.pressure) < energy(heard.pressure)


@pytest.mark.parametrize("seed", range(6))
def test_energy_never_rises(seed):
    """Whatever else is heard: echoes as loud as the arrival, noise, an arrival from another place or of other size."""
    random = np.random.default_rng(seed)
    heard = direct()
    for _ in range(3):
        u = direction(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4))
        r = random.uniform(18, 22)
        late = DELAY + random.uniform(-4e-4, 4e-4) - r / C
        heard = hear(heard, ARRAY, r * u, late, random.choice([0.003, 0.03, 0.3]))
    shifted = BELOW + random.normal(0, 0.3, 3)
    heard = add_noise(with_arrival(heard, random.choice([0.05, 0.5]), shifted), 1e-5, random)
    result = cancelled(heard, locate(direct()), limits=replace(LIMITS, bounces=4))
    assert energy(result.signals.pressure) <= energy(heard.pressure)


def test_counts_of_a_converter_do_not_hinder():
    quantum = 2e-4  # 130 counts at the peak of the arrival
    clean, heard = with_echo(direct(), -0.8e-3), with_arrival(with_echo(direct(), -0.8e-3))
    counted = replace(heard, pressure=(np.rint(heard.pressure / quantum) * quantum).astype(np.float32), quantum=quantum)
    result = cancelled(counted)
    rounding = energy(counted.pressure - heard.pressure)
    assert result.signals.quantum == quantum
    assert energy(result.signals.pressure - clean.pressure) < 1.1 * rounding + 3e-4 * energy(
        heard.pressure - clean.pressure
    )


def test_dead_sensors_and_small_arrays():
    """A dead sensor counts for nothing and stays as it is; a few sensors cannot average echoes away."""
    heard = with_arrival(direct())
    patchy = elements(Romanis(dead=tuple(range(0, 508, 7))))
    result = cancel(heard, locate(heard), Receiver(POSE, patchy, SONAR), BOTTOM_DEPTH, WINDOW, LIMITS)
    live = patchy.gain != 0
    assert np.array_equal(result.signals.pressure[~live], heard.pressure[~live])
    assert energy(result.signals.pressure[live] - direct().pressure[live]) < 1e-4 * energy(
        heard.pressure[live] - direct().pressure[live]
    )
    few = elements(Romanis(dead=tuple(range(20, 508))))
    assert cancel(heard, locate(heard), Receiver(POSE, few, SONAR), BOTTOM_DEPTH, WINDOW, LIMITS).signals is heard


def test_image_sources_are_as_far_as_the_rays_are_long():
    """Against the eigenrays of the flat channel, every family of up to three reflections."""
    snap = np.array([9.0, 3.0, 1.5])
    found = images(snap, POSE, BOTTOM_DEPTH, 3)
    place = POSE.to_world(snap)
    depths = np.array([-place[2]]), np.array([5.0])
    away = np.array([np.hypot(place[0], place[1])])
    rays = eigenrays(water(WATER.depth, WATER.speed, BOTTOM_DEPTH), *depths, away, 3, 3)
    bounced = rays.surface + rays.bottom > 0
    by_rays = sorted(zip(rays.surface[bounced], rays.bottom[bounced], rays.length[bounced], strict=True))
    by_images = sorted((s, b, np.linalg.norm(p)) for s, b, p in found)
    assert np.allclose(by_images, by_rays, rtol=1e-12)


def test_reflections_are_looked_for_from_where_the_array_is_when_it_hears_the_snap():
    """Of a sonar that dives, 0.5 s after the instant of the frame."""
    late, window, snap = 0.5, (0.0112, 0.0225), np.array([14.0, -5.0, -2.0])
    signals = with_arrival(direct(snap), image=snap + [0.0, 0.0, 14.0])  # by the surface
    signals = replace(signals, start=signals.start + late)
    began = Track(Pose(POSE.position + [0.0, 0.0, 2.0 * late], POSE.orientation), np.array([0.0, 0.0, -2.0]))
    receiver = Receiver(began.pose, ARRAY, SONAR, began)
    estimates = SensorDelays(on_bottom=False).locate(signals, receiver, Survey(BOTTOM_DEPTH, WATER), 1)
    inside = window[0] + late, window[1] + late
    outcomes = cancel(signals, estimates, receiver, BOTTOM_DEPTH, inside, LIMITS).outcomes
    taken = {(one.expected.surface, one.expected.bottom): one for one in outcomes if one.reason == CANCELLED}[1, 0]
    assert np.allclose(taken.expected.front.direction, taken.found.direction, atol=2e-3)


def test_the_image_is_made_without_it_and_the_signals_are_stored_with_it():
    """The small scene with two reflections, which reach the array while the hull echoes."""
    recipe = remus(1)
    heard = []
    for cancelling in (None, WavefrontCancelling()):
        scene = replace(
            recipe.scene,
            physics=Physics(tracing=AutoTracing(bounces=2)),
            processing=Processing(cancelling=cancelling, echo_window=EchoWindow(start=7e-3)),
        )
        made = plan(replace(recipe, scene=scene))
        heard.append(beamform_frame(made, 0, trace_frame(made, 0)))
    plain, clean = heard
    assert plain.imaged is plain.signals
    assert np.array_equal(clean.signals.pressure, plain.signals.pressure)
    assert energy(clean.imaged.pressure) < energy(plain.signals.pressure)
    streaks = plain.image.energy - clean.image.energy
    assert streaks.max() > 0.1 * clean.image.energy.max()
    assert streaks.min() > -1e-3 * clean.image.energy.max()
