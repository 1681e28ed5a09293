"""Rays as one page to turn, zoom and point at, by plotly: a file that any browser opens without a network."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.pictures.figures.outlines import union_outline
from sonarsynth.pictures.figures.style import ERROR_MAP, INK, PAGE_CONFIG, compass
from sonarsynth.pictures.ray_figures.ray_styles import FAN, Look, Style, drawing_order, highest_coefficient, styles
from sonarsynth.pictures.ray_figures.scene_drawing import AXES, BOTTOM, SURFACE, TRACK, VIEW
from sonarsynth.pictures.ray_figures.scene_geometry import SceneGeometry

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MOST_FACETS = 20_000
"""Facets of all targets that a page draws; of more, some are left out, evenly."""
EXAGGERATIONS = (1, 2, 5, 10)
EVERY = "all paths"
GREY = "#b8b8b8"
HERE = "<br>here: %{customdata[0]:.4f} ms, %{customdata[1]:.3f} m along, %{customdata[2]:.2f} deg up<extra></extra>"
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title></head>
<body style="margin:0">{figure}
<p style="font:12px sans-serif;color:#666;margin:4px 12px">Drag to turn, shift-drag to move, wheel to zoom, double-click
to reset. Point at a ray to read it; click on a name to hide it.</p></body></html>
"""


def page(rays: Mapping[str, Any], looks: Sequence[Look], geometry: SceneGeometry) -> str:
    """The page (HTML) of the rays that `ray_pictures.as_json` describes: in space, and in a section by the sound speed.

    plotly.js is in the page (5 MB), so that it is one file and needs no network.
    """
    drawn = page_figure(rays, looks, geometry).to_html(
        full_html=False, include_plotlyjs=True, div_id="rays", config=PAGE_CONFIG
    )
    return PAGE.format(title=escape(rays["title"]), figure=drawn)


