"""The figures of a report, by plotly."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import Ints, evenly
from sonarsynth.detection.detection_method import angle_at
from sonarsynth.evaluation.detectors import true_objects
from sonarsynth.evaluation.detectors.true_objects import TrueObjects, category_names
from sonarsynth.pictures.report_figures.report_numbers import QUANTITIES

if TYPE_CHECKING:
    import xarray as xr
    from plotly.graph_objects import Figure

MOST_SHOWN: Final = 40
"""Frames of a film; of more, even steps."""
FAINTEST: Final = -30.0
"""dB re the brightest beam of a frame."""
COLOURS: Final = ("#3b6ea5", "#d98032", "#5a9a5a", "#8c6bb1")


def film(tree: xr.DataTree, frames: Ints) -> Figure | None:
    """Images of some frames with the boxes of the objects, to browse by a slider; None without images."""
    if "image" not in tree.children:
        return None
    import plotly.graph_objects as go

    chosen = frames[evenly(len(frames), MOST_SHOWN)]
    image = tree["image"].dataset
    azimuth, elevation = image["azimuth"].values, image["elevation"].values
    objects, names = true_objects(tree, chosen), [escape(name) for name in category_names(tree)]
    sequence, step = (np.asarray(tree[name].values) for name in ("trajectory", "step"))
    shown, steps = [], []
    for frame in chosen.tolist():
        energy = np.nan_to_num(image["energy"].isel(frame=frame).values)
        brightest = max(float(energy.max()), np.finfo(np.float32).tiny)
        level = 10.0 * np.log10(np.maximum(energy / brightest, 10.0 ** (FAINTEST / 10.0)))
        heat = go.Heatmap(
            x=azimuth, y=elevation, z=np.rint(level).astype(np.int8), zmin=FAINTEST, zmax=0, colorscale="Inferno",
            colorbar={"title": {"text": "dB re the brightest beam", "side": "right"}},
        )  # fmt: skip
        shown.append(go.Frame(data=[heat, _boxes(objects, frame, azimuth, elevation, names)], name=str(frame)))
        label = f"{frame}: sequence {sequence[frame]}, step {step[frame]}"
        now = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}}
        steps.append({"args": [[str(frame)], now], "label": label, "method": "animate"})
    figure = go.Figure(data=shown[0].data, frames=shown)
    figure.update_layout(
        height=560,
        margin={"t": 20},
        xaxis={"title": {"text": "azimuth (deg), port on the left"}, "autorange": "reversed", "constrain": "domain"},
        yaxis={"title": {"text": "elevation (deg)"}, "scaleanchor": "x", "constrain": "domain"},
        sliders=[{"steps": steps, "currentvalue": {"prefix": "frame "}, "pad": {"t": 40}}],
        showlegend=False,
    )
    return figure


def _boxes(objects: TrueObjects, frame: int, azimuth: np.ndarray, elevation: np.ndarray, names: list[str]) -> Any:
    """Outlines of the objects of a frame, with what they are."""
    import plotly.graph_objects as go

    x: list[float | None] = []
    y: list[float | None] = []
    texts: list[str] = []
    for row in np.flatnonzero(objects.frame == frame):
        x0, x1 = angle_at(objects.box[row][[0, 2]], azimuth).tolist()
        y0, y1 = angle_at(objects.box[row][[1, 3]], elevation).tolist()
        x += [x0, x1, x1, x0, x0, None]
        y += [y0, y0, y1, y1, y0, None]
        text = f"{names[objects.category[row]]}, {objects.range[row]:.1f} m, {objects.snr[row]:.1f} dB"
        texts += [text] * 6
    return go.Scatter(x=x, y=y, text=texts, mode="lines", line={"color": "#7fe0ff"}, hoverinfo="text")


def histograms(numbers: dict[str, Any]) -> Figure:
    """Categories, ranges, aspects, signal-to-noise ratios and visibility, by split."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(2, 3, subplot_titles=["category", *(f"{n} ({u})" for n, u in QUANTITIES.items())])
    for n, split in enumerate(numbers["splits"]):
        look = {"marker_color": COLOURS[n % len(COLOURS)], "legendgroup": split, "name": split}
        names = list(numbers["categories"])
        counts = [numbers["categories"][name].get(split, 0) for name in names]
        figure.add_trace(go.Bar(x=[escape(name) for name in names], y=counts, **look), 1, 1)
        for number, name in enumerate(QUANTITIES, 1):
            of = numbers["histograms"][name]
            edges = np.array(of["edges"])
            if len(edges):
                bar = go.Bar(x=0.5 * (edges[1:] + edges[:-1]), y=of["counts"].get(split, []), showlegend=False, **look)
                figure.add_trace(bar, 1 + number // 3, 1 + number % 3)
    figure.update_layout(barmode="stack", height=560)
    return figure


def range_errors(numbers: dict[str, Any]) -> Figure | None:
    """Root mean square errors of ranges, in tenths of the points by predicted error; None without points."""
    import plotly.graph_objects as go

    of = numbers["range_errors"]
    if not of["predicted"]:
        return None
    figure = go.Figure(go.Scatter(x=of["predicted"], y=of["rms"], mode="markers+lines", name="tenths of the points"))
    ends = [min(of["predicted"] + of["rms"]), max(of["predicted"] + of["rms"])]
    figure.add_trace(
        go.Scatter(x=ends, y=ends, mode="lines", line={"dash": "dot", "color": "#888"}, name="as predicted")
    )
    figure.update_xaxes(type="log", title={"text": "predicted standard error (m)"})
    figure.update_yaxes(type="log", title={"text": "rms error (m)"})
    figure.update_layout(height=420)
    return figure


def baselines(numbers: dict[str, Any]) -> Figure | None:
    """Objects found against false alarms, and by signal-to-noise ratio, with bands of 95 %; None without images."""
    if not numbers["baselines"]:
        return None
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    titles = ["found against false alarms a frame", "found at one false alarm a frame, by snr"]
    figure = make_subplots(1, 2, subplot_titles=titles)
    for n, (kind, of) in enumerate(numbers["baselines"].items()):
        look = {"marker_color": COLOURS[n % len(COLOURS)], "name": kind, "legendgroup": kind}
        rates = of["detection"]
        x = [row["false_alarms_a_frame"] for row in rates]
        figure.add_trace(go.Scatter(x=x, mode="lines+markers", **_banded(rates), **look), 1, 1)
        groups = of["by_snr"]
        bar = go.Bar(x=list(groups), showlegend=False, **_banded(list(groups.values())), **look)
        figure.add_trace(bar, 1, 2)
    figure.update_xaxes(type="log", row=1, col=1)
    figure.update_yaxes(range=[0, 1])
    figure.update_layout(height=420)
    return figure


def _banded(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Shares with their bands."""
    share = np.array([row["detected"] for row in rows])
    up, down = (np.array([row[name] for row in rows]) for name in ("high", "low"))
    return {"y": share, "error_y": {"array": up - share, "arrayminus": share - down, "symmetric": False}}
