"""Echoes of pulses that last longer than a snap, or have less than the band, and of snaps in narrow bands: as many
points as there are echoes, where they are, within the errors that are predicted, or as far off as the plan says."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import correlate, hilbert

from sonarsynth import render
from sonarsynth.conventions import Floats
from sonarsynth.environment.noise import FlatNoise
from sonarsynth.equations.arrays.bistatic_range import bistatic_range
from sonarsynth.geometry.motion import ConstantVelocity
from sonarsynth.planning import Plan, plan
from sonarsynth.ranging.location.triggered import Triggered
from sonarsynth.receiver import Band, BandPass, BeamGrid, PlanarLattice
from sonarsynth.recipe.scene import EchoWindow, Processing
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
from sonarsynth.sources.snap_models import Gabor, RecordedSnap
from tests.scenes import point_scene

TARGET, SOURCE = (40.0, 3.0, -47.0), (10.0, 3.0, -55.0)
LOW, HIGH = 35e3, 45e3
WIDE = EchoWindow(start=20e-3, stop=70e-3)


RATE, LENGTH, FIRST, LAST = 200e3, 5e-3, 36e3, 44e3


def swept(t: Floats) -> Floats:
    """5 ms from 36 to 44 kHz, at times (sample,) s after its middle: 40 times as long as what it is compressed to."""
    t = t + 0.5 * LENGTH
    ramp = np.clip(10.0 * np.minimum(t, LENGTH - 1.0 / RATE - t) / LENGTH, 0.0, 1.0)
    return np.asarray(ramp * np.sin(2 * np.pi * (FIRST * t + 0.5 * (LAST - FIRST) / LENGTH * t**2)))


def sweep(path: Path) -> RecordedSnap:
    """The recording of it."""
    np.savetxt(path, swept(np.arange(int(LENGTH * RATE)) / RATE - 0.5 * LENGTH))
    return RecordedSnap(path=str(path), sampling_frequency=RATE, time=0.5 * LENGTH)


def planned(model: PulseModel, level: float, window: EchoWindow, low: float = LOW, high: float = HIGH) -> Plan:
    """Four frames of a point in noise, and of a trigger that tells all."""
    recipe = point_scene(
        TARGET,
        SOURCE,
        strength=1e-2,
        array=PlanarLattice(columns=16, rows=16, pitch=0.02),
        band=Band(low=low, high=high),
        filter=BandPass(low=low, high=high),
        sampling_frequency=120e3,
        sound_speed_error=0.0,
        beams=BeamGrid(azimuth_span=np.deg2rad(20), azimuths=21, elevation_span=np.deg2rad(20), elevations=21),
    )
    world = recipe.scene.world
    world = replace(
        world,
        environment=replace(world.environment, noise=FlatNoise(level=40.0)),
        sources=(SnappingShrimp(position=SOURCE, snap=model, source_level=level),),
    )
    processing = Processing(locating=Triggered(time_error=1e-9, position_error=1e-6), echo_window=window)
    trajectory = replace(recipe.scene.trajectory, frames=4)
    return plan(replace(recipe, scene=replace(recipe.scene, world=world, processing=processing, trajectory=trajectory)))


def echo(made: Plan, frame: int) -> tuple[float, float]:
    """Of the one point of a frame: how far its range is off, in predicted errors, and its signal to noise (dB)."""
    cloud = render(made, frame)["cloud"]
    assert int(cloud["count"]) == 1
    away = np.linalg.norm(np.array(TARGET) - [0.0, 0.0, -50.0])
    return float((cloud["range"][0] - away) / cloud["range_error"][0]), float(cloud["snr"][0])


@pytest.mark.parametrize("pulse", ["tone of 0.5 ms", "tone of 2.5 ms", "sweep of 5 ms"])
def test_each_echo_of_a_long_pulse_is_one_point_within_its_error(pulse: str, tmp_path: Path) -> None:
    """A tenth of the direct pulse was taken for all of it: sweeps gave 6 points an echo, 48 predicted errors off."""
    tones = {"tone of 0.5 ms": 20.0, "tone of 2.5 ms": 100.0}
    model: PulseModel = Gabor(frequency=40e3, cycles=tones[pulse]) if pulse in tones else sweep(tmp_path / "sweep.csv")
    made = [planned(model, level, WIDE) for level in (115.0, 145.0)]
    errors = [echo(of, i)[0] for of in made for i in range(4)]
    assert np.abs(errors).max() < 3.0 and np.sqrt(np.mean(np.square(errors))) < 1.2, errors


@pytest.mark.parametrize("speed", [-2.0, 10.0])
def test_a_sweep_ranges_what_moves_as_far_off_as_the_plan_says(speed: float, tmp_path: Path) -> None:
    """By the signal of a point that moves, sample by sample, and its correlation with the direct pulse: 4.9 cm at 2
    m/s, which nothing told of, and no label at 10 m/s."""
    still = planned(sweep(tmp_path / "sweep.csv"), 145.0, WIDE).recipe
    moves = ConstantVelocity(start=TARGET, heading=0.5 * np.pi, speed=speed)
    world = replace(still.scene.world, targets=(replace(still.scene.world.targets[0], motion=moves),))
    made = plan(replace(still, scene=replace(still.scene, world=world)))
    cloud = render(made, 0)["cloud"]
    assert int(cloud["count"]) == 1 and int(cloud["target"][0]) == 0
    off = float(cloud["range"][0] - cloud["true_range"][0])
    (said,) = re.findall(r"ranges are (\S+) m off", "\n".join(made.warnings))

    array, source, c, rate = np.array([0.0, 0.0, -50.0]), np.array(SOURCE), 1500.0, 1e6
    met = np.linspace(0.0, 0.05, 5001)  # s, when sound meets the point, which sends on what it meets
    place = np.array(TARGET) + np.outer(met, [speed, 0.0, 0.0])
    sent = met - np.linalg.norm(place - source, axis=1) / c
    heard = met + np.linalg.norm(place - array, axis=1) / c
    late = np.arange(0.03 * rate, 0.08 * rate) / rate
    echo, direct = swept(np.interp(late, heard, sent)), swept(np.arange(-3e-3 * rate, 3e-3 * rate) / rate)
    lag = np.abs(hilbert(correlate(echo, direct, "valid"))).argmax() / rate + 0.033
    first = [np.interp(0.0, sent, column) for column in place.T]
    beam, nearer = (first - array) / np.linalg.norm(first - array), source - array
    ranged = bistatic_range(c * lag - np.linalg.norm(nearer), beam, nearer).range
    assert float(cloud["true_range"][0]) == pytest.approx(np.linalg.norm(first - array), abs=1e-3)
    assert off == pytest.approx(float(ranged) - np.linalg.norm(first - array), abs=2e-3)
    assert float(said) == pytest.approx(off, rel=0.05)
    assert abs(off) < 2.0 * float(cloud["range_error"][0])  # 3 and 17 of them before

    short = SnappingShrimp(name="short", position=(5.0, 0.2, -50.2), source_level=180.0)  # stretched by more
    low = SnappingShrimp(name="low", position=SOURCE, snap=Gabor(frequency=10e3, cycles=100.0), source_level=180.0)
    sources = (short, low, *world.sources)  # that below the band is twice as long, and not heard
    both = plan(replace(still, scene=replace(still.scene, world=replace(world, sources=sources))))
    assert both.windows.supports.late == made.windows.supports.late > 0.0
    assert f"ranges are {said} m off" in "\n".join(both.warnings)

    rests = replace(world.targets[0], name="rests", motion=still.scene.world.targets[0].motion)
    half = plan(replace(still, scene=replace(still.scene, world=replace(world, targets=(*world.targets, rests)))))
    assert half.windows.supports.late == pytest.approx(np.sqrt(0.5) * made.windows.supports.late)  # one standard error


@pytest.mark.parametrize("width", [1e3, 3e3, 10e3, "a long tone"])
def test_an_echo_window_holds_noise_to_tell_echoes_by(width: float | str) -> None:
    """As a much longer window: what is left of the feet of the echo in the shorter one may be a few dB more."""
    model: PulseModel = Gabor(frequency=40e3, cycles=100.0) if isinstance(width, str) else LogarithmicBubble()
    level, wide = (140.0, 10e3) if isinstance(width, str) else (180.0, width)
    band = 40e3 - 0.5 * wide, 40e3 + 0.5 * wide
    (off, own), (_, longer) = (echo(planned(model, level, window, *band), 0) for window in (EchoWindow(), WIDE))
    assert abs(off) < 3.0
    assert own == pytest.approx(longer, abs=4.0)


def test_a_band_of_one_frequency_gives_no_point() -> None:
    narrow = planned(Gabor(frequency=40e3), 180.0, EchoWindow(start=20e-3, stop=25e-3), 39.99e3, 40.01e3)
    assert int(render(narrow, 0)["cloud"]["count"]) == 0