def page_figure(rays: Mapping[str, Any], looks: Sequence[Look], geometry: SceneGeometry) -> Figure:
    """The figure of a page."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    specs = [[{"type": "scene", "colspan": 2}, None], [{}, {}]]
    sizes = {"row_heights": [0.66, 0.34], "column_widths": [0.16, 0.84]}
    fig = make_subplots(2, 2, specs=specs, horizontal_spacing=0.06, vertical_spacing=0.05, shared_yaxes=True, **sizes)
    profile = rays["profile"]
    paths: list[str] = []  # of each trace: the paths that it is of, or EVERY
    for line in _surroundings(geometry):
        fig.add_trace(line, row=1, col=1)
    fig.add_trace(
        go.Scatter(
            x=profile["speed"], y=-np.array(profile["depth"]), mode="lines", line_color=INK, name="", showlegend=False
        ),
        2,
        1,
    )
    for line in _section(rays, geometry):
        fig.add_trace(line, row=2, col=2)
    paths += [EVERY] * len(fig.data)
    named: set[str] = set()
    for path, style, group in _groups(rays["rays"], looks):
        for row, line in ((1, _in_space(group)), (2, _in_section(group, geometry))):
            line.update(line={"color": style.colour, "width": 3.0 * style.width if row == 1 else 1.5 * style.width})
            line.update(legendgroup=style.label, name=style.label, showlegend=style.label not in named)
            fig.add_trace(line, row, row)
            named.add(style.label)
            paths.append(path)
    _lay_out(fig, rays, geometry, paths, highest_coefficient(looks))
    return fig


def _groups(rays: Sequence[Mapping[str, Any]], looks: Sequence[Look]) -> Iterator[tuple[str, Style, list[Any]]]:
    """Rays of one path and one style, which are one line with gaps; the most important last."""
    drawn = styles(looks)
    by_style: dict[tuple[str, Style], list[Any]] = {}
    for i in drawing_order(looks):
        path = FAN if looks[i].family == FAN else str(rays[i]["name"])
        by_style.setdefault((path, drawn[i]), []).append(rays[i])
    return ((path, style, group) for (path, style), group in by_style.items())


def _joined(group: Sequence[Mapping[str, Any]]) -> tuple[Floats, dict[str, Any]]:
    """Points (point, xyz) of rays with a gap after each, and what is said of each point."""
    points, numbers, words = [], [], []
    for ray in group:
        columns = 1e3 * np.array(ray["time"]), ray["length"], np.rad2deg(np.array(ray["elevation"], float))
        points += [np.array(ray["position"], float), np.full((1, 3), np.nan)]
        numbers += [np.stack(columns, axis=1), np.full((1, 3), np.nan)]
        words += [*_words(ray), ""]
    options = {"text": words, "customdata": np.concatenate(numbers), "hovertemplate": "%{text}" + HERE, "mode": "lines"}
    return np.concatenate(points), options


def _words(ray: Mapping[str, Any]) -> list[str]:
    """What is said of a ray at each of its points."""
    ends = [f"{np.rad2deg(ray[f'{end}_elevation']):.2f} deg" for end in ("launch", "arrival")]
    lines = [
        f"{escape(ray['name'])}: {ray['family']}, {ray['vertices']}",
        f"{1e3 * ray['travel_time']:.4f} ms, {ray['path_length']:.3f} m; launch {ends[0]}, arrival {ends[1]}",
    ]
    if ray["transmission_loss"] is not None:
        lines.append(f"loss {ray['transmission_loss']:.1f} dB, level {ray['level']:.1f} dB re 1 uPa")
    if ray["coefficient"] is not None:
        lines.append(f"coefficient {ray['coefficient']:.3f}")
    text = "<br>".join([*lines, *ray["flags"]])
    return [text if event in ("launch", "") else f"{text}<br>{event}" for event in ray["event"]]


def _in_space(group: Sequence[Mapping[str, Any]]) -> Any:
    import plotly.graph_objects as go

    points, options = _joined(group)
    return go.Scatter3d(x=points[:, 0], y=points[:, 1], z=points[:, 2], **options)


def _in_section(group: Sequence[Mapping[str, Any]], geometry: SceneGeometry) -> Any:
    import plotly.graph_objects as go

    points, options = _joined(group)
    flat = geometry.on_plane(points)
    return go.Scatter(x=flat[:, 0], y=flat[:, 1], **options)


def _section(rays: Mapping[str, Any], geometry: SceneGeometry) -> Iterator[Any]:
    """Surface, bottom, targets and named places on the plane of the section."""
    import plotly.graph_objects as go

    quiet = {"showlegend": False, "hoverinfo": "name"}
    across = geometry.on_plane(np.concatenate([ray["position"] for ray in rays["rays"]]))[:, 0]
    for name, z, colour in (("surface", 0.0, SURFACE), ("bottom", -geometry.bottom, BOTTOM)):
        yield go.Scatter(x=[across.min(), across.max()], y=[z, z], mode="lines", line_color=colour, name=name, **quiet)
    for hull in geometry.hulls:
        for line in union_outline(geometry.on_plane(hull.vertices), hull.faces):
            shade = {"fill": "toself", "fillcolor": GREY, "mode": "lines", "line_color": INK, "line_width": 1}
            yield go.Scatter(x=line[:, 0], y=line[:, 1], name=escape(hull.name), **shade, **quiet)
    tops = {escape(hull.name): hull.vertices[hull.vertices[:, 2].argmax()] for hull in geometry.hulls}
    places = {**geometry.places, **tops}
    x, y = geometry.on_plane(np.array(list(places.values()))).T
    words = {"text": list(places), "mode": "markers+text", "textposition": "top center", "cliponaxis": False}
    yield go.Scatter(x=x, y=y, marker_color=INK, name="", zorder=1, **words, **quiet)


def _surroundings(geometry: SceneGeometry) -> Iterator[Any]:
    """Targets, hydrophones, names, tracks and field of view in space."""
    import plotly.graph_objects as go

    for hull, shown in zip(geometry.hulls, thinned_facets(geometry.hulls), strict=True):
        used, corner = np.unique(hull.faces[shown], return_inverse=True)
        x, y, z = hull.vertices[used].astype(np.float32).T
        i, j, k = corner.reshape(-1, 3).T
        shade = {"color": GREY, "flatshading": True, "hoverinfo": "name", "showlegend": True}
        note = "" if len(shown) == len(hull.faces) else f" ({len(shown)} of {len(hull.faces)} facets)"
        yield go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, name=escape(hull.name) + note, **shade)
    x, y, z = geometry.sensors.T
    dots = {"mode": "markers", "marker": {"size": 1.5, "color": INK}, "hoverinfo": "name"}
    yield go.Scatter3d(x=x, y=y, z=z, name=f"{len(x)} hydrophones", **dots)
    x, y, z = np.array(list(geometry.places.values())).T
    words = {"text": list(geometry.places), "mode": "markers+text", "textposition": "top right"}
    yield go.Scatter3d(x=x, y=y, z=z, marker={"size": 4, "color": INK}, hoverinfo="text", showlegend=False, **words)
    lines = [(f"track of {escape(name)}", track, TRACK, "dash") for name, track in geometry.tracks.items()]
    for name, line, colour, dash in [*lines, ("field of view", geometry.view["across"], VIEW, "dashdot")]:
        x, y, z = line.T
        look = {"mode": "lines", "line": {"color": colour, "dash": dash, "width": 2}, "hoverinfo": "name"}
        yield go.Scatter3d(x=x, y=y, z=z, name=name, **look)


def thinned_facets(hulls: Sequence[Hull]) -> list[np.ndarray]:
    """The facets of each target that are drawn: all, or evenly so many that all targets have MOST_FACETS."""
    total = sum(len(hull.faces) for hull in hulls)
    counts = [len(h.faces) * min(MOST_FACETS, total) // max(total, 1) for h in hulls]
    return [np.linspace(0, len(h.faces) - 1, max(n, 1)).astype(int) for h, n in zip(hulls, counts, strict=True)]


def _lay_out(
    fig: Figure, rays: Mapping[str, Any], geometry: SceneGeometry, paths: Sequence[str], strongest: float
) -> None:
    """Axes on one scale, menus for the vertical exaggeration and for the paths that are drawn."""
    points = [np.array(ray["position"]) for ray in rays["rays"]] + [hull.vertices for hull in geometry.hulls]
    every = np.concatenate([*points, geometry.view["across"], *geometry.tracks.values()])
    low, high = every.min(axis=0), every.max(axis=0)
    low[2], high[2] = -geometry.bottom, 0.0
    span = np.maximum(high - low, 0.02 * (high - low).max())
    shape = [dict(zip("xyz", 1.8 * span * [1, 1, k] / np.linalg.norm(span), strict=True)) for k in EXAGGERATIONS]
    taller = [
        {"label": f"heights x {k}", "method": "relayout", "args": [{"scene.aspectratio": ratio}]}
        for k, ratio in zip(EXAGGERATIONS, shape, strict=True)
    ]
    names = [EVERY, *dict.fromkeys(path for path in paths if path != EVERY)]
    chosen = [
        {"label": escape(n), "method": "restyle", "args": [{"visible": [n in (EVERY, p) or p == EVERY for p in paths]}]}
        for n in names
    ]
    menus = [{"buttons": taller, "x": 0.0}, {"buttons": chosen, "x": 0.16}]
    axes = {f"{axis}axis": {"title": name} for axis, name in zip("xyz", AXES, strict=True)}
    angle = geometry.bearing - 0.5 * np.pi + 0.4
    eye = {"x": 1.75 * np.cos(angle), "y": 1.75 * np.sin(angle), "z": 0.8}  # no name of an axis is cut off
    subtitle = f"frame {rays['frame']}, {len(rays['rays'])} rays"
    fig.update_layout(
        title={"text": f"{escape(rays['title'])}: {subtitle}", "font": {"size": 15}},
        template="plotly_white",
        height=900,
        margin={"l": 60, "r": 20, "t": 90, "b": 50},
        updatemenus=[{**menu, "y": 1.0, "yanchor": "bottom", "xanchor": "left"} for menu in menus],
        scene={
            **axes,
            "aspectmode": "manual",
            "aspectratio": shape[0],
            "camera": {"eye": eye, "center": {"x": 0, "y": 0, "z": -0.12}},
        },
        hoverlabel={"align": "left"},
        uirevision="same",  # menus leave the view as it was turned
    )
    fig.update_xaxes(title="sound speed (m/s)", tickformat=".6~g", nticks=4, row=2, col=1)
    fig.update_yaxes(title="up, z (m)", row=2, col=1)
    fig.update_xaxes(
        title=f"distance from the array towards {compass(geometry.bearing)} (m); heights on a scale of their own",
        row=2,
        col=2,
    )
    if strongest:
        scale = {"colorscale": ERROR_MAP, "cmin": 0.0, "cmax": strongest, "color": [0.0], "showscale": True}
        bar = {"title": "coefficient", "len": 0.4, "y": 0.35}
        fig.add_scatter(x=[None], y=[None], marker={**scale, "colorbar": bar}, showlegend=False, row=2, col=2)
