"""What all pictures share: colours that colour-blind people can tell apart, levels, saving."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bytes, Floats
from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENERGY_MAP = "inferno"
ERROR_MAP = "viridis"
DYNAMIC_RANGE = 50.0
"""Levels are drawn from the reference down to this many dB below it."""

OUTLINES = ("#56c8ff", "#ffffff", "#8ff0a4", "#f7a8d8")
"""Outlines of targets, on the dark colours of the energy map."""

BACKDROP = "#12111c"
"""Background of clouds and rim of labels: the darkest colour of the energy map, a little lifted."""

RAYS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Lines that are told apart by colour (Okabe and Ito 2008)."""

MARKS = RAYS[:3]
"""A hit, a far hit, a miss."""

WINDS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")

PAGE_CONFIG = {"displaylogo": False, "responsive": True, "showSendToCloud": False, "plotlyServerURL": ""}
"""Nothing leads out of a page: plotly 7 has a button that sends it away."""

TIGHT: Final[dict[str, Any]] = {"bbox_inches": "tight", "pad_inches": 0.1}
"""How figures are saved whose axes leave a margin."""

INK = "#222222"
PALE = "#8a8a8a"


def decibels(energy: npt.ArrayLike, reference: float) -> Floats:
    """Energy (...) in dB re `reference` (the same unit); -inf for silence, NaN stays NaN."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return 10.0 * np.log10(np.asarray(energy, float) / reference)


def pressure_unit(peak: float) -> tuple[float, str]:
    """Factor on pressures (Pa) up to `peak`, and the unit in which they are drawn."""
    units = (1e3, "kPa"), (1.0, "Pa"), (1e-3, "mPa")
    size, unit = next((one for one in units if peak >= one[0]), (1e-6, "uPa"))
    return 1.0 / size, unit


def compass(bearing: float) -> str:
    """A horizontal direction (rad, from x to y: east to north) as people say it: "NE (045 deg)", from north by east."""
    degrees = float(np.rad2deg(0.5 * np.pi - bearing)) % 360.0
    return f"{WINDS[round(degrees / 22.5) % 16]} ({round(degrees) % 360:03d} deg)"


class BadEnding(ValueError):
    """The name of a file ends as that of no picture does; str() is one line."""


def figure(width: float, height: float, layout: str = "constrained", **more: Any) -> Figure:
    """An empty figure (inches) on its own Agg canvas: no window, no state shared with other figures. Where axes have
    places of their own, `layout` is "none", which spares a quarter of a second."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(width, height), layout=layout, **more)  # type: ignore[arg-type]
    FigureCanvasAgg(fig)
    return fig


def save(fig: Figure, out: Path, **options: Any) -> Path:
    """Write a figure into a file, all of it or nothing, and its folder; a PNG where the name does not say. Returns the
    file.

    Raises BadEnding for a name that ends as that of no picture.
    """
    file, known = out if out.suffix else out.with_suffix(".png"), fig.canvas.get_supported_filetypes()
    if file.suffix[1:].lower() not in known:
        raise BadEnding(f"{file}: is none of {', '.join(sorted(known))} (by its ending)")
    file.parent.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    fig.savefig(content, format=file.suffix[1:], **options)
    write_atomically(file, content.getvalue())
    return file


def settle(fig: Figure) -> None:
    """Give the axes of a figure their place, once: later drawings need not look for it."""
    engine = fig.get_layout_engine()
    if engine is not None:
        engine.execute(fig)
        fig.set_layout_engine("none")
    for axes in fig.axes:
        axes.apply_aspect()


def pixels(fig: Figure) -> Bytes:
    """A figure of `figure` as drawn: (row, column, rgba) uint8."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    assert isinstance(fig.canvas, FigureCanvasAgg)
    fig.canvas.draw()
    return np.array(fig.canvas.buffer_rgba())


def placed(onto: Figure, left: float, bottom: float, width: float, height: float, **more: Any) -> Any:
    """New axes in a place of a figure, in inches from its lower left corner."""
    w, h = onto.get_size_inches()
    return onto.add_axes((left / w, bottom / h, width / w, height / h), **more)


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Name the axes, thin the frame, put the title to the left."""
    axes.set_xlabel(x, fontsize=9, color=INK)
    axes.set_ylabel(y, fontsize=9, color=INK)
    axes.set_title(title, fontsize=10, color=INK, loc="left")
    axes.tick_params(which="both", labelsize=8, colors=INK)
    for side in axes.spines.values():
        side.set_color(PALE)
        side.set_linewidth(0.6)


def grid(axes: Axes) -> None:
    """A faint grid behind the lines."""
    axes.grid(True, color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
