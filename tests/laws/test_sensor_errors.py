"""Errors of sensors and channels: what they do to beams, sines and pulses, and that each is drawn for itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.signal.windows import tukey

import sonarsynth as ss
from sonarsynth.conventions import Floats
from sonarsynth.pipeline.synthesis import digitise, errors_of, frame_signals, true_elements
from sonarsynth.products import Signals
from sonarsynth.receiver import Electronics, Overload, PlanarLattice, PositionTable, Romanis, SensorErrors, elements
from sonarsynth.receiver.sensor_errors import DrawnErrors, SensorState, drawn_errors
from sonarsynth.signals import channel_errors

FS, C = 196e3, 1540.0


def sine(frequency: float, sensors: int = 3, samples: int = 4096) -> Signals:
    """A sine of amplitude 1 in the middle of the window, that fades to 0 at its ends."""
    wave = np.sin(2.0 * np.pi * frequency * np.arange(samples) / FS) * tukey(samples, 0.4)
    return Signals(np.tile(wave, (sensors, 1)).astype(np.float32), 0.0, FS, 0.0, 0, 0)


def ideal(sensors: int) -> DrawnErrors:
    """Nothing is wrong."""
    return drawn_errors(SensorErrors(), sensors, 1, 0)


@pytest.mark.parametrize(
    ("gain", "phase", "dead"), [(0.05, 0.0, 0.0), (0.0, 0.3, 0.0), (0.1, 0.3, 0.0), (0.0, 0.0, 0.05), (0.1, 0.2, 0.1)]
)
def test_main_lobe_and_floor_of_sidelobes_are_those_of_ruze(gain: float, phase: float, dead: float) -> None:
    array, draws = elements(Romanis()), 60
    q, n = 1.0 - dead, array.count
    errors = SensorErrors(gain=20.0 * np.log10(1.0 + gain), phase=phase, dead=dead)
    u = np.random.default_rng(1).uniform(-1.0, 1.0, (40, 2))  # sines of directions that are steered to, but ahead
    weights = np.exp(-1j * 2.0 * np.pi * 55e3 / C * (array.position[:, 1:] @ u.T)) / n
    nothing = weights.sum(axis=0)
    main, floor = [], []
    for seed in range(draws):
        drawn = drawn_errors(errors, n, seed, 0)
        x = drawn.response(np.array([55e3]), C)[:, 0] * (drawn.state != SensorState.DEAD)
        main.append(np.abs(x.mean()) ** 2)
        floor.append(np.abs(x @ weights - q * np.exp(-0.5 * phase**2) * nothing) ** 2)
    left = (q * (1.0 + gain**2) - q**2 * np.exp(-(phase**2))) / n
    assert 10.0 * np.log10(np.mean(main) / (q**2 * np.exp(-(phase**2)) + left)) == pytest.approx(0.0, abs=0.1)
    scatter = 1.0 / np.sqrt(draws * 40)
    assert 10.0 * np.log10(np.mean(floor) / left) == pytest.approx(0.0, abs=0.1 + 4.0 * 4.34 * scatter)


def test_each_kind_of_error_is_drawn_for_itself_and_the_same_for_a_sequence() -> None:
    every = SensorErrors(gain=1.0, phase=0.1, delay=1e-6, position=1e-3, dead=0.1, stuck=0.1, noisy=0.1, clock_rate=20)
    whole = drawn_errors(every, 200, 5, "key")
    for name in ("gain", "phase", "delay", "position"):
        alone = drawn_errors(SensorErrors(**{name: getattr(every, name)}), 200, 5, "key")
        np.testing.assert_array_equal(getattr(alone, name), getattr(whole, name))
        assert not np.array_equal(getattr(drawn_errors(every, 200, 5, "other"), name), getattr(whole, name))
    shares = np.bincount(whole.state, minlength=4) / 200
    np.testing.assert_allclose(shares, [0.7, 0.1, 0.1, 0.1], atol=4.0 * np.sqrt(0.1 * 0.9 / 200) + 0.03)
    nothing = ideal(200)
    assert (nothing.gain == 1.0).all() and not nothing.phase.any() and not nothing.state.any()


def test_a_channel_has_its_gain_phase_and_delay() -> None:
    f = 60.03e3
    drawn = replace(
        ideal(3), gain=np.array([0.5, 1.0, 1.0]), phase=np.array([0.0, 0.4, 0.0]), delay=np.array([0.0, 0.0, 3e-6])
    )
    heard = channel_errors.respond(sine(f), drawn, C).pressure
    t = np.arange(heard.shape[1]) / FS
    middle = slice(1024, 3072)
    assert (1.0 - tukey(heard.shape[1], 0.4))[middle].max() == 0.0
    for row, (gain, late) in zip(heard, ((0.5, 0.0), (1.0, -0.4 / (2.0 * np.pi * f)), (1.0, 3e-6)), strict=True):
        np.testing.assert_allclose(row[middle], gain * np.sin(2.0 * np.pi * f * (t - late))[middle], atol=3e-3)


def test_a_hydrophone_farther_ahead_hears_sound_from_ahead_earlier() -> None:
    drawn = replace(ideal(1), position=np.array([[5e-3, 0.0, 0.0]]))
    assert drawn.delays(C)[0] == pytest.approx(-5e-3 / C)


@pytest.mark.parametrize(("known", "left"), [("gain", 0.3), ("all", 1e-3)])
def test_processing_corrects_what_it_knows(known: Literal["gain", "all"], left: float) -> None:
    errors = SensorErrors(gain=4.0, phase=0.1, delay=2e-7, dead=0.2, known=known)
    drawn, true = drawn_errors(errors, 12, 3, 0), sine(60e3, 12)
    recorded = channel_errors.respond(true, drawn, C)
    got = channel_errors.corrected(recorded, errors, drawn, C).pressure
    works = drawn.state == SensorState.WORKING
    assert 0 < works.sum() < 12
    wrong, before = (np.abs(p - true.pressure)[works].max() for p in (got, recorded.pressure))
    assert wrong < left < before
    assert known == "all" or wrong > 0.05, "phases are not corrected, or the test says nothing"
    assert not got[~works].any()
    assert channel_errors.corrected(recorded, SensorErrors(), drawn, C) is recorded


@pytest.mark.parametrize(
    "array", [PlanarLattice(columns=4, rows=3, pitch=0.02), PositionTable(positions=((0, 0, 0),) * 5)]
)
def test_cross_talk_is_of_neighbours_alone_and_reciprocal(array: PlanarLattice | PositionTable) -> None:
    sensors = elements(array)
    k = channel_errors.neighbours(sensors, -40.0).toarray()
    np.testing.assert_array_equal(k, k.T)
    expected = 2 * (3 * 3 + 4 * 2) if sensors.on_lattice else 2 * 4
    assert np.count_nonzero(k) == expected and set(np.unique(k)) == {np.float32(0.0), np.float32(0.01)}
    one = Signals(np.eye(sensors.count, 8, dtype=np.float32), 0.0, FS, 0.0, 0, 0)
    np.testing.assert_allclose(channel_errors.talk(one, sensors, -40.0).pressure, (np.eye(len(k)) + k) @ one.pressure)


@pytest.mark.parametrize(("jitter", "ratio"), [(10e-9, 45.4), (1e-9, 65.4)])
def test_jitter_leaves_the_ratio_of_signal_to_noise_that_it_must(jitter: float, ratio: float) -> None:
    true = sine(85e3, 1, 8192)
    got = channel_errors.sampled(true, jitter, 0.0, np.random.default_rng(2)).pressure
    wrong = (got - true.pressure)[0, 2000:-2000]
    assert -10.0 * np.log10(2.0 * np.mean(wrong**2)) == pytest.approx(ratio, abs=0.3)


def test_a_fast_clock_shifts_frequencies() -> None:
    rate, f = 100e-6, 70e3
    got = channel_errors.sampled(sine(f, 1, 8192), 0.0, rate, np.random.default_rng(1)).pressure[0]
    expected = np.sin(2.0 * np.pi * f * (1.0 + rate) * np.arange(8192) / FS)
    np.testing.assert_allclose(got[2000:-2000], expected[2000:-2000], atol=2e-4)


def test_overload_cuts_then_recovers_and_changes_nothing_before() -> None:
    p = np.full((1, 400), 0.1, np.float32)
    p[0, 100:110] = 5.0
    got = channel_errors.overloaded(Signals(p, 0.0, FS, 0.0, 0, 0), Overload(level=1.0, recovery=50e-6)).pressure[0]
    np.testing.assert_array_equal(got[:100], p[0, :100])
    assert (got[100:110] == 1.0).all()
    t = np.arange(1, 291) / FS
    np.testing.assert_allclose(got[110:], 0.1 * (1.0 - np.exp(-t / 50e-6)), rtol=1e-5)


RECIPE = """
title: sensors
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1540}, noise: {kind: flat, level: 40 dB}}
    sources: [{kind: snapping_shrimp, name: a, position: [4, 1]}]
  sonar:
    array: {kind: planar_lattice, columns: 3, rows: 2, pitch: 5 cm, face: 0 m}
    converter: {bits: 16, full_scale: 200 Pa}
    beams: {azimuths: 5, elevations: 5}
  trajectory: {frames: 2, sonar: {kind: still, position: [0, 0, -6], heading: 90 deg}}
