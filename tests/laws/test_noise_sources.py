"""Sources of noise at one place: a recording is heard when and as loud as it must be; a spectrum at its level."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.io import wavfile
from scipy.signal.windows import hann

import sonarsynth as ss
from sonarsynth.geometry.motion import pose
from sonarsynth.pipeline.synthesis import digitise, errors_of
from sonarsynth.planning import frame_start
from sonarsynth.planning.costs import frame_size
from sonarsynth.planning.noise_rows import noise_rows
from sonarsynth.products import Signals

FS, C = 196e3, 1540.0
RECIPE = """
title: a source of noise
scene:
  world:
    environment:
      depth: 40 m
      sound_speed: {kind: isovelocity, speed: 1540}
      absorption: {formula: none}
      noise: NOISE
    noise_sources: [SOURCE]
  sonar:
    array: {kind: position_table, positions: [[0, 0, 0], [0, 0.4, 0.1], [0.2, -0.3, 0.5]]}
    beams: {azimuths: 3, elevations: 3}
  trajectory: {frames: 2, interval: 0.5 s, sonar: {kind: still, position: [0, 0, -20], heading: 90 deg}}
"""
SOUND = "{kind: noise_recording, path: tone.wav}"
STILL = "{kind: still, position: [12, 3, -17]}"


def heard(
    folder: Path, source: str, noise: str = "null", frame: int = 0, samples: int = 4000, late: float = 0.0
) -> Signals:
    """Signals of a frame in which nothing else sounds, in a window of so many samples, so late (s)."""
    (folder / "recipe.yaml").write_text(RECIPE.replace("SOURCE", source).replace("NOISE", noise))
    plan = ss.plan(ss.load(folder / "recipe.yaml"), products=["signals"])
    instant = plan.recipe.frame(frame)[1]
    quiet = Signals(np.zeros((3, samples), np.float32), frame_start(plan, instant) + late, FS, 0.0, 0, 0)
    return digitise(plan, instant, quiet)


def tone(folder: Path, frequency: float, rate: int = 400_000) -> None:
    """A WAV of half a second, which holds whole periods."""
    wave = np.sin(2.0 * np.pi * frequency * np.arange(rate // 2) / rate)
    wavfile.write(folder / "tone.wav", rate, wave.astype(np.float32))


def test_a_recording_is_heard_after_its_travel_time_and_falls_as_the_distance(tmp_path: Path) -> None:
    tone(tmp_path, 60e3)
    sound = "{kind: noise_recording, path: tone.wav, pascals: 3, start: 1 us}"
    got = heard(tmp_path, f"{{name: a, motion: {STILL}, sound: {sound}}}", frame=1)
    positions = np.array([[0, 0, 0], [0, 0.4, 0.1], [0.2, -0.3, 0.5]]) + [0.0, 0.0, -20.0]  # it looks east
    t = got.start + np.arange(got.pressure.shape[1]) / FS
    for row, place in zip(got.pressure, positions, strict=True):
        r = np.linalg.norm(place - [12.0, 3.0, -17.0])
        exact = 3.0 / r * np.sin(2.0 * np.pi * 60e3 * (0.5 + t - r / C + 1e-6))
        np.testing.assert_allclose(row[100:-100], exact[100:-100], atol=0.01 * 3.0 / r)


@pytest.mark.parametrize("speed", [-15.0, 15.0])
def test_a_recording_that_approaches_is_heard_higher(tmp_path: Path, speed: float) -> None:
    tone(tmp_path, 60e3)
    motion = f"{{kind: line, start: [100, 0, -20], stop: [{100 - speed}, 0, -20], duration: 1 s}}"
    got = heard(
        tmp_path, f"{{name: a, motion: {motion}, sound: {{kind: noise_recording, path: tone.wav}}}}", samples=16384
    )
    spectrum = np.abs(np.fft.rfft(got.pressure[0] * hann(16384), 1 << 18))
    assert spectrum.argmax() * FS / (1 << 18) == pytest.approx(60e3 / (1.0 - speed / C), abs=1.0)


@pytest.mark.parametrize("late", [0.0, 0.1])
def test_a_recording_that_approaches_is_heard_when_it_must_be(tmp_path: Path, late: float) -> None:
    """Late in the record too: what is heard at t left at s = t - r(s)/c. It came 0.3 ms off after 0.1 s, and by a
    period off at once."""
    tone(tmp_path, 60e3)
    r, speed = 20.0, 5.0
    motion = f"{{kind: line, start: [{r}, 0, -20], stop: [{r - speed}, 0, -20], duration: 1 s}}"
    source = f"{{name: a, motion: {motion}, sound: {{kind: noise_recording, path: tone.wav}}}}"
    got = heard(tmp_path, source, late=late)
    t = got.start + np.arange(got.pressure.shape[1]) / FS
    left = (t - r / C) / (1.0 - speed / C)
    exact = np.sin(2.0 * np.pi * 60e3 * left) / (r - speed * left)
    np.testing.assert_allclose(got.pressure[0, 100:-100], exact[100:-100], atol=0.01 / r)


@pytest.mark.parametrize("late", [0.0, 0.3])
@pytest.mark.parametrize(
    "sonar",
    [
        "{kind: circle, centre: [0, -4, -20], radius: 4, speed: -3}",
        "{kind: hover, position: [0, 0, -20], heading: 80 deg, surge: 1, sway: 1, heave: 1, yaw: 20 deg, period: 4 s}",
    ],
    ids=["turns", "swings"],
)
def test_a_recording_is_heard_by_each_hydrophone_where_it_is_then(tmp_path: Path, sonar: str, late: float) -> None:
    """Of a sonar that turns and a boat that passes: 0.3 s after the instant of the frame it was 1.2 to 1.6 of itself
    off, 10 degrees aside."""
    tone(tmp_path, 60e3)
    motion = "{kind: course, start: [25, 9, -17], heading: 200 deg, speed: 6}"
    source = f"{{name: a, motion: {motion}, sound: {{kind: noise_recording, path: tone.wav}}}}"
    still = "{kind: still, position: [0, 0, -20], heading: 90 deg}"
    text = RECIPE.replace(still, sonar).replace("SOURCE", source).replace("NOISE", "null")
    (tmp_path / "recipe.yaml").write_text(text)
    plan = ss.plan(ss.load(tmp_path / "recipe.yaml"), products=["signals"])
    frame, samples = plan.recipe.frame(1)[1], 400
    got = digitise(
        plan, frame, Signals(np.zeros((3, samples), np.float32), frame_start(plan, frame) + late, FS, 0.0, 0, 0)
    )
    ours, theirs = plan.scene.trajectory.sonar, plan.scene.world.noise_sources[0].motion
    few = frame.time + got.start + np.linspace(0.0, samples / FS, 9)
    for row, place in zip(got.pressure, plan.elements.position, strict=True):
        path = []
        for heard in few:
            there, left = pose(ours, heard).to_world(place), heard
            for _ in range(9):
                r = float(np.linalg.norm(there - pose(theirs, left).position))
                left = heard - r / C
            path.append((left, r))
        left, r = CubicSpline(few, path)(frame.time + got.start + np.arange(samples) / FS).T
        off = row - np.sin(2.0 * np.pi * 60e3 * left) / r
        assert np.abs(off[100:-100]).max() < 0.06 / r.min()


def test_a_spectrum_is_heard_at_its_level_and_changes_no_draw_of_the_ambient_noise(tmp_path: Path) -> None:
    source = f"{{name: ship, motion: {STILL}, sound: {{kind: flat, level: 120 dB}}}}"
    got = heard(tmp_path, source, samples=30000).pressure
    r = np.linalg.norm([12.0, 3.0, 3.0])
    f = np.fft.rfftfreq(30000, 1.0 / FS)
    inside = (f > 35e3) & (f < 75e3)
    power = 2.0 * np.abs(np.fft.rfft(got[0] * hann(30000))[inside]) ** 2 / (FS * np.sum(hann(30000) ** 2))
    assert 10.0 * np.log10(power.mean() * r**2) == pytest.approx(0.0, abs=0.3)
    ambient = "{kind: flat, level: 60 dB}"
    alone = heard(tmp_path, source, samples=2000).pressure
    both = heard(tmp_path, source, ambient, samples=2000).pressure
    without = heard(tmp_path, "", ambient, samples=2000).pressure
    np.testing.assert_allclose(both, alone + without, rtol=2.0**-23, atol=1e-6)  # the last of 24 bits
    assert np.abs(np.corrcoef(alone[0], without[0])[0, 1]) < 0.1


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("{name: a, motion: {kind: still, position: [9, 0, 3]}, sound: {kind: flat, level: 1}}", "above the surface"),
        (f"{{name: a, motion: {STILL}, sound: {{kind: thermal, directions: {{kind: surface}}}}}}", "no directions"),
        (f"{{name: a, motion: {STILL}, sound: {{kind: noise_recording, path: tone.wav}}}}", "no such file"),
        (  # which was silent
            "{name: a, motion: {kind: still, position: [0, 0, -20]}, sound: {kind: flat, level: 1 dB}}",
            r"noise_sources\.0\.motion: is at the centre of the array at frame 0",
        ),
        (
            "{name: a, motion: {kind: still, position: [0, 0.4, -19.9]}, sound: {kind: flat, level: 1 dB}}",
            r"noise_sources\.0\.motion: is at hydrophone 1 of the array at frame 0",
        ),
        (  # of which nothing was true
            "{name: a, motion: {kind: course, start: [30, 0, -20], speed: 1600}, sound: {kind: flat, level: 1 dB}}",
            r"noise_sources\.0\.motion: moves too fast for sound in water at frame 0",
        ),
        (  # silent as well
            "{name: a, motion: {kind: still, position: [20, 1, -20]}, sound: {kind: flat, level: 1 dB}}",
            r"noise_sources\.0\.motion: is inside target 'ball' at frame 0, or touches it",
        ),
    ],
)
def test_what_cannot_be_is_refused(tmp_path: Path, source: str, message: str) -> None:
    body = "{name: ball, shape: {kind: sphere, radius: 1, edge: 0.5}, motion: {kind: still, position: [20, 1, -20]}}"
    with pytest.raises((ss.RecipeError, ss.FieldError), match=message):
        heard(tmp_path, f"{source}]\n    targets: [{body}")


@pytest.mark.parametrize("speed", [0.0, 10.0])
def test_the_plan_says_how_far_a_source_passes_in_a_record(tmp_path: Path, speed: float) -> None:
    """Which is heard from one place: a boat that crosses 12 m ahead at 10 m/s goes on by 0.14 degrees in 3 ms."""
    motion = f"{{kind: line, start: [12, 0, -20], stop: [12, {speed}, -20], duration: 1 s}}"
    source = f"{{name: boat, motion: {motion if speed else STILL}, sound: {{kind: flat, level: 120 dB}}}}"
    (tmp_path / "recipe.yaml").write_text(RECIPE.replace("SOURCE", source).replace("NOISE", "null"))
    plan = ss.plan(ss.load(tmp_path / "recipe.yaml"), products=["signals"])
    middle = frame_start(plan, plan.recipe.frame(1)[1]) + 0.5 * plan.windows.samples / FS
    along = (np.array([0.0, 0.5]) + middle) * speed  # of both frames
    passed = np.rad2deg(
        np.arctan(along / 12.0) - np.arctan((along - 0.5 * speed * plan.windows.samples / FS) / 12.0)
    ).max()
    (row,) = noise_rows(plan, frame_size(plan))
    assert row[3] == (f"at one place in a record: directions up to {passed:.2g} degrees off" if speed else "none")


@pytest.mark.parametrize(("position", "which"), [((12.0, 12.0, -20.0), 0), ((-12.0, 0.0, -20.0), 1)])
def test_the_plan_says_what_positions_along_the_axis_do_to_sound_that_is_not_from_ahead(
    tmp_path: Path, position: tuple[float, float, float], which: int
) -> None:
    """They count as delays of sound from ahead: tones of a source 45 degrees aside, and behind, have phases off by as
    much, of what they have where hydrophones are."""
    tone(tmp_path, 60e3)
    places = [[0.0, 0.3 * np.cos(t), 0.3 * np.sin(t)] for t in np.linspace(0.0, 6.0, 100)]
    table = f"positions: {np.round(places, 3).tolist()}}}\n    sensor_errors: {{position: 1 mm}}"
    source = f"{{name: a, motion: {{kind: still, position: {list(position)}}}, sound: {SOUND}}}"
    text = RECIPE.replace("positions: [[0, 0, 0], [0, 0.4, 0.1], [0.2, -0.3, 0.5]]}", table)
    (tmp_path / "recipe.yaml").write_text(text.replace("SOURCE", source).replace("NOISE", "null"))
    plan = ss.plan(ss.load(tmp_path / "recipe.yaml"), products=["signals"])
    frame = plan.recipe.frame(0)[1]
    quiet = Signals(np.zeros((100, 4000), np.float32), frame_start(plan, frame), FS, 0.0, 0, 0)
    pressure, drawn = digitise(plan, frame, quiet).pressure[:, 500:3500], errors_of(plan, frame)
    assert drawn is not None
    real = frame.sonar_pose.to_world(plan.elements.position + drawn.position)
    turns = np.exp(-2j * np.pi * 60e3 * np.arange(3000) / FS) * hann(3000)
    wave = (pressure @ turns) * np.exp(2j * np.pi * 60e3 / C * np.linalg.norm(real - position, axis=1))
    off = np.std(np.angle(wave / wave.mean()))
    (row,) = (row for row in noise_rows(plan, frame_size(plan)) if row[0] == "sensors")
    said = [float(number) for number in re.findall(r"[\d.]+(?= rad| from)", row[3])]
    assert off == pytest.approx(said[which] * 60e3 / plan.scene.sonar.band.high, rel=0.25)


def test_a_noise_that_is_appended_changes_nothing_of_those_before_it(tmp_path: Path) -> None:
    first, second = "{kind: flat, level: 60 dB}", "{kind: wind, directions: {kind: surface}}"
    alone = heard(tmp_path, "", first, samples=500).pressure
    np.testing.assert_array_equal(heard(tmp_path, "", f"[{first}]", samples=500).pressure, alone)
    more, most = (
        heard(tmp_path, "", f"[{first}, {second}{rest}]", samples=500).pressure for rest in ("", ", {kind: thermal}")
    )
    added, last = more - alone, most - more
    assert np.abs(np.corrcoef(added[0], alone[0])[0, 1]) < 0.2 and np.std(added) > 0.0
    assert np.abs(np.corrcoef(last[0], added[0])[0, 1]) < 0.3 and np.std(last) > 0.0
