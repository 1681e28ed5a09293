"""Pictures of README and of the pages, drawn from small datasets: `tools/pages --pictures [NAME ...]`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import sonarsynth as ss
from sonarsynth.frontiers.frontier_report import write
from sonarsynth.pictures import _reference, _view
from sonarsynth.pictures.compare import show_beside
from sonarsynth.pictures.figures.frame_figure import FramePicture
from sonarsynth.pictures.figures.range_fan import draw_fan, range_fan
from sonarsynth.pictures.store_reading import beam_grid, opened, stored
from tools.page_building.label_pictures import labels
from tools.page_building.sea_pictures import choruses, noises
from tools.same_numbers import harbour

ROOT = Path(__file__).resolve().parents[2]
FRAMES = {
    "boat": 1,
    "remus": 40,
    "reef": 40,
    "thermocline": 40,
    "crowd": 0,
    "deep": 8,
    "tank": 0,
    "l_shape": 0,
    "grid": 3,
    "survey": 24,
    "harbour": 8,
    "ping": 31,
}
"""The frame of each shipped recipe that is drawn."""
GHOSTS = 46
"""The frame of thermocline.yaml whose ghosts are drawn."""
IMAGES = ("focused", "sub_band", "clean", "capon", "lp", "order_statistic")
"""Beamformers whose images of a frame of boat.yaml are drawn."""
SHADOW = (
    "scene.world.sources.0.position=[25 cm, 0 cm, -25 cm]",
    "scene.sonar.array={kind: planar_lattice, columns: 160, rows: 3, pitch: 1 cm}",
    "scene.sonar.beams={azimuth_span: 50 deg, azimuths: 161, elevation_span: 30 deg, elevations: 9}",
    "scene.sonar.ranges={near: 12 m, far: 24 m, step: 2 cm}",
    "accuracy.speckle=0.004",
)
"""Changes of ping.yaml that let a shadow be seen: a wide array, the transmitter so far ahead that its direct sound does
not clip at the ends of it, and as many scatterers as fill its beams."""
LAWS = {
    "lobe": "{kind: mirror_lobe, width: 30 deg}",
    "smooth": "{kind: kirchhoff}",
    "rough": "{kind: kirchhoff, roughness: 2 mm, slope: 0.2}",
}


def thumbnail(name: str, folder: Path, out: Path) -> None:
    """The energy image of a frame of a shipped recipe, 30 dB deep, with the boxes of the targets."""
    sets = list(harbour.written(folder)) if name == "harbour" else []
    recipe = ss.load(ROOT / "configs" / f"{name}.yaml", sets)
    if recipe.scene.sonar.ranges is not None:
        fan(name, ss.render(ss.plan(recipe, ["range_image"]), FRAMES[name]), out)
        return
    tree = ss.render(recipe, FRAMES[name])
    energy, boxes = tree["image/energy"], tree["truth/targets/image_box"].values
    decibels = 10 * np.log10(energy.values / energy.values.max())
    azimuth, elevation = energy["azimuth"].values, energy["elevation"].values
    figure, axes = plt.subplots(figsize=(1.6, 1.2), dpi=100)
    axes.pcolormesh(azimuth, elevation, decibels, vmin=-30, cmap="inferno", shading="nearest", rasterized=True)
    for left, right, low, high in boxes:
        axes.add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, color="cyan", linewidth=0.8))
    axes.set(xlim=(azimuth[-1], azimuth[0]), ylim=(elevation[0], elevation[-1]), xticks=[], yticks=[])
    figure.subplots_adjust(0, 0, 1, 1)
    figure.savefig(out / f"{name}.png", metadata={"Software": None})
    plt.close(figure)


def fan(name: str, tree: Any, out: Path) -> None:
    """The range image of a frame, with outlines of the cells of the targets."""
    image = tree["range_image"]
    cells = (image[variable].values for variable in ("range", "azimuth", "energy", "target"))
    figure, axes = plt.subplots(figsize=(1.6, 1.2), dpi=100)
    draw_fan(axes, *cells)
    axes.set(xticks=[], yticks=[])
    figure.subplots_adjust(0, 0, 1, 1)
    figure.savefig(out / f"{name}.png", metadata={"Software": None})
    plt.close(figure)


def thumbnails(folder: Path, out: Path) -> None:
    """One of each shipped recipe."""
    for name in FRAMES:
        thumbnail(name, folder, out)


def ghosts(folder: Path, out: Path) -> None:
    """A frame with every path, as a film shows it."""
    path = folder / "ghosts.zarr"
    ss.build(ss.load(ROOT / "configs" / "thermocline.yaml"), path, frames=[GHOSTS], workers=0)
    tree = opened(path)
    one = stored(tree, GHOSTS)
    view = _view(tree, one, _reference([one]))
    picture = FramePicture(*beam_grid(tree), [view], "energy re the brightest beam (dB)")
    picture.show(view)
    picture.figure.savefig(out / "ghosts.png", dpi=100, metadata={"Software": None})


def images(folder: Path, out: Path) -> None:
    """One frame of boat.yaml by every beamformer, 35 dB deep."""
    figure, panels = plt.subplots(2, 3, figsize=(8.4, 5.6), dpi=100, sharex=True, sharey=True, layout="compressed")
    for kind, panel in zip(IMAGES, panels.flat, strict=True):
        recipe = ss.load(ROOT / "configs" / "boat.yaml", [f"scene.processing.beamforming={{kind: {kind}}}"])
        energy = ss.render(recipe, FRAMES["boat"])["image/energy"]
        decibels = 10 * np.log10(np.maximum(energy / energy.max(), 1e-9))
        drawn = panel.pcolormesh(energy.azimuth, energy.elevation, decibels, vmin=-35, vmax=0, cmap="inferno")
        panel.set(title=kind, aspect="equal")
    panels[0, 0].invert_xaxis()
    figure.supxlabel("azimuth (deg), port on the left")
    figure.supylabel("elevation (deg)")
    figure.colorbar(drawn, ax=panels, label="dB re the brightest beam")
    figure.savefig(out / "images.png", metadata={"Software": None})
    plt.close(figure)


def shadow(folder: Path, out: Path) -> None:
    """A frame of ping.yaml by an array that is wide enough to see the shadow of the drum in the sand."""
    recipe = ss.load(ROOT / "configs" / "ping.yaml", SHADOW)
    image = ss.render(ss.plan(recipe, ["range_image"]), 5)["range_image"]
    cells = (image[variable].values for variable in ("range", "azimuth", "energy", "target"))
    picture = range_fan("sand", *cells, [target.name for target in recipe.scene.world.targets])
    picture.savefig(out / "shadow.png", dpi=100, metadata={"Software": None})
    plt.close(picture)


def laws(folder: Path, out: Path) -> None:
    """The pass of remus.yaml by three laws of scattering, side by side."""
    stores = [folder / f"{name}.zarr" for name in LAWS]
    for law, path in zip(LAWS.values(), stores, strict=True):
        sets = [f"scene.world.targets.0.scattering={law}", "accuracy.signal=0.02"]  # as in the table of accuracy.md
        recipe = ss.load(ROOT / "configs" / "remus.yaml", sets)
        ss.build(recipe, path, workers=0)
    (drawn,) = show_beside(stores, folder / "laws", film=False)
    drawn.replace(out / "laws.png")


def accuracy(folder: Path, out: Path) -> None:
    """Error against run time of tank.yaml, with the other programs that are installed."""
    measured = ss.accuracy(ss.load(ROOT / "configs" / "tank.yaml"), say=print)
    write(measured, folder, "accuracy")[1].replace(out / "accuracy.png")


def cloud(folder: Path, out: Path) -> None:
    """The points of all frames of remus.yaml, fused on the hull: from above, from the sonar's side, and from ahead."""
    path = folder / "remus.zarr"
    recipe = ss.load(ROOT / "configs" / "remus.yaml")
    ss.build(recipe, path, products="cloud", workers=0)
    tree = ss.open(path)
    points = ss.points(tree, relative_to="remus")
    own = points.isel(point=np.flatnonzero(points["target"].values == 0))
    mesh, place = tree["targets/remus"].dataset, own["position"].values
    edges = mesh["vertices"].values[mesh["faces"].values]
    time = np.asarray(tree["time"].values)[own["frame"].values]
    figure, axes = plt.subplots(2, 1, figsize=(8.4, 4.6), dpi=100, sharex=True, layout="compressed")
    for panel, (u, v, name) in zip(axes, ((0, 1, "to port (m)"), (0, 2, "up (m)")), strict=True):
        panel.add_collection(PolyCollection(edges[:, :, (u, v)], facecolor="0.93", edgecolor="0.82", linewidth=0.15))
        drawn = panel.scatter(place[:, u], place[:, v], c=time, s=9, cmap="viridis", linewidth=0)
        panel.set(aspect="equal", xlim=(-0.75, 0.75), ylim=(-0.2, 0.2), ylabel=name)
    axes[0].set_title(f"{len(place)} points of {tree.sizes['frame']} frames at 20 m, on the true hull", fontsize=11)
    axes[1].set_xlabel("forward (m)")
    figure.colorbar(drawn, ax=axes, label="time of the frame (s)")
    figure.savefig(out / "cloud.png", metadata={"Software": None})
    plt.close(figure)


