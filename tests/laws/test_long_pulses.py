"""Echoes of pulses that last longer than a snap, or have less than the band, and of snaps in narrow bands: as many
points as there are echoes, where they are, within the errors that are predicted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth import render
from sonarsynth.environment.noise import FlatNoise
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


def sweep(path: Path) -> RecordedSnap:
    """5 ms from 36 to 44 kHz: 40 times as long as what it is compressed to."""
    rate, length, first, last = 200e3, 5e-3, 36e3, 44e3
    t = np.arange(int(length * rate)) / rate
    ramp = np.minimum(1.0, 10.0 * np.minimum(t, length - 1.0 / rate - t) / length)
    wave = ramp * np.sin(2 * np.pi * (first * t + 0.5 * (last - first) / length * t**2))
    np.savetxt(path, wave)
    return RecordedSnap(path=str(path), sampling_frequency=rate, time=0.5 * length)


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
