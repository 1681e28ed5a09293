"""A measured snap beside the modelled one: waveform and spectrum, each normalised (figures 10 and 11 of the thesis)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import waveforms
from sonarsynth.equations.bubble.pulses import Pulse, filtered, reach
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.pictures.figures.style import INK, MARKS, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sonarsynth.sources.recordings import Recording

HALF = 100e-6
"""s before and after the collapse that are compared."""
HIGHEST = 400e3
"""Hz: snaps are compared below this, and below what the recording holds."""
STEPS = 40
"""Samples of a period of the highest frequency: as finely the snaps are laid over each other."""
FAINTEST = -40.0
"""Levels (dB re the highest of the measured snap) down to which spectra are compared."""


@dataclass(frozen=True, eq=False)
class SnapComparison:
    """A measured and a modelled snap, both behind one low pass, the model moved and scaled to fit best."""

    time: Floats  # (sample,) s after the peak of the recording
    measured: Floats  # (sample,) over its largest value
    modelled: Floats  # (sample,) over the same
    frequency: Floats  # (bin,) Hz
    measured_level: Floats  # (bin,) dB re the highest of the measured one
    modelled_level: Floats  # (bin,) dB re the same
    misfit: float  # rms of the difference over the rms of the measured snap
    level_misfit: float  # dB: rms of the difference of the levels in the band of the sonar
    inverted: bool  # the recording has the other sign

    def summary(self) -> str:
        """The misfits in one line."""
        sign = "; the recording is inverted" if self.inverted else ""
        return (
            f"rms misfit: waveform {100.0 * self.misfit:.3g} % of the measured snap over {2e6 * HALF:.0f} us, "
            f"spectrum {self.level_misfit:.2g} dB in the band{sign}"
        )


def compare_snaps(model: Callable[[float], Pulse], recording: Recording, band: tuple[float, float]) -> SnapComparison:
    """Compare a model (its pulse for waves up to a frequency) with a recording; band (Hz) of the sonar.

    Raises ValueError where the recording holds nothing of the band.
    """
    rate = recording.sampling_frequency
    high = min(0.4 * rate, HIGHEST)
    if high <= band[0]:
        raise ValueError(f"is sampled at {rate:g} Hz: it has nothing of the sonar's band, from {band[0]:g} Hz on")
    fir = Fir(0.0, high, 0.25 * high, 80.0)
    measured = waveforms.recorded(recording.pressure, rate, recording.zero, reach(fir))
    count = int(np.ceil(HALF * STEPS * high))
    time = np.arange(-count, count + 1) / (STEPS * high)
    m = filtered(time, measured, fir)
    m /= np.abs(m).max()
    s = filtered(np.concatenate([time[:-1] - HALF, time + HALF]), model(reach(fir)), fir)
    product = np.correlate(s, m, "valid")
    energy = np.convolve(s**2, np.ones(len(m)), "valid")
    best = int(np.argmax(np.abs(product) / np.sqrt(np.maximum(energy, 1e-12 * energy.max()))))
    fitted = s[best : best + len(m)] * product[best] / energy[best]
    frequency, levels = _levels(np.stack([m, fitted]), STEPS * high)
    inside = (frequency >= band[0]) & (frequency <= min(band[1], high)) & (levels[0] > FAINTEST)
    return SnapComparison(
        time=time,
        measured=m,
        modelled=fitted,
        frequency=frequency,
        measured_level=levels[0],
        modelled_level=levels[1],
        misfit=float(np.sqrt(np.mean((m - fitted) ** 2) / np.mean(m**2))),
        level_misfit=float(np.sqrt(np.mean((levels[0] - levels[1])[inside] ** 2))),
        inverted=bool(product[best] < 0.0),
    )


def _levels(waves: Floats, rate: float) -> tuple[Floats, Floats]:
    """Frequencies (bin,) in Hz, and energy of waves (wave, sample) in dB re the highest of the first (wave, bin)."""
    from scipy.signal.windows import tukey

    size = 8 * waves.shape[1]
    power = np.abs(np.fft.rfft(waves * tukey(waves.shape[1], 0.2), size, axis=1)) ** 2
    with np.errstate(divide="ignore"):
        return np.asarray(np.fft.rfftfreq(size, 1.0 / rate)), np.asarray(10.0 * np.log10(power / power[0].max()))


def draw_comparison(panels: tuple[Axes, Axes], comparison: SnapComparison, highest: float) -> None:
    """The waveforms and the spectra up to `highest` (Hz) on two axes."""
    waveform, levels = panels
    for axes, x, measured, modelled in (
        (waveform, 1e6 * comparison.time, comparison.measured, comparison.modelled),
        (levels, 1e-3 * comparison.frequency, comparison.measured_level, comparison.modelled_level),
    ):
        grid(axes)
        axes.plot(x, measured, color=INK, linewidth=1.0, label="measured" + " (inverted)" * comparison.inverted)
        axes.plot(x, modelled, color=MARKS[1], linewidth=1.0, label="modelled, fitted")
        axes.legend(fontsize=8, frameon=False)
    misfit = f"rms misfit {100.0 * comparison.misfit:.3g} % of the measured"
    label(waveform, "time after the peak of the recording (us)", "pressure, normalised", misfit)
    levels.set(xlim=(0.0, 1e-3 * highest), ylim=(FAINTEST, 5.0))
    label(
        levels,
        "frequency (kHz)",
        "energy density, normalised (dB)",
        f"rms misfit {comparison.level_misfit:.2g} dB in band",
    )
