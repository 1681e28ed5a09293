"""The snap at 1 m and what the filter leaves of it: waveform, spectrum, filter (figures 10 to 12 of the thesis)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble.pulses import Pulse, filtered, gain_for_level, reach, spectrum
from sonarsynth.equations.noise.filters import Fir, response
from sonarsynth.pictures.figures.style import INK, MARKS, figure, grid, label

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AS_MADE = Fir(0.0, 1e6, 0.2e6, 80.0)
"""The snap itself is drawn below 1.1 MHz: there is no more in a picture of a millisecond."""

AROUND = 0.1e-3
"""s of silence that is drawn either side."""

LOWEST_RESPONSE = -120.0
"""The filter is drawn down to this (dB)."""


def snap_figure(
    pulse: Callable[[float], Pulse],
    fir: Fir,
    source_level: float | None = None,
    *,
    before: float | None = None,
    after: float | None = None,
    highest: float = 200e3,
) -> Figure:
    """The snap at 1 m, scaled to `source_level` (dB re 1 uPa at 1 m peak; None: its own), before and after the filter.

    pulse: gives it for waves up to a frequency (Hz). Drawn from `before` to `after` the collapse (s; None: all of it,
    and 0.1 ms more), and up to `highest` (Hz).
    """
    fine, heard = pulse(reach(AS_MADE)), pulse(max(reach(fir), highest))
    gain = gain_for_level(fine, source_level)
    time = np.linspace(
        fine.start - AROUND if before is None else -before, fine.end + AROUND if after is None else after, 4001
    )
    frequency = np.linspace(highest / 800, highest, 800)
    passed = response(frequency, fir)
    density = gain * spectrum(frequency, heard)
    made = figure(12.0, 3.8, dpi=110)
    parts = made.add_gridspec(1, 3)
    panels = [made.add_subplot(parts[i]) for i in range(3)]
    _waveforms(panels[0], time, gain * filtered(time, fine, AS_MADE), gain * filtered(time, heard, fir))
    _levels(panels[1], frequency, _energy_level(density), _energy_level(density * passed))
    _response(panels[2], frequency, passed)
    return made


def _energy_level(density: np.ndarray) -> Floats:
    """Energy spectral density, both sides counted (dB re 1 uPa2 s/Hz), of a spectrum in Pa s."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(2.0 * np.abs(density) ** 2 / REFERENCE_PRESSURE**2))


def _waveforms(axes: Axes, time: Floats, snap: Floats, filtered: Floats) -> None:
    grid(axes)
    axes.plot(1e3 * time, 1e-3 * snap, color=INK, linewidth=1.0, label="snap")
    axes.plot(1e3 * time, 1e-3 * filtered, color=MARKS[0], linewidth=1.0, label="filtered")
    axes.legend(fontsize=8, frameon=False, loc="upper left")
    label(axes, "time after the collapse (ms)", "pressure at 1 m (kPa)", "waveform")


def _levels(axes: Axes, frequency: Floats, snap: Floats, filtered: Floats) -> None:
    grid(axes)
    axes.plot(1e-3 * frequency, snap, color=INK, linewidth=1.0, label="snap")
    axes.plot(1e-3 * frequency, filtered, color=MARKS[0], linewidth=1.0, label="filtered")
    top = float(snap.max())
    axes.set_ylim(top - 70.0, top + 5.0)
    axes.legend(fontsize=8, frameon=False, loc="lower left")
    label(axes, "frequency (kHz)", "energy density at 1 m (dB re 1 uPa2 s/Hz)", "spectrum")


def _response(axes: Axes, frequency: Floats, passed: Floats) -> None:
    grid(axes)
    with np.errstate(divide="ignore"):
        axes.plot(1e-3 * frequency, 20.0 * np.log10(np.abs(passed)), color=MARKS[1], linewidth=1.0)
    axes.set_ylim(LOWEST_RESPONSE, 5.0)
    label(axes, "frequency (kHz)", "response (dB)", "filter")