def odds(folder: Path, out: Path) -> None:
    """Shares of windows in which the target of the thesis scene is found, by `tools/bench odds`: takes minutes."""
    from tools.benchmarks import odds as benchmark

    found = benchmark.bench(16)["rows"]
    (folder / "odds.json").write_text(json.dumps(found))
    draw_odds(found, out)


def draw_odds(found: list[dict[str, Any]], out: Path) -> None:
    """By density: for each distance and level the chorus alone, and at 10 m with reverberation and medians."""
    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.4), dpi=100, sharey=True, layout="constrained")
    alone = [row for row in found if row["case"] == "chorus"]
    styles = dict(zip((5.6, 10.0, 20.0), ("-", "--", ":"), strict=True))
    colours = dict(zip((194.6, 185.0, 175.0), ("#1f4e79", "#c55a11", "#7f7f7f"), strict=True))
    for level, distance in sorted({(row["level_db"], row["distance_m"]) for row in alone}, reverse=True):
        rows = [row for row in alone if (row["level_db"], row["distance_m"]) == (level, distance)]
        label = f"{level:g} dB, {distance:g} m"
        axes = [[row[name] for row in rows] for name in ("density", "brightest")]
        panels[0].plot(*axes, styles[distance], color=colours[level], marker="o", markersize=3, label=label)
    one = [row for row in found if row["level_db"] == 194.6 and row["distance_m"] == 10.0]
    for case in dict.fromkeys(row["case"] for row in one):
        rows = [row for row in one if row["case"] == case]
        axes = [[row[name] for row in rows] for name in ("density", "brightest")]
        panels[1].plot(*axes, marker="o", markersize=3, label="chorus alone" if case == "chorus" else case)
    panels[0].set_title("a snap of this level, so far from the target", fontsize=10, loc="left")
    panels[1].set_title("194.6 dB at 10 m", fontsize=10, loc="left")
    for panel in panels:
        panel.set(
            xscale="log",
            xlabel="density of other snaps (1/(m$^2$ s))",
            ylim=(-0.03, 1.42),
            yticks=np.arange(0.0, 1.1, 0.2),
        )
    panels[0].legend(fontsize=7, frameon=False, handlelength=3.0, ncols=3, loc="upper center")
    panels[1].legend(fontsize=7, frameon=False, ncols=2, loc="upper center")
    panels[0].set_ylabel("windows in which it is found")
    figure.savefig(out / "odds.png", metadata={"Software": None})
    plt.close(figure)


QUICK: dict[str, Callable[[Path, Path], None]] = {
    "thumbnails": thumbnails,
    "ghosts": ghosts,
    "images": images,
    "shadow": shadow,
    "labels": labels,
    "cloud": cloud,
    "noises": noises,
}
"""Two minutes of one core in all. Each takes a folder for datasets, and one for pictures."""
DRAWN = QUICK | {"laws": laws, "accuracy": accuracy, "odds": odds, "choruses": choruses}
"""All: the last four take minutes each, and tell of times, of many windows, or of sounds of seconds."""


def draw(names: Iterable[str]) -> None:
    """Draw some of them again, where README and pages have them."""
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            DRAWN[name](Path(folder), ROOT / ".github")


def likeness(one: Path, other: Path) -> float:
    """Correlation of the brightness of two pictures on 32 by 24 cells: 1 for the same, near 1 where only small things
    differ."""
    from PIL import Image

    cells = [np.asarray(Image.open(f).convert("L").resize((32, 24), Image.Resampling.BOX), float) for f in (one, other)]
    return float(np.corrcoef(cells[0].ravel(), cells[1].ravel())[0, 1])
