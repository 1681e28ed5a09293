"""One sheet of the figures of a soundscape: each measured, with its spread, over its model."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import erfc

from sonarsynth.equations.noise.stable_laws import exceedance
from sonarsynth.evaluation.soundscape.measured import PERCENT, MeasuredFigures
from sonarsynth.evaluation.soundscape.octaves import decibels
from sonarsynth.evaluation.soundscape.predicted import PASCAL, PredictedFigures, elevation_edges
from sonarsynth.pictures.figures.style import INK, MARKS, PALE, RAYS, figure, grid, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MODEL, HEARD, RECORDED = MARKS[1], INK, RAYS[0]
PARTS = (RAYS[2], RAYS[3], RAYS[4], RAYS[5], PALE)
SHOWN = 45.0
"""dB: parts of a spectrum so far below the loudest are out of the picture."""


@dataclass(frozen=True, eq=False)
class _Curve:
    """A sound in the panels."""

    figures: MeasuredFigures
    colour: str
    name: str
    zero: float  # dB re 1 uPa of the level 0 of its figures
    legend: str


def soundscape_figure(
    title: str, measured: MeasuredFigures, model: PredictedFigures, recording: MeasuredFigures | None = None
) -> Figure:
    """The sheet: spectrum, rates of loud arrivals, amplitudes, elevations, coherence, gaps."""
    sheet = figure(15.0, 8.6)
    panels = sheet.subplots(2, 3).ravel()
    for axes in panels:
        grid(axes)
    both = [
        _Curve(measured, HEARD, "sound", PASCAL, "sound"),
        *([_of_recording(recording, measured)] if recording else []),
    ]
    _spectrum(panels[0], both, model)
    _rates(panels[1], both, model)
    _amplitudes(panels[2], both)
    _elevations(panels[3], measured, model)
    _coherence(panels[4], measured, model)
    _gaps(panels[5], both, model)
    for axes in panels:
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7, frameon=False)
    sheet.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left")
    notes = [*measured.sound.notes, *(recording.sound.notes if recording else ())]
    levels = [f"{curve.name}: {_percentiles(curve.figures)}" for curve in both]
    sheet.supxlabel(fill("; ".join([*levels, *notes]), 230), fontsize=8, color=INK, x=0.01, ha="left")
    return sheet


def _of_recording(recording: MeasuredFigures, measured: MeasuredFigures) -> _Curve:
    """The curve of a recording; without calibration its mean level in 1/3 octaves is put at that of the sound."""
    if recording.sound.calibrated:
        return _Curve(recording, RECORDED, "recording", PASCAL, "recording")
    _, ours, theirs = np.intersect1d(measured.centres.round(3), recording.centres.round(3), return_indices=True)
    levels, others = measured.figures.octaves[ours], recording.figures.octaves[theirs]
    if not len(levels):
        levels, others = measured.figures.moments[:1], recording.figures.moments[:1]
    shift = float(np.mean(levels) - np.mean(others))
    return _Curve(recording, RECORDED, "recording", PASCAL + shift, "recording, shifted to the sound")


def _percentiles(data: MeasuredFigures) -> str:
    zero = PASCAL if data.sound.calibrated else 0.0
    levels = " / ".join(f"{level + zero:.1f}" for level in data.figures.percentiles)
    return f"{'/'.join(f'{p:g}' for p in PERCENT)} % of 1 ms levels {levels} {data.sound.unit}"


def _spectrum(axes: Axes, both: list[_Curve], model: PredictedFigures) -> None:
    first = both[0].figures
    for curve in both:
        data, colour, zero = curve.figures, curve.colour, curve.zero
        level = decibels(data.figures.density) + zero
        wide = 10.0 / np.log(10.0) * data.spread.density / np.maximum(data.figures.density, 1e-300)
        axes.fill_between(1e-3 * data.frequency, level - wide, level + wide, color=colour, alpha=0.2, linewidth=0)
        axes.plot(
            1e-3 * data.frequency,
            level,
            color=colour,
            linewidth=0.9,
            label=f"{curve.legend} ({data.sound.seconds:.3g} s)",
        )
        centre = 1e-3 * data.centres
        axes.errorbar(
            centre, data.figures.octaves + zero, data.spread.octaves, fmt="s", color=colour, markersize=4, capsize=2
        )
    total = decibels(model.density) + PASCAL
    for (name, density), colour in zip(model.parts.items(), PARTS * len(model.parts), strict=False):
        if len(model.parts) > 1 and (part_level := decibels(density) + PASCAL).max() > total.max() - SHOWN:
            axes.plot(1e-3 * first.frequency, part_level, color=colour, linewidth=0.8, label=name)
    axes.plot(1e-3 * first.frequency, total, "--", color=MODEL, linewidth=1.4, label="model")
    axes.set_ylim(total.max() - SHOWN, None)
    off = float(np.mean(first.figures.octaves - model.octaves)) if len(model.octaves) else float("nan")
    offset = f": {off:+z.1f} dB re model (+- {model.scatter:.1f} by chance)" if np.isfinite(off) else ""
    label(axes, "frequency (kHz)", "spectral level (dB re 1 uPa2/Hz)", f"spectrum, 1/3 octaves (squares){offset}")


def _rates(axes: Axes, both: list[_Curve], model: PredictedFigures) -> None:
    first = both[0].figures
    for curve in both:
        data, colour, zero = curve.figures, curve.colour, curve.zero
        positive = data.figures.rates > 0.0
        if not positive.any():
            continue
        x = data.levels[positive] + zero
        axes.errorbar(
            x,
            data.figures.rates[positive],
            data.spread.rates[positive],
            fmt="o",
            color=colour,
            capsize=2,
            label=curve.legend,
        )
    if model.rates is not None:
        positive = model.rates > 0.01 / first.sound.seconds
        axes.plot(first.levels[positive] + PASCAL, model.rates[positive], "--", color=MODEL, label="model")
    if axes.get_legend_handles_labels()[0]:
        axes.set_yscale("log")
        axes.set_ylim(0.1 / first.sound.seconds, None)
    else:
        _nothing(axes, "nothing is 14 dB over the mean")
    label(axes, f"peak level ({first.sound.unit})", "arrivals above it (1/s)", "loud arrivals at a hydrophone")


def _amplitudes(axes: Axes, both: list[_Curve]) -> None:
    titles = []
    for curve in both:
        data, colour, name, zero = curve.figures, curve.colour, curve.name, curve.zero
        x, figures = 10.0 ** (data.tail / 20.0), data.figures
        positive = figures.exceedance > 0.0
        axes.plot(
            data.tail[positive] + zero, figures.exceedance[positive], color=colour, linewidth=1.4, label=curve.legend
        )
        gauss = erfc(x / 10.0 ** (figures.moments[0] / 20.0) / np.sqrt(2.0))
        axes.plot(data.tail + zero, gauss, ":", color=colour, label="Gaussian of its power")
        alpha, scale = figures.stable
        exponent = "none"
        if np.isfinite(alpha):
            exponent = f"{alpha:.2f}"
            law = exceedance(x / 10.0 ** (scale / 20.0), float(alpha))
            axes.plot(data.tail + zero, law, "--", color=colour, linewidth=0.9, label=f"stable, alpha {exponent}")
        titles.append(f"{name}: alpha {exponent}; kurtosis {figures.moments[1]:.3g} over 3")
    axes.set_yscale("log")
    least = min(
        float(data.figures.exceedance[data.figures.exceedance > 0.0].min())
        for data in (curve.figures for curve in both)
    )
    axes.set_ylim(0.5 * least, 1.5)
    label(
        axes,
        f"magnitude ({both[0].figures.sound.unit})",
        "share above",
        "amplitudes; alpha of a stable law\n" + "\n".join(titles),
    )


def _elevations(axes: Axes, measured: MeasuredFigures, model: PredictedFigures) -> None:
    arrivals, edges = measured.sound.arrivals, elevation_edges()
    if arrivals is None or model.elevation is None:
        _nothing(axes, "no arrivals are known")
        label(axes, "elevation (deg)", "", "arrivals by elevation")
        return
    degrees = np.rad2deg(np.arcsin(edges))
    value, wide = arrivals.by_elevation(edges)
    middle = 0.5 * (degrees[1:] + degrees[:-1])
    axes.errorbar(middle[value > 0], value[value > 0], wide[value > 0], fmt="o", color=HEARD, capsize=2, label="sound")
    axes.stairs(model.elevation, degrees, color=MODEL, linestyle="--", label="model")
    if arrivals.above is None:
        law = np.array([_inverse_sine(a, b) for a, b in pairwise(edges.tolist())])
        axes.stairs(law * model.elevation.sum() / law.sum(), degrees, color=PALE, label="1/|sin|, same sum")
        of = "energy re a snap at 1 m"
    else:
        of = f"paths over {arrivals.above:.0f} dB"
    top = max(float(model.elevation.max()), float(value.max()))
    axes.set(yscale="log", ylim=(1e-4 * top, 3.0 * top))
    label(
        axes, "elevation (deg, up positive)", f"{of} in 10 deg", f"arrivals by elevation ({len(arrivals.sine)} paths)"
    )


def _inverse_sine(low: float, high: float, least: float = 0.005) -> float:
    """Integral of 1/|v| over sines, those that are smaller than `least` left out."""
    a, b = sorted((abs(low), abs(high)))
    return float(np.log(max(b, least) / max(a, least)))


def _coherence(axes: Axes, measured: MeasuredFigures, model: PredictedFigures) -> None:
    offset = measured.sound.position[measured.pairs] - measured.sound.position[0]
    away = np.linalg.norm(offset, axis=1)
    level = np.abs(offset[:, 2]) < 0.5 * away
    for n, (f, colour) in enumerate(zip(measured.at.tolist(), RAYS, strict=False)):
        for mask, mark, line, orientation in ((level, "o", "--", "across"), (~level, "^", ":", "up")):
            if not mask.any():
                continue
            order = np.flatnonzero(mask)[np.argsort(away[mask])]
            coherence, wide = measured.figures.coherence[n, order], measured.spread.coherence[n, order]
            text = f"{1e-3 * f:.3g} kHz {orientation}"
            axes.errorbar(away[order], coherence, wide, fmt=mark, color=colour, markersize=4, capsize=2, label=text)
            axes.plot(away[order], model.coherence[n, order], mark + line, color=colour, mfc="none", linewidth=0.8)
    if not len(away):
        _nothing(axes, "no hydrophones near enough to each other")
    label(axes, "distance of hydrophones (m)", "coherence, real part", "coherence (open marks, lines: model)")


def _gaps(axes: Axes, both: list[_Curve], model: PredictedFigures) -> None:
    titles = []
    for curve in both:
        data, colour, name, zero = curve.figures, curve.colour, curve.name, curve.zero
        gaps = np.sort(data.gaps)
        if not gaps.size:
            titles.append(
                f"{name}: too few that stand apart" if data.sound.running else f"{name}: frames are too short"
            )
            continue
        share = 1.0 - np.arange(len(gaps)) / len(gaps)
        axes.step(
            1e3 * gaps, share, where="post", color=colour, label=f"{curve.legend}, over {data.loud + zero:.0f} dB"
        )
        axes.plot(1e3 * gaps, np.exp(-gaps / gaps.mean()), ":", color=colour, label="Poisson of its rate")
        predicted = f" (model {model.fano:.1f})" if name == "sound" and np.isfinite(model.fano) else ""
        titles.append(f"{name}: Fano factor {data.figures.fano[0]:.2g} +- {data.spread.fano[0]:.1g}{predicted}")
    if axes.get_legend_handles_labels()[0]:
        axes.set(xscale="log", yscale="log")
    else:
        _nothing(axes, "no gaps")
    label(axes, "gap (ms)", "share of longer gaps", "gaps between loud arrivals\n" + "\n".join(titles))


def _nothing(axes: Axes, why: str) -> None:
    axes.text(0.5, 0.5, why, transform=axes.transAxes, ha="center", color=PALE)
    axes.set(xticks=[], yticks=[])
