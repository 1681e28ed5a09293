"""Where targets come to be in the frames of a recipe: ranges, angles and views, from poses and meshes alone.

Straight lines from the array centre to the targets, at the instant of the frame. No sound is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints, Progress, azimuth_elevation, counted, evenly
from sonarsynth.description import FieldError
from sonarsynth.geometry import Pose
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import SPLITS
from sonarsynth.randomness import share
from sonarsynth.receiver import BeamGrid
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.targets.target import NO_CATEGORY, Target

SEQUENCES = 1000
"""Sequences that are looked at, if there are more."""
FRAMES = 4000
"""Frames that are looked at, if there are more; at least two of each sequence."""
FACETS = 200
"""Facets of a mesh that stand for all, if there are more."""
QUANTITIES = {
    "range": ("m", "distance of the target's origin from the array centre"),
    "azimuth": ("degree", "of the target's origin, port positive"),
    "elevation": ("degree", "of the target's origin, up positive"),
    "aspect": ("degree", "direction of the sonar from the target: 0 bow, 90 port, -90 starboard"),
    "visible": ("1", "share of the area facing the array that is in the field of view and not behind another's box"),
}
"""Unit and meaning of what is known of each target in each frame."""


def group_of(target: Target) -> str:
    """The group that a target is counted in: its category, or its name where it is given none."""
    return target.name if target.category == NO_CATEGORY else target.category


@dataclass(frozen=True, eq=False)
class SampledGeometry:
    """Some frames of a recipe, and the targets that are in them; angles in deg."""

    recipe: Recipe
    sequence: Ints  # (frame,)
    step: Ints  # (frame,)
    frame: Ints  # (row,) which of these frames; a row is a target that is in a frame
    group: Ints  # (row,) index into groups
    groups: tuple[str, ...]
    columns: dict[str, Floats]  # (row,) of QUANTITIES

    @cached_property
    def split(self) -> Ints:
        """(frame,) index into SPLITS."""
        return np.asarray(self.recipe.spanned.split[self.sequence])

    @property
    def in_view(self) -> Ints:
        """(frame,) number of targets of which anything is visible."""
        return np.bincount(self.frame[self.columns["visible"] > 0.0], minlength=len(self.sequence))

    @property
    def how(self) -> str:
        """What was looked at, in a sentence."""
        recipe, sequences = self.recipe, len(np.unique(self.sequence))
        longest, steps = np.bincount(self.sequence).max(), int(recipe.spanned.steps.max())
        counts = [(sequences, recipe.sequences, "sequence"), (int(longest), steps, "step")]
        texts = [f"{n} of {counted(every, noun)}" if n < every else counted(n, noun) for n, every, noun in counts]
        spread = ", evenly sampled" if len(self.sequence) < recipe.frames else ""
        return f"{' x '.join(texts)}{spread}"

    def as_json(self) -> dict[str, Any]:
        """Numbers of each quantity, of all targets in view, by group and by split; frames by targets in view."""
        view = self.columns["visible"] > 0.0
        splits = self.split[self.frame]
        value: dict[str, Any] = {
            "title": self.recipe.title,
            "sequences": self.recipe.sequences,
            "frames": self.recipe.frames,
            "sampled_sequences": len(np.unique(self.sequence)),
            "sampled_frames": len(self.sequence),
            "targets": {
                name: {"frames": int(np.sum(self.group == i)), "frames_in_view": int(np.sum(view & (self.group == i)))}
                for i, name in enumerate(self.groups)
            },
            "sequences_by_split": dict(
                zip(SPLITS, np.bincount(self.recipe.spanned.split, minlength=len(SPLITS)).tolist(), strict=True)
            ),
            "targets_in_view": {"all": _counts(self.in_view)}
            | {name: _counts(self.in_view[self.split == i]) for i, name in enumerate(SPLITS)},
        }
        for name, (unit, meaning) in QUANTITIES.items():
            numbers = self.columns[name]
            counted_rows = np.ones(len(view), bool) if name == "visible" else view
            value[name] = {
                "unit": unit,
                "meaning": meaning,
                "all": _numbers(numbers[counted_rows]),
                "by_target": {
                    g: _numbers(numbers[counted_rows & (self.group == i)]) for i, g in enumerate(self.groups)
                },
                "by_split": {s: _numbers(numbers[counted_rows & (splits == i)]) for i, s in enumerate(SPLITS)},
            }
        return value


def sample_geometry(
    recipe: Recipe, sequences: int = SEQUENCES, progress: Progress = lambda *_: None, most_frames: int = FRAMES
) -> SampledGeometry:
    """Look at the targets of up to so many sequences of a recipe, and at up to `most_frames` frames of them.

    Of more sequences, one is drawn from each of as many equal parts, so that no entry of a grid is passed over; their
    steps are even. Raises FieldError for a scene that cannot be.
    """
    chosen = spread(recipe.sequences, max(sequences, 1))
    count = max(most_frames // len(chosen), 2)
    world = recipe.described.world
    drawn = [p.category(n) for p in world.populations for n in range(len(p.models))]
    groups = list(dict.fromkeys([*(group_of(target) for target in world.targets), *drawn]))
    rows: list[tuple[float, ...]] = []
    frames = [(int(n), step) for n in chosen for step in evenly(recipe.steps(n), count)]
    for number, frame in enumerate(frames):
        scene = recipe.scene_of(frame[0])
        for name, values in _targets_of(scene, frame_of(recipe, scene, *frame)):
            groups += [] if name in groups else [name]
            rows.append((number, groups.index(name), *values))
        progress(number + 1, len(frames), 0)
    table = np.array(rows, float).reshape(-1, 2 + len(QUANTITIES))
    sequence, step = np.array(frames).T
    return SampledGeometry(
        recipe,
        sequence,
        step,
        frame=table[:, 0].astype(int),
        group=table[:, 1].astype(int),
        groups=tuple(groups),
        columns=dict(zip(QUANTITIES, table[:, 2:].T, strict=True)),
    )


def spread(count: int, limit: int) -> Ints:
    """At most `limit` of the numbers below `count`: all, or one at random from each of `limit` equal parts."""
    if count <= limit:
        return np.arange(count)
    width = count / limit
    return np.array([int((i + share(0, "preview", i)) * width) for i in range(limit)])


def frame_of(recipe: Recipe, scene: Scene, sequence: int, step: int) -> Frame:
    """A frame of a scene of a recipe. Raises FieldError where a target has no mesh."""
    try:
        key = recipe.spanned.key(sequence)
        return scene.frame(
            step, index=recipe.first_frame(sequence) + step, trajectory=sequence, seed=recipe.seed, key=key
        )
    except FieldError:
        raise
    except (ValueError, OSError) as error:
        raise FieldError(("scene", "world", "targets"), str(error)) from None


def _targets_of(scene: Scene, frame: Frame) -> list[tuple[str, tuple[float, ...]]]:
    """Group and QUANTITIES of each target of a frame."""
    targets = {target.name: target for target in scene.world.targets}
    bodies, sonar = frame.moment.bodies, frame.sonar_pose
    targets_in_frame: list[tuple[str, tuple[float, ...]]] = []
    for body in bodies:
        own = sonar.to_body(body.pose.position)
        azimuth, elevation = np.rad2deg(azimuth_elevation(own))
        aspect = np.rad2deg(azimuth_elevation(body.pose.to_body(sonar.position))[0])
        others = [other for other in bodies if other is not body]
        visible = _visible(body, others, sonar, scene.sonar.beams)
        values = (float(np.linalg.norm(own)), float(azimuth), float(elevation), float(aspect), visible)
        targets_in_frame.append((group_of(targets[body.name]), values))
    return targets_in_frame


def _visible(body: PlacedTarget, others: list[PlacedTarget], sonar: Pose, beams: BeamGrid) -> float:
    """Share of the facing area in the spans of the beams and not behind the boxes of others, by some facets."""
    mesh = body.mesh
    facets = evenly(len(mesh.faces), FACETS)
    points = body.pose.to_world(mesh.centroid[facets])
    facing = np.einsum("ij,ij->i", sonar.position - points, body.pose.turn_to_world(mesh.normal[facets])) > 0.0
    area = np.where(facing, mesh.area[facets], 0.0)
    azimuth, elevation = azimuth_elevation(sonar.to_body(points))
    visible = (np.abs(azimuth) <= 0.5 * beams.azimuth_span) & (np.abs(elevation) <= 0.5 * beams.elevation_span)
    for other in others:
        visible &= ~_behind_box(other, sonar.position, points)
    return float(area[visible].sum() / area.sum()) if area.any() else 0.0


def _behind_box(body: PlacedTarget, start: Floats, points: Floats) -> Bools:
    """Whether the straight lines from a place (xyz) to points (point, xyz) pass through the oriented box of a body."""
    origin, ends = body.pose.to_body(start), body.pose.to_body(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = ((corner - origin) / (ends - origin) for corner in body.mesh.box)
    near, far = np.fmin(first, second).max(axis=1), np.fmax(first, second).min(axis=1)
    return np.asarray((near < far) & (far > 0.0) & (near < 1.0))


def _numbers(values: Floats) -> dict[str, float | int | None]:
    """How many, least, quartiles, greatest and mean; None of none."""
    names = ("least", "lower_quartile", "median", "upper_quartile", "greatest", "mean")
    if not len(values):
        return {"count": 0} | dict.fromkeys(names)
    figures = [*np.quantile(values, [0.0, 0.25, 0.5, 0.75, 1.0]).tolist(), float(values.mean())]
    return {"count": len(values)} | dict(zip(names, figures, strict=True))


def _counts(values: Ints) -> dict[str, int]:
    """How often each number is there."""
    number, count = np.unique(values, return_counts=True)
    return {str(n): int(c) for n, c in zip(number, count, strict=True)}