"""


def planned(*sets: str) -> ss.Plan:
    """The plan of the recipe with settings; signals alone."""
    text = RECIPE.replace("    beams", "".join(f"    {one}\n" for one in sets) + "    beams")
    return ss.plan(ss.loads(text), products=["signals"])


def recorded(plan: ss.Plan, silent: bool = False) -> tuple[Signals, Floats]:
    """Signals of the first frame, of sound that is zero if `silent`; and that sound."""
    from sonarsynth.pipeline import trace_frame

    traced = trace_frame(plan, 0)
    sound = frame_signals(plan, traced.frame, traced.arrivals)
    if silent:
        sound = replace(sound, pressure=0.0 * sound.pressure)
    return digitise(plan, traced.frame, sound), sound.pressure


def on_one_clock(signals: Signals, sound: Floats) -> Floats:
    """Sound in a window of its own, from 2.2 ms on for 4 ms, whatever the window that it was made in."""
    first = round((2.2e-3 - signals.start) * FS)
    return np.asarray(np.pad(sound, ((0, 0), (800, 800)))[:, 800 + first : 800 + first + 784])


def test_hydrophones_hear_where_they_are() -> None:
    moved = planned("sensor_errors: {position: 5 mm}")
    frame = moved.recipe.frame(0)[1]
    true, nominal = true_elements(moved, frame), moved.elements
    late = np.linalg.norm(true.position - nominal.position, axis=1)
    assert late.max() > 5e-3 and not (true.position - nominal.position)[:, 0].any()
    places = ", ".join(f"[{', '.join(f'{c:.12f}' for c in one)}]" for one in true.position)
    other = RECIPE.replace(
        "{kind: planar_lattice, columns: 3, rows: 2, pitch: 5 cm, face: 0 m}",
        f"{{kind: position_table, positions: [{places}]}}",
    )
    plans = (ss.plan(ss.loads(other), products=["signals"]), moved, planned())
    exact, got, plain = (on_one_clock(*recorded(one)) for one in plans)
    assert np.abs(got - exact).max() < 3e-3 * np.abs(exact).max()
    assert np.abs(plain - exact).max() > 0.1 * np.abs(exact).max(), "or places do not matter"


@pytest.mark.parametrize("directions", ["{kind: direction, bearing: 60 deg, elevation: 20 deg}", "{kind: surface}"])
def test_hydrophones_hear_noise_where_they_are(directions: str) -> None:
    """With what they are off along the axis as a delay. Of nominal places, beams of noise of one direction erred by up
    to 6 dB in random arrays whose places err by up to 2 cm."""
    text = RECIPE.replace("level: 40 dB", f"level: 100 dB, directions: {directions}")
    moved = ss.plan(ss.loads(text.replace("    beams", "    sensor_errors: {position: 5 mm}\n    beams")), ["signals"])
    frame = moved.recipe.frame(0)[1]
    places = ", ".join(f"[{', '.join(f'{c:.12f}' for c in one)}]" for one in true_elements(moved, frame).position)
    array = "{kind: planar_lattice, columns: 3, rows: 2, pitch: 5 cm, face: 0 m}"
    there = ss.plan(ss.loads(text.replace(array, f"{{kind: position_table, positions: [{places}]}}")), ["signals"])
    quiet, drawn = Signals(np.zeros((6, 4000), np.float32), 0.0, FS, 0.0, 0, 0), errors_of(moved, frame)
    got, exact = (digitise(one, one.recipe.frame(0)[1], quiet) for one in (moved, there))
    assert drawn is not None
    late = channel_errors.respond(exact, drawn, 1540.0).pressure
    np.testing.assert_allclose(got.pressure, late, rtol=0.0, atol=2.0 * got.quantum)


def test_all_dead_is_silence_and_electronics() -> None:
    quiet, _ = recorded(planned("sensor_errors: {dead: 1.0}"))
    assert not quiet.pressure.any()
    plan = planned("sensor_errors: {dead: 1.0}", "electronics: {level: 100 dB}")
    heard, _ = recorded(plan)
    alone, _ = recorded(planned("electronics: {level: 100 dB}"), silent=True)
    assert np.std(heard.pressure) == pytest.approx(0.1 * np.sqrt(60e3), rel=0.1)
    assert np.std(alone.pressure) == pytest.approx(np.std(heard.pressure), rel=0.05)


def test_elements_that_give_nothing_give_nothing_whatever_is_wrong_beside_them() -> None:
    """Cross-talk of their neighbours, and the number of a stuck channel, were in their records."""
    ship = "noise_sources: [{name: ship, motion: {kind: still, position: [9, 2, -1]}, sound: {kind: flat, level: 120}}]"
    text = RECIPE.replace("face: 0 m", "face: 0 m, dead: [1, 4]").replace("    sources", f"    {ship}\n    sources")
    wrong = "gain: 1 dB, delay: 1 us, stuck: 0.5, noisy: 0.3, cross_talk: -20 dB, jitter: 0.1 us, overload: {level: 1}"
    errors = f"electronics: {{level: 60 dB}}\n    sensor_errors: {{{wrong}}}"
    for seed in (1, 2):
        made = ss.loads(text.replace("    beams", f"    {errors}\n    beams") + f"seed: {seed}\n")
        heard, _ = recorded(ss.plan(made, products=["signals"]))
        assert heard.pressure.any(axis=1).tolist() == [True, False, True, True, False, True]


def test_electronics_and_errors_change_no_draw_of_the_ambient_noise() -> None:
    before, _ = recorded(planned())
    with_both, _ = recorded(planned("electronics: {level: -100 dB}", "sensor_errors: {noisy: 0.5}"))
    np.testing.assert_allclose(with_both.pressure, before.pressure, atol=1.01 * before.quantum)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("sensor_errors: {stuck: 0.1}", "describe a converter"),
        ("sensor_errors: {noisy: 0.1}", "describe electronics"),
        ("sensor_errors: {jitter: 20 us}", "over a period"),
        ("sensor_errors: {dead: 0.6, stuck: 0.5}", "more than all hydrophones"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(setting: str, message: str) -> None:
    text = RECIPE.replace("    converter: {bits: 16, full_scale: 200 Pa}\n", f"    {setting}\n")
    with pytest.raises(ss.RecipeError, match=message):
        ss.loads(text)


def test_what_is_wrong_is_stored_and_stuck_channels_give_one_number() -> None:
    setting = "sensor_errors: {gain: 1 dB, stuck: 0.5, known: gain}"
    plan = planned(setting)
    frames = [ss.render(plan, index) for index in (0, 1)]
    stored = [np.asarray(frame["truth/sensors/gain"]) for frame in frames]
    np.testing.assert_array_equal(*stored)  # drawn once a sequence
    state = np.asarray(frames[0]["truth/sensors/state"])
    assert SensorState.STUCK in state
    held = np.asarray(frames[0]["signals/pressure"])[state == SensorState.STUCK]
    assert (held == held[:, :1]).all()
    assert "sensors" not in ss.render(planned(), 0)["truth"].children


def test_a_baffle_weakens_what_comes_from_behind() -> None:
    behind = RECIPE.replace("position: [4, 1]", "position: [-4, 1]")
    text = behind.replace("    beams", "    baffle: 20 dB\n    beams")
    with_it, without = (recorded(ss.plan(ss.loads(one), products=["signals"]))[1] for one in (text, behind))
    np.testing.assert_allclose(with_it, 0.1 * without, atol=1e-5 * np.abs(without).max())
    ahead = recorded(planned("baffle: 20 dB"))[1]
    np.testing.assert_array_equal(ahead, recorded(planned())[1])


def test_the_electronics_rise_below_their_corner() -> None:
    from sonarsynth.signals.electronics import ElectronicNoise

    noise = ElectronicNoise(Electronics(level=30.0, corner=1e3))
    levels = 10.0 * np.log10(noise.density(np.array([10.0, 1e3, 1e6])) / 1e-12)
    np.testing.assert_allclose(levels, [50.04, 33.01, 30.0], atol=0.01)


def test_processing_goes_without_hydrophones_that_it_knows_to_be_dead() -> None:
    """With a fifth of 128 dead, the snap is located and beams are as loud as with none; untold, they are fainter."""
    tank = Path(__file__).resolve().parents[2] / "configs" / "tank.yaml"
    errors = [[], *([f"scene.sonar.sensor_errors={{dead: 0.2, known: {known}}}"] for known in ("gain", "none"))]
    trees = [ss.render(ss.plan(ss.load(tank, one), ["image"]), 0) for one in errors]
    whole, told, untold = (float(np.nanmax(tree["image/energy"].values, initial=0.0)) for tree in trees)
    assert [int(tree["source_estimates/usable"]) for tree in trees[:2]] == [1, 1]
    assert 10.0 * np.log10(told / whole) == pytest.approx(0.0, abs=0.7)
    assert untold < 0.8 * told
