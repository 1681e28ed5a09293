"""The snap at 1 m and what the filter leaves of it: waveform, spectrum, filter (figures 10 to 12 of the thesis)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble.pulses import Pulse, filtered, gain_for_level, levels, reach, spectrum, support
from sonarsynth.equations.noise.filters import Fir, response
from sonarsynth.pictures.figures.snap_comparison import SnapComparison, draw_comparison
from sonarsynth.pictures.figures.style import INK, MARKS, figure, grid, label, pressure_unit

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AS_MADE = Fir(0.0, 1e6, 0.2e6, 80.0)
"""The snap itself is drawn below 1.1 MHz."""

LOUD = 0.1
"""Of the peak: as long as a pulse exceeds that, it is drawn."""
AROUND = 100e-6
"""s that are drawn before and after the collapse."""

HIGHEST = 200e3
"""Hz: spectra are drawn up to this."""

WITHIN = 10.0
"""dB under the highest level: down to there a bandwidth reaches."""

LOWEST_RESPONSE = -120.0
"""The filter is drawn down to this (dB)."""


def snap_figure(
    pulse: Callable[[float], Pulse],
    fir: Fir,
    source_level: float | None = None,
    comparison: SnapComparison | None = None,
) -> Figure:
    """The snap at 1 m, scaled to `source_level` (dB re 1 uPa at 1 m peak; None: its own), before and after the filter.

    pulse: gives it for waves up to a frequency (Hz). Drawn for 200 us about the collapse, or while it is loud, up to
    `HIGHEST`, with level, width and bandwidth; under it, where there is one, a comparison with a measured snap.
    """
    fine, received = pulse(reach(AS_MADE)), pulse(max(reach(fir), HIGHEST))
    gain = gain_for_level(fine, source_level)
    before, after = (max(AROUND, 1.1 * lasts) for lasts in support(received, fir, LOUD))
    time = np.linspace(-before, after, 4001 if before == after == AROUND else 20001)
    frequency = np.linspace(HIGHEST / 800, HIGHEST, 800)
    passed = response(frequency, fir)
    density = gain * spectrum(frequency, received)
    rows = 1 if comparison is None else 2
    fig = figure(12.0, 4.2 * rows, dpi=110)
    layout = fig.add_gridspec(rows, 3)
    panels = [fig.add_subplot(layout[0, i]) for i in range(3)]
    snaps = {"snap": (fine, AS_MADE), "filtered": (received, fir)}
    waves = {name: gain * filtered(time, *snap) for name, snap in snaps.items()}
    decibels = {name: 20.0 * np.log10(gain) + np.array(levels(*snap)) for name, snap in snaps.items()}
    _waveforms(panels[0], time, waves, decibels)
    _levels(panels[1], frequency, {"snap": _energy_level(density), "filtered": _energy_level(density * passed)})
    _response(panels[2], frequency, passed)
    if comparison is not None:
        draw_comparison((fig.add_subplot(layout[1, 0]), fig.add_subplot(layout[1, 1])), comparison, HIGHEST)
    return fig


def half_width(time: Floats, pressure: Floats) -> float:
    """How long (s) a pulse stays above half its largest size about it: full width at half maximum."""
    size = np.abs(pressure)
    top = int(np.argmax(size))
    low = np.flatnonzero(size < 0.5 * size[top])
    before, after = low[low < top], low[low > top]
    if not len(before) or not len(after):
        return float("nan")
    ends = [
        np.interp(0.5 * size[top], size[[i, i + d]], time[[i, i + d]]) for i, d in ((before[-1], 1), (after[0], -1))
    ]
    return float(ends[1] - ends[0])


def bandwidth(frequency: Floats, level: Floats) -> tuple[float, float]:
    """Lowest and highest frequency (Hz) at which levels (frequency,) are `WITHIN` of the highest."""
    loud = frequency[level >= level.max() - WITHIN]
    return float(loud[0]), float(loud[-1])


def _energy_level(density: np.ndarray) -> Floats:
    """Energy spectral density, both sides counted (dB re 1 uPa2 s/Hz), of a spectrum in Pa s."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(2.0 * np.abs(density) ** 2 / REFERENCE_PRESSURE**2))


def _waveforms(axes: Axes, time: Floats, waves: dict[str, Floats], decibels: dict[str, Floats]) -> None:
    grid(axes)
    factor, unit = pressure_unit(max(float(np.abs(wave).max()) for wave in waves.values()))
    for (name, wave), colour in zip(waves.items(), (INK, MARKS[0]), strict=True):
        (peak, both), width = decibels[name], half_width(time, wave)
        text = f"{name}: peak {peak:.1f} dB, peak to peak {both:.1f} dB,\n{1e6 * width:.3g} us wide at half the peak"
        axes.plot(1e6 * time, factor * wave, color=colour, linewidth=1.0, label=text)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.4 * (high - low))  # room for the legend
    axes.legend(fontsize=7.5, frameon=False, loc="upper left")
    label(axes, "time after the collapse (us)", f"pressure at 1 m ({unit})", "waveform, dB re 1 uPa at 1 m")


def _levels(axes: Axes, frequency: Floats, densities: dict[str, Floats]) -> None:
    grid(axes)
    for (name, level), colour in zip(densities.items(), (INK, MARKS[0]), strict=True):
        low, high = bandwidth(frequency, level)
        text = f"{name}: {1e-3 * low:.3g} to {1e-3 * high:.3g} kHz within {WITHIN:g} dB"
        axes.plot(1e-3 * frequency, level, color=colour, linewidth=1.0, label=text)
    top = float(densities["snap"].max())
    axes.set_ylim(top - 70.0, top + 18.0)
    axes.legend(fontsize=7.5, frameon=False, loc="upper right")
    label(axes, "frequency (kHz)", "energy density at 1 m (dB re 1 uPa2 s/Hz)", "spectrum")


def _response(axes: Axes, frequency: Floats, passed: Floats) -> None:
    grid(axes)
    with np.errstate(divide="ignore"):
        axes.plot(1e-3 * frequency, 20.0 * np.log10(np.abs(passed)), color=MARKS[1], linewidth=1.0)
    axes.set_ylim(LOWEST_RESPONSE, 5.0)
    label(axes, "frequency (kHz)", "response (dB)", "filter")
