"""A recipe, looked at before it is built: its scenes, and what its frames would hold. No sound is simulated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, Progress
from sonarsynth.environment.casts import profile_of
from sonarsynth.equations.rays.ray_solutions import water
from sonarsynth.pictures.figures.style import TIGHT, save
from sonarsynth.pictures.preview_figures.distribution_figure import distribution_figure
from sonarsynth.pictures.preview_figures.overview_figure import Overview, overview_figure
from sonarsynth.pictures.ray_figures.scene_geometry import scene_geometry
from sonarsynth.planning.notes.scene_checks import read_inputs
from sonarsynth.products import SPLITS
from sonarsynth.recipe import Recipe, must_be_recipe
from sonarsynth.recipe.sampled_geometry import SEQUENCES, frame_of, sample_geometry
from sonarsynth.recipe.scene import Frame
from sonarsynth.store.files.place import write_atomically

MOST_DRAWN = 3
"""Scenes that are drawn, if there are more sequences."""
SNAP_STEPS = 16
"""Frames of a sequence whose snaps are drawn, if there are more."""


def preview(recipe: Recipe, out: Path | str = "preview", sequences: int = SEQUENCES) -> list[Path]:
    """Draw what a recipe would make: scenes of some sequences, and distributions of ranges, angles and views.

    No sound is simulated.

    Parameters
    ----------
    recipe: what is drawn.
    out: folder of the pictures.
    sequences: the most that the distributions are drawn from.

    Returns
    -------
    The files written.

    Raises
    ------
    FieldError for a scene that cannot be, ValueError for fewer than one sequence.
    """
    return draw_preview(recipe, Path(out), sequences)[0]


def draw_preview(
    recipe: Recipe, out: Path, sequences: int = SEQUENCES, progress: Progress = lambda *_: None
) -> tuple[list[Path], dict[str, Any]]:
    """Write `scene-<sequence>.png`, `distributions.png` and `preview.json`; their paths, and the numbers of the last.

    Scenes are those of the first, the middle and the last sequence. Raises FieldError.
    """
    must_be_recipe(recipe, "drawn")
    if sequences < 1:
        raise ValueError(f"sequences must be 1 or more, not {sequences}")
    read_inputs(recipe.scene_of(0))
    sampled = sample_geometry(recipe, sequences, progress)
    value = sampled.as_json()
    out.mkdir(parents=True, exist_ok=True)
    files = []
    for sequence in np.unique(np.linspace(0, recipe.sequences - 1, min(MOST_DRAWN, recipe.sequences)).astype(int)):
        files.append(out / f"scene-{sequence}.png")
        save(overview_figure(overview(recipe, int(sequence))), files[-1], **TIGHT)
    files += [out / "distributions.png", out / "preview.json"]
    save(distribution_figure(sampled), files[-2], **TIGHT)
    write_atomically(files[-1], (json.dumps(value, indent=2, allow_nan=False) + "\n").encode())
    return files, value


def overview(recipe: Recipe, sequence: int) -> Overview:
    """The scene of a sequence over its frames; the one in the middle is drawn whole. Raises FieldError."""
    scene = recipe.scene_of(sequence)
    last = recipe.steps(sequence) - 1
    middle = last // 2
    snap_steps = np.unique(np.linspace(0, last, SNAP_STEPS).astype(int)).tolist()
    frames = {step: frame_of(recipe, scene, sequence, step) for step in {*snap_steps, middle}}
    drawn = frames[middle]
    ahead = drawn.sonar_pose.turn_to_world([1.0, 0.0, 0.0])
    profile = profile_of(scene.world.environment.sound_speed)
    layers = water(profile.depth, profile.speed, scene.world.environment.depth)
    split = f", for {SPLITS[recipe.spanned.split[sequence]]}" if recipe.splits is not None else ""
    steps = f" (0 to {last})" if last else ""
    of = f"sequence {sequence} of {recipe.sequences}{split}, " if recipe.sequences > 1 else ""
    return Overview(
        title=f"{recipe.title or 'untitled'}: {of}frame {middle}{steps}",
        frame=middle,
        geometry=scene_geometry(scene, drawn, float(np.arctan2(ahead[1], ahead[0]))),
        boxes=_boxes([frames[step] for step in sorted({0, middle, last})]),
        snaps=np.array([snap.position for frame in frames.values() for snap in frame.moment.snaps]).reshape(-1, 3),
        depth=layers.depth,
        speed=layers.speed,
    )


def _boxes(frames: list[Frame]) -> dict[str, Floats]:
    """Corners (frame, corner, xyz) of the boxes of each target, once where they stay."""
    corners: dict[str, list[Floats]] = {}
    for frame in frames:
        for body in frame.moment.bodies:
            corners.setdefault(body.name, []).append(body.box)
    return {name: np.array(boxes if np.ptp(boxes, axis=0).any() else boxes[:1]) for name, boxes in corners.items()}
