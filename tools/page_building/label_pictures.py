"""Pictures of tools/docs/reference/labels.md: boxes of targets, and what beams and sound meet of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import sonarsynth as ss
from sonarsynth.conventions import azimuth_elevation
from sonarsynth.geometry import Pose

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

ROOT = Path(__file__).resolve().parents[2]
COLOURS = ("tab:blue", "tab:orange", "tab:green")
NARROW = ("scene.sonar.beams.azimuth_span=8 deg", "scene.sonar.beams.azimuths=17")
TURNED = ("scene.world.targets.0.motion={kind: still, position: [20, 2.4, -4.5], heading: 130 deg}",)
BEFORE = ("scene.world.targets.1.motion={kind: still, position: [14, -1.9, -5.8], heading: 0 deg}",)
"""Of remus.yaml: a view that ends where the target is; a target that does not lie across. Of crowd.yaml: the ball is
before the crate."""


def truth(name: str, frame: int, sets: tuple[str, ...] = ()) -> xr.DataTree:
    """The truth of a frame of a shipped recipe."""
    recipe = ss.load(ROOT / "configs" / f"{name}.yaml", list(sets))
    return ss.render(ss.plan(recipe, products=()), frame)


def facets(tree: xr.DataTree, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (facet, 3, xyz) and normals (facet, xyz) of a target, sonar frame."""
    targets, sonar = tree["truth/targets"].dataset, tree["truth"].dataset
    mesh = tree[f"targets/{targets.target.values[number]}"].dataset
    body = Pose(targets.position.values[number], targets.orientation.values[number])
    array = Pose(sonar.sonar_position.values, sonar.sonar_orientation.values)
    corners = array.to_body(body.to_world(mesh.vertices.values))[mesh.faces.values]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def outline(axes: Axes, tree: xr.DataTree, number: int, colour: Any) -> None:
    """What of a target faces the array, in azimuth and elevation."""
    corners, normal = facets(tree, number)
    angles = np.rad2deg(np.stack(azimuth_elevation(corners), axis=-1))
    facing = np.einsum("ij,ij->i", normal, corners[:, 0]) < 0.0
    if not isinstance(colour, str):
        colour = np.array(colour)[facing]
    axes.add_collection(PolyCollection(angles[facing], facecolor=colour, edgecolor="face", linewidth=0.5))


def frame(axes: Axes, box: np.ndarray, **style: Any) -> None:
    """A box in angles (4,) deg."""
    left, right, low, high = box
    axes.add_patch(plt.Rectangle((left, low), right - left, high - low, fill=False, **style))


def boxes(out: Path) -> None:
    """Boxes of bodies that hide each other, of one that the view cuts, and from above."""
    figure, panels = plt.subplots(1, 3, figsize=(8.4, 2.9), dpi=80, layout="compressed")
    crowd, cut = truth("crowd", 0, BEFORE), truth("remus", 22, NARROW)
    for panel, tree in zip(panels, (crowd, cut), strict=False):
        targets, beams = tree["truth/targets"].dataset, tree["truth/beams"].dataset
        for n in np.argsort(-targets.box_centre.values[:, 0]):  # what is near over what is far
            colour = COLOURS[n]
            outline(panel, tree, n, colour)
            frame(panel, targets.full_box.values[n], edgecolor=colour, linestyle="--")
            frame(panel, targets.image_box.values[n], edgecolor="black", linewidth=1.2)
        edge = [beams.azimuth.values[i] for i in (0, -1)], [beams.elevation.values[i] for i in (0, -1)]
        frame(panel, np.concatenate(edge), edgecolor="0.6", linewidth=3)
        all_boxes = targets.full_box.values[-2:]
        low, high = all_boxes.min(axis=0), all_boxes.max(axis=0)
        panel.set(xlim=(high[1] + 0.7, low[0] - 0.7), ylim=(low[2] - 0.7, high[3] + 0.7), xlabel="azimuth (deg)")
    panels[0].set(
        ylabel="elevation (deg)",
        title=f"hidden: visible_fraction {float(crowd['truth/targets'].visible_fraction[2]):.2f}",
    )
    panels[1].set(title=f"cut off: truncation {float(cut['truth/targets'].truncation[0]):.2f}")
    above(panels[2])
    figure.savefig(out / "label_boxes.png", metadata={"Software": None})
    plt.close(figure)


def above(axes: Axes) -> None:
    """The oriented box from above, its yaw and the array's axis."""
    tree = truth("remus", 0, TURNED)
    one = tree["truth/targets"].dataset.isel(target=0)
    corners, _ = facets(tree, 0)
    axes.add_collection(PolyCollection(corners[:, :, (1, 0)], facecolor=COLOURS[0], edgecolor="face", linewidth=0.5))
    ring = one.box.values[[0, 4, 6, 2, 0]]
    axes.plot(ring[:, 1], ring[:, 0], color="black", linewidth=1.2)
    (x, y, _), yaw = one.box_centre.values, float(one.yaw)
    bow = np.array([np.sin(np.deg2rad(yaw)), np.cos(np.deg2rad(yaw))])
    arc = np.deg2rad(np.linspace(0.0, yaw, 50))
    axes.plot(y + 0.45 * np.sin(arc), x + 0.45 * np.cos(arc), color="tab:red")
    axes.annotate("", (y + bow[0], x + bow[1]), (y, x), arrowprops={"arrowstyle": "->", "color": "tab:red"})
    axes.plot([y, y], [x, x + 0.9], color="0.5", linestyle=":")
    axes.set(aspect="equal", xlim=(y + 1.1, y - 1.1), ylim=(x - 0.9, x + 1.2), title=f"from above: yaw {yaw:.0f} deg")
    axes.set(xlabel="to port, y (m)", ylabel="forward, x (m)")


def beams(out: Path) -> None:
    """Target and coverage of beams on a target, and what the snap lights of it."""
    tree = truth("remus", 32)
    grid, targets = tree["truth/beams"].dataset, tree["truth/targets"].dataset
    figure, panels = plt.subplots(1, 3, figsize=(8.4, 2.3), dpi=80, sharex=True, sharey=True, layout="compressed")
    for panel, values in zip(panels, (grid.target >= 0, grid.coverage), strict=False):
        panel.pcolormesh(grid.azimuth, grid.elevation, values, cmap="Blues", vmin=0, vmax=1.5, shading="nearest")
        outline(panel, tree, 0, "none")
        panel.collections[-1].set(edgecolor="0.3", linewidth=0.05)
    corners, normal = facets(tree, 0)
    sonar = tree["truth"].dataset
    array = Pose(sonar.sonar_position.values, sonar.sonar_orientation.values)
    source = array.to_body(tree["truth/emissions"].position.values[0])
    lit = np.einsum("ij,ij->i", normal, source - corners[:, 0]) > 0.0
    outline(panels[2], tree, 0, np.where(lit[:, None], [1.0, 0.75, 0.2], [0.35, 0.35, 0.4]))
    share = float(targets.lit_fraction.values[0, 0])
    for panel, title in zip(
        panels, ("target of the ray", "coverage of the cell", f"lit_fraction {share:.2f}"), strict=True
    ):
        panel.set(title=title, xlabel="azimuth (deg)")
    left, right, low, high = targets.full_box.values[0]
    panels[0].set(xlim=(right + 0.8, left - 0.8), ylim=(low - 0.8, high + 0.8), ylabel="elevation (deg)")
    figure.savefig(out / "label_beams.png", metadata={"Software": None})
    plt.close(figure)


def labels(folder: Path, out: Path) -> None:
    """All of them."""
    boxes(out)
    beams(out)
