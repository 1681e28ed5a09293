"""Products as they are stored: (group, name) to the array of one frame."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import NO_TARGET, Floats
from sonarsynth.products import (
    LINK_BUDGET,
    Arrivals,
    Echoes,
    EnergyImage,
    LinkBudget,
    PointCloud,
    PointLabels,
    Signals,
    SourceEstimates,
    Truth,
)

Values = dict[tuple[str, str], np.ndarray]
"""(group, name) to the array of one frame, without the frame axis."""


def table(group: str, **columns: object) -> Values:
    """Arrays of one group."""
    return {(group, name): np.asarray(value) for name, value in columns.items()}


def truth_values(truth: Truth) -> Values:
    """Truth."""
    stored = {name.removeprefix("beam_"): value for name, value in vars(truth).items()}
    stored["image_box"] = np.rad2deg(truth.image_box)
    return table("/truth", **stored)


def echo_values(echoes: Echoes, arrivals: Arrivals) -> Values:
    """Echoes of targets, and the errors of the expansions of arrivals: NaN, not infinite, where a sensor has no ray."""
    stored: dict[str, object] = {f"echo_{name}": np.rad2deg(getattr(echoes, name)) for name in ("azimuth", "elevation")}
    stored["echo_level"] = echoes.level
    for name in ("wavefront_error", "amplitude_error"):
        error = float(getattr(arrivals, name))
        stored[name] = error if np.isfinite(error) else float("nan")
    return table("/truth", **stored)


def link_budget_values(book: LinkBudget, measured: Floats | None) -> Values:
    """Levels; measured (snap, target + 1, family) in dB, or None where signals are not stored.

    A path so faint that single precision holds nothing of it (hundreds of dB down a lobe) has no measured level: NaN.
    """
    measures = {} if measured is None else {"measured_level": np.where(np.isneginf(measured), np.nan, measured)}
    return table(
        "/ledger",
        **{name: book.level[..., n] for n, name in enumerate(LINK_BUDGET)},
        paths=book.paths,
        error_bound=book.error_bound,
        isolated_facet=of_isolated(book, book.isolated.facet, NO_TARGET),
        isolated_level=book.isolated_level,
        **measures,
    )


def of_isolated(book: LinkBudget, values: np.ndarray, fill: float = np.nan) -> np.ndarray:
    """Values of the isolated paths of a ledger (path,) as a table (snap, target + 1, family)."""
    rows = np.full(book.isolated_level.shape, fill, values.dtype)
    rows[np.isfinite(book.isolated_level)] = values
    return rows


def signal_values(signals: Signals, counts: bool) -> Values:
    """Signals, as counts of the converter or in Pa."""
    pressure = np.rint(signals.pressure / signals.quantum).astype(np.int16) if counts else signals.pressure
    return table("/signals", pressure=pressure, start=signals.start, clipped=signals.clipped, outside=signals.outside)


def source_estimate_values(bearings: SourceEstimates) -> Values:
    """Bearings, in degrees."""
    columns = dict(vars(bearings))
    for name in ("azimuth", "azimuth_error", "elevation", "elevation_error"):
        columns[name] = np.rad2deg(columns[name])
    return table("/bearings", **columns)


def image_values(image: EnergyImage, direct_removed: bool) -> Values:
    """The image and its window; what may be left in it of the direct pulse, where that is taken out."""
    values = table("/image", energy=image.energy, start=image.start, stop=image.stop)
    return values | table("/image", remainder=np.float32(image.remainder)) if direct_removed else values


def cloud_values(cloud: PointCloud, labels: PointLabels) -> Values:
    """The cloud, each coordinate apart, and whose echo each point is."""
    x, y, z = np.moveaxis(cloud.position, -1, 0)
    columns = {name: value for name, value in vars(cloud).items() if name != "position"}
    return table("/cloud", **columns, x=x, y=y, z=z, **vars(labels))
