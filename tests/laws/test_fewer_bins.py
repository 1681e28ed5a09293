"""Energies of beams from as few bins as short sound needs, against those from all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.imaging.delay_and_sum.fewer_bins import LONGEST, fewer_bins, weighted_bins
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.products import Signals
from sonarsynth.receiver import Romanis, Sonar, elements
from tests.heard import RATE, pulse_spectrum

ARRAY, SONAR = elements(Romanis()), Sonar(array=Romanis())
WINDOW = (0.5e-3, 6.0e-3)
FEW, ALL = (FocusedDelayAndSum(focus=None, bins=bins) for bins in ("few", "all"))


def echoes(seed, noise=0.0, again=0.0):
    """Plane waves of snaps, with flanks at both ends of the band, within 0.6 ms; and white noise all the time. again
    (s): so much later they come once more, of half the amplitude, from the other side."""
    rng = np.random.default_rng(seed)
    samples = 1400 if not again else 2400
    f = np.fft.rfftfreq(samples, 1 / RATE)
    spectra = np.zeros((ARRAY.count, len(f)), complex)
    for time, level in zip(rng.uniform(2.5e-3, 3.1e-3, 12), rng.uniform(0.1, 1.0, 12), strict=True):
        u = direction(*rng.uniform(-0.4, 0.4, 2))
        late = time - ARRAY.position @ u / SONAR.assumed_sound_speed
        spectra += level * pulse_spectrum(f) * np.exp(-2j * np.pi * f * late[:, None])
        if again:
            late = time + again + ARRAY.position @ (u * [-1, 1, 1]) / SONAR.assumed_sound_speed
            spectra += 0.5 * level * pulse_spectrum(f) * np.exp(-2j * np.pi * f * late[:, None])
    pressure = np.fft.irfft(spectra, samples, axis=1) * RATE
    pressure += noise * np.abs(pressure).max() * rng.standard_normal(pressure.shape)
    return Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)


@pytest.mark.parametrize("seed", range(4))
def test_short_echoes_have_the_energy_of_all_bins(seed):
    """Errors are those of the ends of the band: 0.001 dB rms within 20 dB of the brightest beam."""
    signals = echoes(seed)
    window = snapshots_of(signals, SONAR, *WINDOW)
    used = len(fewer_bins(window, ARRAY.aperture / SONAR.assumed_sound_speed).frequency)
    assert used < 0.51 * len(window.frequency)
    few, every = (method.image(signals, ARRAY, SONAR, *WINDOW).energy for method in (FEW, ALL))
    bright = every >= 1e-2 * every.max()
    assert np.sqrt(np.mean((10 * np.log10(few[bright] / every[bright])) ** 2)) < 0.003


LONG = 0.5e-3, 12.0e-3


@pytest.mark.parametrize("seed", range(3))
def test_silence_between_echoes_needs_no_bins(seed):
    """Echoes that come twice, 7.5 ms apart, of every second bin, which takes what is 5.8 ms apart for one."""
    signals = echoes(seed, again=7.5e-3)
    window = snapshots_of(signals, SONAR, *LONG)
    assert len(fewer_bins(window, 2e-4).frequency) < 0.51 * len(window.frequency)
    few, every = (method.image(signals, ARRAY, SONAR, *LONG).energy for method in (FEW, ALL))
    bright = every >= 1e-2 * every.max()
    assert np.sqrt(np.mean((10 * np.log10(few[bright] / every[bright])) ** 2)) < 0.01


@pytest.mark.parametrize("part", [2, 3, 4])
def test_echoes_that_fewer_bins_would_take_for_one_keep_more(part):
    """Of echoes 1/(k df) apart, every k-th bin tells no difference, whatever else is silent."""
    apart = 1.0 / (part * snapshots_of(echoes(0, again=4e-3), SONAR, *LONG).spacing)
    window = snapshots_of(echoes(0, again=apart), SONAR, *LONG)
    used = len(fewer_bins(window, 2e-4).frequency)
    assert abs(used * part / len(window.frequency) - 1) > 0.1


def test_noise_that_lasts_as_long_as_the_window_keeps_every_bin():
    signals = echoes(0, noise=0.01)
    few, every = (method.image(signals, ARRAY, SONAR, *WINDOW).energy for method in (FEW, ALL))
    np.testing.assert_array_equal(few, every)


@pytest.mark.parametrize(("bins", "step"), [(344, 3), (345, 4), (100, 6), (35, 2), (8003, 5)])
def test_sums_of_cosines_are_those_over_all_bins(bins, step):
    """Spectra of short sound are sums of these, of short ones more; without weights the ends err over twice as much."""
    some, weight = weighted_bins(bins, step)
    periods = np.linspace(0.0, LONGEST / step, 400)
    turns, share = 2 * np.pi * periods[:, None], 1.0 - periods / periods[-1]
    exact = np.exp(1j * turns * np.arange(bins)).sum(axis=1)
    sums = (step * np.exp(1j * turns * some) @ w for w in (weight, np.full(len(some), bins / (step * len(some)))))
    wrong, plain = (np.sqrt(np.mean(np.abs((found - exact) * share) ** 2)) for found in sums)
    assert wrong < 0.5 * plain
    assert (weight > 0.0).all()


def test_a_plan_takes_few_bins_only_where_they_are_as_good():
    """Left to a plan, bins are few; where these err by more than is allowed with any subarrays, so does the method."""
    from sonarsynth.description.method import Demand

    method, error = FocusedDelayAndSum().resolve(
        Demand(0.1, False, lambda m: 0.05 if m.subarrays == (2, 2) else 0.2, ARRAY)
    )
    assert (method, error) == (FocusedDelayAndSum(subarrays=(2, 2), bins="few"), 0.05)
    chosen = replace(method, bins="all")
    assert chosen.resolve(Demand(0.1, False, lambda m: 0.2, ARRAY)) == (chosen, 0.2)


@pytest.mark.parametrize("allowed", [0.5, 0.1, 0.03, 0.002])
@pytest.mark.parametrize("of_bins", [0.0, 0.02, 0.2])
def test_a_plan_keeps_what_is_allowed_where_any_subarrays_and_bins_do(allowed, of_bins):
    """Errors by subarrays fall with their number, those by few bins do not: few where these are allowed."""
    from sonarsynth.description.method import Demand

    def error(method):
        return np.hypot(0.4 / method.subarrays[0] ** 2, of_bins if method.bins == "few" else 0.0)

    method, found = FocusedDelayAndSum().resolve(Demand(allowed, False, error, ARRAY))
    assert found == error(method)
    assert found <= allowed
    assert (method.bins == "few") == (of_bins < allowed)
