"""Levels of beams against delay: Parseval's sum, and where and how loud a tone burst is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.beam_envelopes import envelope_delays, envelope_levels
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.products import Signals
from sonarsynth.receiver import Band, BeamGrid, PlanarLattice, Sonar, elements

ROOT = Path(__file__).resolve().parents[2]
RATE, START, STOP = 196e3, 1e-3, 4e-3
SONAR = Sonar(
    array=PlanarLattice(columns=6, rows=5, pitch=0.02),
    sampling_frequency=RATE,
    band=Band(low=30e3, high=80e3),
    beams=BeamGrid(azimuths=5, elevations=3, azimuth_span=0.8, elevation_span=0.4),
)
ARRAY = elements(SONAR.array)


def test_mean_squares_over_delay_add_up_to_the_energy_of_the_beam() -> None:
    noise = np.random.default_rng(3).standard_normal((ARRAY.count, 1000)).astype(np.float32)
    beams = FocusedDelayAndSum(focus=None).beams(
        snapshots_of(Signals(noise, 0.0, RATE, 0.0, 0, 0), SONAR, START, STOP), ARRAY, SONAR
    )
    delays = envelope_delays(STOP - START, SONAR)
    assert delays[1] - delays[0] == pytest.approx(1.0 / 50e3, rel=0.02) and delays[-1] < STOP - START
    mean_square = 10.0 ** (envelope_levels(beams, SONAR, len(delays)) / 10.0) * 1e-12
    np.testing.assert_allclose(mean_square.sum(axis=2) * (delays[1] - delays[0]), beams.energies(), rtol=1e-3)


def test_a_burst_is_at_its_delay_and_level() -> None:
    time, middle = np.arange(1000) / RATE, 2.4e-3
    burst = 3.0 * np.cos(2.0 * np.pi * 55e3 * time) * np.exp(-0.5 * ((time - middle) / 8e-5) ** 2)
    signals = Signals(np.tile(burst, (ARRAY.count, 1)).astype(np.float32), 0.0, RATE, 0.0, 0, 0)
    window = snapshots_of(signals, SONAR, START, STOP)
    beams, delays = FocusedDelayAndSum(focus=None).beams(window, ARRAY, SONAR), envelope_delays(STOP - START, SONAR)
    level = envelope_levels(beams, SONAR, len(delays))[1, 2]  # ahead, where the wave comes from
    expected = (
        20.0 * np.log10(3.0e6 / np.sqrt(2.0)) - 10.0 / np.log(10.0) * ((window.start + delays - middle) / 8e-5) ** 2
    )
    loud = expected > expected.max() - 30.0
    np.testing.assert_allclose(level[loud], expected[loud], atol=0.1)


def test_the_product_is_stored_in_hundredths_of_a_decibel_and_adds_up_to_the_image() -> None:
    sets = ["scene.sonar.beams.azimuths=9", "scene.sonar.beams.elevations=7"]
    plan = ss.plan(ss.load(ROOT / "configs" / "tank.yaml", sets), ["beams", "image"])
    (row,) = (row for row in plan.stages if row.stage == "resolve")
    tree = ss.render(plan, 0)
    level, energy = tree["beams/level"], tree["image/energy"].values
    assert row.bytes == 2 * level.size and level.dims == ("elevation", "azimuth", "delay")
    step = float(tree["beams/delay"][1])
    found = 10.0 ** (np.asarray(level, float) / 10.0) * 1e-12 * step
    bright = energy > 0.01 * energy.max()
    np.testing.assert_allclose(np.nansum(found, axis=2)[bright], energy[bright], rtol=0.1)  # focus: axis, or zones
    assert 0.0 <= float(tree["beams/start"]) - float(tree["image/start"]) < 1.0 / 196e3
