"""Pulses of every kind of snap: exact spectra, filtered waveforms, levels, recordings, and how snaps vary."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.stats import kstest, truncnorm

from sonarsynth.equations.bubble import pulses, snap_pressure, waveforms
from sonarsynth.equations.bubble.snap_pressure import Bubble
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.randomness import stream
from sonarsynth.sources.recordings import read_recording
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation
from sonarsynth.sources.snap_pulses import largest_scales, scales
from tests.filtered import filtered_pulse

MODEL = LogarithmicBubble()
BUBBLE = Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)
FIR = Fir(0.0, 90e3, 20e3, 80.0)
FREQUENCY = np.linspace(0.0, 200e3, 1601)
EVERY = (MODEL, KellerMiksis(), Ricker(frequency=40e3), Gabor(frequency=50e3, cycles=3.0))


def ricker_spectrum(f: np.ndarray | float, frequency: float, peak: float) -> np.ndarray:
    u2 = (np.asarray(f) / frequency) ** 2
    return peak * 2.0 / np.sqrt(np.pi) / frequency * u2 * np.exp(-u2)


def gabor_spectrum(f: np.ndarray | float, frequency: float, cycles: float, peak: float) -> np.ndarray:
    s = cycles / frequency / np.sqrt(8.0 * np.log(2.0))
    both = [np.exp(-2.0 * (np.pi * s * (np.asarray(f) - sign * frequency)) ** 2) for sign in (1.0, -1.0)]
    return peak * s * np.sqrt(np.pi / 2.0) * (both[0] + both[1])


def test_logarithmic_bubble_is_that_of_its_own_module() -> None:
    got = MODEL.pulse(5.0, 200e3)
    own = snap_pressure.spectrum(FREQUENCY, BUBBLE)
    assert np.abs(pulses.spectrum(FREQUENCY, got) - own).max() < 1e-13 * np.abs(own).max()
    heard = MODEL.pulse(5.0, pulses.reach(FIR))
    t = np.linspace(-3e-4, 5e-5, 60)
    exact = filtered_pulse(t, BUBBLE, FIR)
    assert np.abs(pulses.filtered(t, heard, FIR) - exact).max() < 1e-6 * np.abs(exact).max()
    gain = pulses.gain_for_level(heard, 187.0)
    assert 20 * np.log10(gain * snap_pressure.peak(BUBBLE)[1] / 1e-6) == pytest.approx(187.0, abs=1e-9)


def test_ricker_and_gabor_have_their_exact_spectra() -> None:
    for frequency in (1e3, 40e3, 300e3):
        exact = ricker_spectrum(FREQUENCY, frequency, 2.0)
        got = pulses.spectrum(FREQUENCY, waveforms.ricker(frequency, 2.0, 200e3))
        assert np.abs(got - exact).max() < 1e-13 * 2.0 / frequency
        for cycles in (0.3, 3.0, 50.0):
            exact = gabor_spectrum(FREQUENCY, frequency, cycles, 2.0)
            got = pulses.spectrum(FREQUENCY, waveforms.gabor(frequency, cycles, 2.0, 200e3))
            assert np.abs(got - exact).max() < 2e-13 * 2.0 * cycles / frequency


@pytest.mark.parametrize("model", EVERY, ids=lambda m: m.kind)
def test_uneven_frequencies_give_the_same_spectrum(model: LogarithmicBubble) -> None:
    made = model.pulse(5.0, 200e3)
    even = pulses.spectrum(FREQUENCY, made)
    order = np.random.default_rng(1).permutation(FREQUENCY.size)
    assert np.abs(pulses.spectrum(FREQUENCY[order], made) - even[order]).max() < 1e-13 * np.abs(even).max()
    assert complex(pulses.spectrum(5e4, made)) == pytest.approx(even[400], abs=1e-13 * np.abs(even).max())
    assert pulses.spectrum(FREQUENCY[:1600].reshape(40, 40), made).shape == (40, 40)
    assert pulses.spectrum(np.zeros(0), made).shape == (0,)


@pytest.mark.parametrize("model", EVERY, ids=lambda m: m.kind)
def test_filtered_waveform_is_the_filtered_spectrum(model: LogarithmicBubble) -> None:
    made = model.pulse(5.0, pulses.reach(FIR))
    n, step = 4096, 1e-6
    f = np.fft.rfftfreq(n, step)
    inside = f <= pulses.reach(FIR)
    S = np.where(inside, pulses.spectrum(np.where(inside, f, 0.0), made) * filters.response(f, FIR), 0.0)
    p = np.fft.irfft(S, n) / step
    t = np.arange(-450, 600, 7)
    assert np.abs(pulses.filtered(t * step, made, FIR) - p[t]).max() < 2e-5 * np.abs(p).max()
    level, fine = pulses.levels(made, FIR), np.fft.irfft(S, 16 * n) * 16 / step
    assert level.peak == pytest.approx(20 * np.log10(np.abs(fine).max() / 1e-6), abs=1e-3)
    assert level.peak_to_peak == pytest.approx(20 * np.log10(np.ptp(fine) / 1e-6), abs=1e-3)
    before, after = pulses.support(made, FIR, 1e-4)
    loud = np.abs(pulses.filtered(np.array([-before - 1e-6, after + 1e-6]), made, FIR)) / np.abs(p).max()
    assert (loud <= 1.5e-4).all()


@pytest.mark.parametrize("model", EVERY, ids=lambda m: m.kind)
def test_scaling_stretches_the_spectrum(model: LogarithmicBubble) -> None:
    made = model.pulse(5.0, 200e3)
    f = FREQUENCY[FREQUENCY < 90e3]
    got = pulses.spectrum(f, pulses.scaled(made, 1.5, 2.0))
    assert got == pytest.approx(3.0 * pulses.spectrum(2.0 * f, made), abs=1e-12 * np.abs(got).max())


def test_a_shrimp_snaps_at_its_own_depth_unless_told() -> None:
    assert KellerMiksis().cavity(5.0).ambient_pressure == pytest.approx(101325.0 + 998.0 * 9.81 * 5.0)
    assert KellerMiksis(depth=2.0).cavity(5.0) == KellerMiksis().cavity(2.0)
    cored = KellerMiksis(gas_pressure=1000.0, core_ratio=8.86).cavity(5.0)
    assert cored.core == pytest.approx(74.30e-6, abs=5e-9)
    shallow, deep = (KellerMiksis().pulse(z, pulses.reach(FIR)) for z in (2.0, 20.0))
    assert deep.peak > shallow.peak and deep.start > shallow.start


def test_a_bubble_too_fast_for_its_equation_is_refused() -> None:
    with pytest.raises(ValueError, match=r"reaches 0\.739 times .* largest_mach 0\.5"):
        KellerMiksis(gas_pressure=100.0).collapse(5.0)
    assert KellerMiksis(gas_pressure=100.0, largest_mach=0.8).collapse(5.0).flag == 2
    with pytest.raises(ValueError, match="nothing stops"):
        KellerMiksis(gas_pressure=0.0, largest_mach=1e9).pulse(5.0, 1e5)
    with pytest.raises(ValueError, match="settles"):
        KellerMiksis(viscosity=100.0).pulse(5.0, 1e5)


def written(path: Path, rate: float, wave: np.ndarray, start: float = -2e-4) -> RecordedSnap:
    time = start + np.arange(wave.size) / rate
    rows = "\n".join(f"{1e6 * t:.6f}, {p:.10e}" for t, p in zip(time, wave, strict=True))
    path.write_text("# a snap\ntime (us), pressure (kPa)\n" + rows + "\n")
    return RecordedSnap(path=str(path), distance=2.0, time=0.0)


@pytest.mark.parametrize("highest", [200e3, 1e6])
def test_a_recording_of_a_known_pulse_has_its_spectrum(tmp_path: Path, highest: float) -> None:
    rate = 500e3
    time = -2e-4 + np.arange(201) / rate
    u = (np.pi * 40e3 * time) ** 2
    model = written(tmp_path / "snap.csv", rate, 3e-3 * (1 - 2 * u) * np.exp(-u))
    got = pulses.spectrum(FREQUENCY, model.pulse(5.0, highest))
    exact = ricker_spectrum(FREQUENCY, 40e3, 6.0)
    assert np.abs(got - exact).max() < 1e-7 * np.abs(exact).max()
    if highest > rate:
        above = pulses.spectrum(np.array([300e3, 700e3]), model.pulse(5.0, highest))
        assert np.abs(above).max() < 1e-7 * np.abs(exact).max()


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.uint8, np.float32])
def test_wave_files_of_every_kind(tmp_path: Path, kind: type) -> None:
    wave = np.zeros((400, 2))
    wave[180:220, 1] = np.hanning(40) * np.cos(np.arange(40)) * 0.9
    top = {np.int16: 32768.0, np.int32: 2.0**31, np.uint8: 128.0, np.float32: 1.0}[kind]
    data = (np.round(wave * top) + (128 if kind is np.uint8 else 0)) if top > 1 else wave
    wavfile.write(tmp_path / "snap.wav", 250_000, data.astype(kind))
    got = read_recording(RecordedSnap(path=str(tmp_path / "snap.wav"), pascals=50.0, distance=3.0, channel=1))
    assert got.sampling_frequency == 250e3
    assert got.pressure == pytest.approx(150.0 * wave[:, 1], abs=150.0 / min(top, 1e6))
    assert got.zero == np.abs(got.pressure).argmax()


def test_pressures_alone_and_a_fade(tmp_path: Path) -> None:
    path = tmp_path / "snap.txt"
    path.write_text("\n".join(f"{np.cos(0.3 * (i - 50)):.6f}" for i in range(101)))
    got = read_recording(RecordedSnap(path=str(path), sampling_frequency=1e5, fade=0.3, time=4e-4))
    assert got.pressure[0] == got.pressure[-1] == 0.0
    assert got.pressure[40:61] == pytest.approx(np.cos(0.3 * (np.arange(40, 61) - 50)), abs=1e-6)
    assert got.zero == pytest.approx(40.0)
    path.write_text("0\n0\n1\n0\n0\n")
    assert read_recording(RecordedSnap(path=str(path), sampling_frequency=1e5)).zero == 2.0  # a new file is read anew


def test_variation_has_its_distribution_and_one_part_leaves_the_other() -> None:
    both, level = SnapVariation(level=3.0, width=0.1), SnapVariation(level=3.0)
    got = scales(both, stream(3, "snap", 0), 20_000)
    law = truncnorm(-3, 3).cdf
    assert kstest(20 * np.log10(got.gain) / 3.0, law).pvalue > 1e-3
    assert kstest(np.log(got.width) / 0.1, law).pvalue > 1e-3
    assert abs(np.corrcoef(got.gain, got.width)[0, 1]) < 0.03
    alone = scales(level, stream(3, "snap", 0), 20_000)
    assert (alone.gain == got.gain).all() and (alone.width == 1.0).all()
    assert (scales(both, stream(3, "snap", 0), 7).width == got.width[:7]).all()
    gain, width = largest_scales(both)
    assert got.gain.max() <= gain and 1 / got.gain.min() <= gain * (1 + 1e-12)
    assert got.width.max() <= width and 1 / got.width.min() <= width * (1 + 1e-12)
    still = scales(SnapVariation(), stream(3, "snap", 0), 5)
    assert (still.gain == 1.0).all() and (still.width == 1.0).all()
