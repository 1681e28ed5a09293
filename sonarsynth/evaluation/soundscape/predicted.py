"""What the model of a soundscape predicts, on the grids of the measured figures; and both as JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, finite_json
from sonarsynth.evaluation.soundscape.measured import PERCENT, MeasuredFigures
from sonarsynth.evaluation.soundscape.model import SoundModel
from sonarsynth.evaluation.soundscape.octaves import band_means, decibels

PASCAL = 120.0
"""dB re 1 uPa of 1 Pa."""
BINS = 18
"""Of the elevation, from -90 to 90 deg."""


@dataclass(frozen=True, eq=False)
class PredictedFigures:
    """What the model of a recipe says, at the grids of `MeasuredFigures`."""

    parts: dict[str, Floats]  # (bin,) Pa2/Hz
    octaves: Floats  # (band,) dB re 1 Pa2/Hz
    coherence: Floats  # (frequency, pair)
    rates: Floats | None  # (level,) 1/s; none without a chorus
    fano: float
    kurtosis: float  # excess, at most; NaN without a chorus
    root: float  # dB re 1 Pa: root mean square in the band
    scatter: float  # dB: of that, from one stretch as long as the sound to another, as snaps are few
    elevation: Floats | None  # (bin,) as `ArrivalElevations.by_elevation`; none where nothing is known of arrivals

    @property
    def density(self) -> Floats:
        """(bin,) Pa2/Hz of all parts."""
        return np.asarray(sum(self.parts.values()))


def elevation_edges() -> Floats:
    """Sines (bin + 1,) of the edges of bins of the elevation."""
    return np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, BINS + 1))


def predict(model: SoundModel, measured: MeasuredFigures) -> PredictedFigures:
    """The model's figures of a measured sound."""
    parts, sound, chorus = model.parts(measured.frequency), measured.sound, model.chorus
    density = np.asarray(sum(parts.values()))
    offset = sound.position[measured.pairs] - sound.position[0]
    square = float(np.trapezoid(density, measured.frequency))
    rates, fano, kurtosis, scatter, elevation = None, float("nan"), float("nan"), 0.0, None
    if chorus is not None:
        counts = chorus.loud(measured.levels + PASCAL)
        rates = np.array([count.rate for count in counts])
        if chorus.chorus.clusters is None and not np.isnan(measured.loud):
            fano = counts[int(np.argmin(np.abs(measured.levels - measured.loud)))].fano
        share = float(np.trapezoid(parts["chorus"], measured.frequency)) / square
        kurtosis = chorus.reach.kurtosis * share**2
        scatter = 10.0 / np.log(10.0) * float(np.sqrt(kurtosis * chorus.pulse_duration / sound.seconds))
        if (listed := sound.arrivals) is not None:
            edges = elevation_edges()
            above = listed.above
            elevation = (
                chorus.energies(edges, listed.seconds) if above is None else chorus.counts(edges, listed.seconds, above)
            )
    return PredictedFigures(
        parts=parts,
        octaves=10.0 * np.log10(band_means(measured.frequency, density, measured.edges)),
        coherence=np.stack([model.coherence(f, offset) for f in measured.at.tolist()]),
        rates=rates,
        fano=fano,
        kurtosis=kurtosis,
        root=10.0 * float(np.log10(square)),
        scatter=scatter,
        elevation=elevation,
    )


def as_json(measured: MeasuredFigures, predicted: PredictedFigures | None = None) -> dict[str, Any]:
    """Numbers for programs; null where there is none. Levels in dB re 1 uPa, or re full scale without calibration."""
    sound, figures, spread = measured.sound, measured.figures, measured.spread
    zero = PASCAL if sound.calibrated else 0.0
    model = predicted or PredictedFigures({}, np.zeros(0), np.zeros((0, 0)), None, np.nan, np.nan, np.nan, np.nan, None)
    report: dict[str, Any] = {
        "seconds": sound.seconds,
        "hydrophones": len(sound.position),
        "levels": sound.unit,
        "notes": list(sound.notes),
        "spectrum": {
            "frequency_hz": measured.frequency,
            "level_db": decibels(figures.density) + zero,
            "spread_db": 10.0 / np.log(10.0) * spread.density / np.maximum(figures.density, 1e-300),
            "model_db": decibels(model.density) + zero if model.parts else None,
            "parts_db": {name: decibels(part) + zero for name, part in model.parts.items()},
        },
        "third_octaves": {
            "centre_hz": measured.centres,
            "level_db": figures.octaves + zero,
            "spread_db": spread.octaves,
            "model_db": model.octaves + zero if predicted else None,
        },
        "peak_rates": {
            "level_db": measured.levels + zero,
            "per_second": figures.rates,
            "spread": spread.rates,
            "model": model.rates,
        },
        "amplitude": {
            "level_db": measured.tail + zero,
            "exceedance": figures.exceedance,
            "spread": spread.exceedance,
            "rms_db": figures.moments[0] + zero,
            "rms_spread_db": spread.moments[0],
            "rms_model_db": model.root + zero,
            "rms_model_scatter_db": model.scatter,
            "excess_kurtosis": figures.moments[1],
            "excess_kurtosis_spread": spread.moments[1],
            "excess_kurtosis_model_at_most": model.kurtosis,
            "stable_fit": {
                "alpha": figures.stable[0],
                "alpha_spread": spread.stable[0],
                "scale_db": figures.stable[1] + zero,
                "scale_spread_db": spread.stable[1],
            },
        },
        "millisecond_levels": {
            "percent": list(PERCENT),
            "level_db": figures.percentiles + zero,
            "spread_db": spread.percentiles,
        },
        "coherence": {
            "frequency_hz": measured.at,
            "offset_m": sound.position[measured.pairs] - sound.position[0],
            "value": figures.coherence,
            "spread": spread.coherence,
            "model": model.coherence if predicted else None,
        },
        "loud_arrivals": {
            "above_db": measured.loud + zero,
            "gaps_s": np.sort(measured.gaps),
            "fano_factor": figures.fano[0],
            "fano_spread": spread.fano[0],
            "fano_model": model.fano,
        },
    }
    if (listed := sound.arrivals) is not None:
        edges = elevation_edges()
        value, chance = listed.by_elevation(edges)
        report["elevation"] = {
            "edges_deg": np.rad2deg(np.arcsin(edges)),
            "of": "energy" if listed.above is None else f"paths over {listed.above:.1f} dB re 1 uPa",
            "value": value,
            "spread": chance,
            "model": model.elevation,
        }
    plain: dict[str, Any] = finite_json(report)
    return plain
