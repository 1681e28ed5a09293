"""What the level of a collapse is of: the peak that an instrument hears, which the gas hardly changes."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, pulses
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.signals.filtered_pulse import snap_gains, snap_levels
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.state import Emission

GASES = (300.0, 1000.0, 3000.0)
EAR = Fir(0.0, 200e3, 20e3, 60.0)
"""A hydrophone of its own: not the filter that the level is of."""


def level(pressure: float) -> float:
    return float(20.0 * np.log10(pressure / 1e-6))


def collapsed(gas: float, depth: float = 5.0) -> Collapse:
    return bubble_collapse.collapse(Cavity(3.5e-3, gas, bubble_collapse.ambient_pressure(depth)), 1)


def heard(model: KellerMiksis, source_level: float) -> float:
    """Peak level (dB) of a snap with an imposed level, at 1 m, behind the hydrophone."""
    snap = Emission(np.zeros(3), 0.0, model, source_level, 1.0, 1.0)
    made = pulses.scaled(model.pulse(0.0, pulses.reach(EAR)), float(snap_gains((snap,))[0]), 1.0)
    return pulses.levels(made, EAR).peak


@pytest.mark.parametrize("frequency", [20e3, 200e3, 1e6])
@pytest.mark.parametrize(("gas", "depth"), [(0.0, 5.0), (100.0, 0.0), (2000.0, 5.0), (10e3, 100.0)])
def test_the_peak_is_that_of_the_filtered_spectrum(gas: float, depth: float, frequency: float) -> None:
    found = collapsed(gas, depth)
    low_pass = Fir(0.0, frequency, 0.2 * frequency, 80.0)
    top = pulses.reach(low_pass)
    f = np.arange(0.0, top, 500.0)
    S = pulses.spectrum(f, bubble_pulse.pulse(found, top)) * filters.response(f, low_pass)
    n = 1 << 17
    assert bubble_pulse.peak_below(found, frequency) == pytest.approx((np.fft.irfft(S, n) * n * 500.0).max(), rel=3e-4)


def test_it_tends_to_the_peak_itself_and_grows_up_to_there() -> None:
    for gas in (3000.0, 10e3):
        found = collapsed(gas)
        below = [bubble_pulse.peak_below(found, f) for f in (10e3, 30e3, 100e3, 300e3, 2e6)]
        top = bubble_pulse.peak(found)[1]
        assert all(np.diff(below) > 0.0)
        assert below[-1] == pytest.approx(top, rel=2e-3)


def test_an_imposed_level_is_heard_whatever_the_gas() -> None:
    of_band = [heard(KellerMiksis(gas_pressure=gas, depth=5.0), 190.0) for gas in GASES]
    of_peak = [heard(KellerMiksis(gas_pressure=gas, depth=5.0, level_below=None), 190.0) for gas in GASES]
    assert of_band == pytest.approx([190.0] * 3, abs=0.3)
    assert of_peak[0] < 175.0 and of_peak[2] - of_peak[0] > 10.0


def test_the_level_that_is_stored_is_of_the_same_peak() -> None:
    model = KellerMiksis(depth=5.0)
    raw, own = (
        Emission(np.zeros(3), 0.0, m, None, 1.0, 1.0) for m in (KellerMiksis(depth=5.0, level_below=None), model)
    )
    found = collapsed(2000.0)
    expected = level(bubble_pulse.peak(found)[1]), level(bubble_pulse.peak_below(found, 200e3))
    assert snap_levels((raw, own)) == pytest.approx(expected, abs=1e-9)
    assert expected == pytest.approx((209.83, 205.85), abs=0.01)


def test_what_it_is_of_changes_no_waveform() -> None:
    one, two = (KellerMiksis(level_below=f).pulse(5.0, 2e5) for f in (50e3, None))
    assert (one.strength == two.strength).all() and (one.time == two.time).all()
    assert one.peak < two.peak
    assert KellerMiksis(level_below=50e3).pulse(5.0, 3e5).peak == one.peak  # whatever waves the pulse is made for


def test_a_point_has_a_level_in_a_band_and_one_that_settles_has_none() -> None:
    point = collapsed(0.0)
    assert bubble_pulse.peak(point)[1] == np.inf
    assert 190.0 < level(bubble_pulse.peak_below(point, 200e3)) < 210.0
    with pytest.raises(ValueError, match="settles"):
        bubble_pulse.peak_below(bubble_collapse.collapse(Cavity(3.5e-3, 1000.0, 150e3, viscosity=100.0)), 200e3)


@pytest.mark.parametrize("wrong", [0.0, 500.0, 3e6, np.nan])
def test_its_frequency_is_bounded(wrong: float) -> None:
    with pytest.raises(ValueError, match="level_below"):
        KellerMiksis(level_below=wrong)
