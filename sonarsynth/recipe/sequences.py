"""The sequences of a recipe: which point of the grid each is, what is drawn for it, and its scene.

Everything random of a sequence is keyed by its `key`: the values of its grid point and the number of the repeat, as
written. So neither the order of entries' values, nor other points, repeats or variations, nor the number that the
sequence happens to have, change what it is; but those by Sobol sequences share the dimensions of one in their order.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from sonarsynth.conventions import ASSUMED_SPEED, Ints
from sonarsynth.description import FieldError
from sonarsynth.description.field_messages import Where
from sonarsynth.products import SPLITS
from sonarsynth.randomness import number
from sonarsynth.recipe.populations.drawn_bodies import DrawnBodies, draw
from sonarsynth.recipe.rising_bottom import with_relief
from sonarsynth.recipe.scene import Scene
from sonarsynth.recipe.splits import Splits, assign
from sonarsynth.recipe.variation.grid import Axis, Zip, axes
from sonarsynth.recipe.variation.random_variations import Choice, Integers, Sobol, Variation, as_drawn
from sonarsynth.recipe.variation.setting import Setting, Stamps, file_stamps, mesh_files, plain_scene, with_settings
from sonarsynth.recipe.variation.values import FRAMES, MOST_FRAMES, Plain, default_name, leads_through, where

MOST_SEQUENCES = 1_000_000
NOTHING = Plain.of(None)
"""Value of an entry whose field stays as it is."""


@dataclass(frozen=True, eq=False)
class Sequences:
    """What a recipe spans."""

    base: Scene
    seed: int
    grid: tuple[Axis | Zip, ...]
    variations: tuple[Variation, ...]
    repeats: int
    splits: Splits | None

    @property
    def varied(self) -> bool:
        """Whether there is more than the base scene, once."""
        return bool(self.grid or self.variations or self.repeats > 1)

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Number of values of each entry of the grid, and the repeats: the last changes fastest."""
        return (*(axes(entry)[0].size for entry in self.grid), self.repeats)

    @property
    def count(self) -> int:
        """Number of sequences."""
        return math.prod(self.sizes)

    @cached_property
    def _axes(self) -> list[list[tuple[Where, Axis, tuple[Plain, ...]]]]:
        """Axes of each entry of the grid with their values, and where they stand in the recipe."""
        return [
            [(("grid", i, "zip", j) if isinstance(e, Zip) else ("grid", i), a, a.taken) for j, a in enumerate(axes(e))]
            for i, e in enumerate(self.grid)
        ]

    @property
    def entries(self) -> list[tuple[Where, Axis | Variation]]:
        """Everything that varies, and where it stands in the recipe."""
        grid: list[tuple[Where, Axis | Variation]] = [(at, axis) for zipped in self._axes for at, axis, _ in zipped]
        return grid + [(("variations", i), variation) for i, variation in enumerate(self.variations)]

    @cached_property
    def steps(self) -> Ints:
        """Number of frames of each sequence (sequence,). Raises FieldError unless that is 1 to `MOST_FRAMES`."""
        frames = np.full(self.count, self.base.trajectory.frames)
        varying = next((n for n, (_, entry) in enumerate(self.entries) if FRAMES in entry.path), None)
        if varying is not None:
            for sequence in range(self.count):
                value = (setting := self.settings(sequence)[varying]).value.value
                if setting.paths and (type(value) is not int or not 1 <= value <= MOST_FRAMES):
                    problem = f"must be a whole number from 1 to {MOST_FRAMES}, not {value}"
                    raise FieldError(setting.source, f"{FRAMES} {problem}")
                frames[sequence] = value if setting.paths else frames[sequence]
        return frames

    @cached_property
    def first_frames(self) -> Ints:
        """Number of the first frame of each sequence, and that of all frames (sequence + 1,)."""
        return np.concatenate([[0], np.cumsum(self.steps)])

    def point(self, sequence: int) -> tuple[int, ...]:
        """Number of the value of each entry of the grid, and of the repeat. Raises IndexError."""
        if not 0 <= sequence < self.count:
            raise IndexError(f"sequence {sequence} is outside 0..{self.count - 1}")
        numbers = []
        for size in reversed(self.sizes):
            sequence, n = divmod(sequence, size)
            numbers.append(n)
        return tuple(reversed(numbers))

    def grid_settings(self, sequence: int) -> tuple[Setting, ...]:
        """The values of the grid point of a sequence."""
        return _point(self, self.point(sequence)[:-1])[0]

    def key(self, sequence: int) -> int | str:
        """What everything random of a sequence is keyed by; 0 for a recipe that spans one scene."""
        if not self.varied:
            return 0
        return "{} {}".format(*self.repeat(sequence))

    def drawn(self, sequence: int) -> tuple[Setting, ...]:
        """The values of the variations of a sequence."""
        (of_point, repeat), dimension, settings = self.repeat(sequence), 0, []
        key = f"{of_point} {repeat}"
        paths = {name_of(variation): variation.path[0] for variation in self.variations}
        values = {setting.name: setting.value for setting in self.grid_settings(sequence)}
        for i, variation in enumerate(self.variations):
            path = as_drawn(variation.path[0])
            if isinstance(variation, Sobol):
                value = variation.draw(self.seed, of_point, path, dimension, repeat)
                dimension += 1
            elif isinstance(variation, Choice):
                value = variation.draw(self.seed, key, path)
            else:
                partner = None if variation.like is None else paths[variation.like]
                value = variation.at(variation.share(self.seed, key, partner))
            applies = variation.when is None or values[variation.when.entry].fits(variation.when.value)
            values[name_of(variation)] = value if applies else NOTHING
            set_at = variation.path if applies else ()
            settings.append(Setting(("variations", i), name_of(variation), set_at, values[name_of(variation)]))
        return tuple(settings)

    def settings(self, sequence: int) -> tuple[Setting, ...]:
        """Every value of a sequence, those of the grid first."""
        return self.grid_settings(sequence) + self.drawn(sequence)

    def extremes(self, sequence: int) -> Iterator[Scene]:
        """Scenes as that of a sequence, each with one variation at an end; those that cannot be are left out."""
        settings, before = self.settings(sequence), len(self.entries) - len(self.variations)
        for i, variation in enumerate(self.variations):
            if isinstance(variation, Choice):
                continue
            for fraction in (0.0, 1.0):
                changed, old = list(settings), settings[before + i]
                changed[before + i] = Setting(old.source, old.name, old.paths, variation.at(fraction))
                try:
                    scene = with_relief(with_settings(self.base, self._plain, changed))
                    yield self._drawn_in(scene, sequence).put_in(scene)
                except FieldError:
                    continue

    @cached_property
    def _plain(self) -> dict[str, Any]:
        return plain_scene(self.base)

    @cached_property
    def _files(self) -> tuple[str, ...]:
        lists = [e.taken if isinstance(e, Axis) else e.values if isinstance(e, Choice) else () for _, e in self.entries]
        return mesh_files([self._plain, *(plain.value for values in lists for plain in values)])

    @property
    def stamps(self) -> Stamps:
        """Of the files of meshes and grids, as they are now: what is kept of scenes is kept until one changes."""
        return file_stamps(self._files)

    @cached_property
    def _mesh_speed(self) -> float | None:
        """Slowest sound speed (m/s) that any sequence assumes; None where all assume the same."""
        setting_speed = [(at, entry) for at, entry in self.entries if ASSUMED_SPEED in entry.path]
        if not setting_speed or self.base.sonar.mesh_sound_speed is not None:
            return None
        ((at, entry),) = setting_speed
        if isinstance(entry, Axis):
            values = entry.taken
        else:
            values = entry.values if isinstance(entry, Choice) else (entry.at(0.0),)
        changes = [[Setting(at, name_of(entry), (ASSUMED_SPEED,), value)] for value in values]
        scenes = [self.base, *(with_settings(self.base, self._plain, change) for change in changes)]
        return min(scene.sonar.assumed_sound_speed for scene in scenes)

    def scene(self, sequence: int) -> Scene:
        """Scene of a sequence. Raises FieldError that names the entry and its value where there is none."""
        populated = self.base.world.populations
        return _scene(self, sequence, self.stamps) if populated else self.described(sequence)

    def repeat(self, sequence: int) -> tuple[str, int]:
        """The grid point of a sequence, as written, and which repeat of that it is."""
        point = self.point(sequence)
        return _point(self, point[:-1])[1], point[-1]

    def bodies(self, sequence: int) -> DrawnBodies:
        """The bodies of the populations of a sequence. Raises FieldError where a population has no room."""
        return _bodies(self, sequence, self.stamps)

    def _drawn_in(self, scene: Scene, sequence: int) -> DrawnBodies:
        return draw(scene, self.seed, self.key(sequence), self.repeat(sequence))

    def described(self, sequence: int) -> Scene:
        """The same before its populations are drawn."""
        return _described(self, sequence, self.stamps) if self.varied else with_relief(self.base)

    @cached_property
    def split(self) -> Ints:
        """Split (sequence,) of each sequence: an index into SPLITS; all in the first where the recipe has no splits."""
        if self.splits is None:
            return np.zeros(self.count, np.int64)
        stratify, undivided = self.splits.stratify, self.splits.undivided
        continuous = [v for v in self.variations if not isinstance(v, Choice | Integers)]
        unlike = bool(self.base.world.populations) or any(v.when is None for v in continuous)  # no two scenes are one
        settings_of = self.grid_settings if unlike and len(continuous) == len(self.variations) else self.settings
        groups: list[object] = []
        strata: list[object] = []
        for sequence in range(self.count):
            settings = settings_of(sequence) if stratify or undivided or not unlike else ()
            named = {s.name: s.value.text for s in settings}
            strata.append(named.get(stratify or ""))
            scene = sequence if unlike else tuple(s.value.text for s in settings if s.paths != (FRAMES,))
            groups.append(tuple(named[n] for n in undivided) if undivided else scene)
        priority = [number(self.seed, "split", self.key(n)) for n in range(self.count)]
        return assign(self.splits.shares, groups, strata, priority)

    def as_json(self) -> dict[str, Any]:
        """What is spanned, for a program."""
        counts, frames = (np.bincount(self.split, weight, len(SPLITS)) for weight in (None, self.steps))
        return {
            "sequences": self.count,
            "frames_of_a_sequence": [int(self.steps.min()), int(self.steps.max())],
            "grid": [
                {"names": [name_of(axis) for _, axis, _ in axes], "values": size}
                for axes, size in zip(self._axes, self.sizes, strict=False)
            ],
            "repeats": self.repeats,
            "variations": [{"name": name_of(v), "kind": v.kind} for v in self.variations],
            "splits": {name: int(n) for name, n in zip(SPLITS, counts, strict=True)},
            "frames_of_splits": {name: int(n) for name, n in zip(SPLITS, frames, strict=True)},
        }

    @contextmanager
    def naming(self, sequence: int) -> Iterator[None]:
        """Have a FieldError about the scene of a sequence name the entry that made it so, where there is one."""
        try:
            yield
        except FieldError as error:
            if not self.varied or error.path[:1] != ("scene",):
                raise
            settings = self.settings(sequence)
            blamed = [s for s in settings if any(leads_through(where(path), error.path) for path in s.paths)]
            shown = ", ".join(s.shown for s in blamed or settings)
            at = max(blamed, key=_closeness).source if blamed else error.path
            field = "" if at == error.path else f"{'.'.join(map(str, error.path))}: "
            raise FieldError(at, f"{field}{error.message} (sequence {sequence}: {shown})") from None


def name_of(entry: Axis | Variation) -> str:
    """Name of the coordinate of an entry."""
    return entry.name or default_name(entry.path)


def _closeness(setting: Setting) -> tuple[int, bool]:
    """How much a setting is to blame, of several that meet a field: the one that leads deepest, a drawn one first."""
    return max(len(where(path)) for path in setting.paths), setting.source[0] == "variations"


@lru_cache(maxsize=128)
def _scene(sequences: Sequences, sequence: int, stamps: Stamps) -> Scene:
    return sequences.bodies(sequence).put_in(sequences.described(sequence))


@lru_cache(maxsize=4)
def _described(sequences: Sequences, sequence: int, stamps: Stamps) -> Scene:
    scene = with_relief(with_settings(sequences.base, sequences._plain, sequences.settings(sequence)))
    speed = sequences._mesh_speed
    return scene if speed is None else replace(scene, sonar=replace(scene.sonar, mesh_sound_speed=speed))


@lru_cache(maxsize=1024)  # as many as a plan looks at
def _bodies(sequences: Sequences, sequence: int, stamps: Stamps) -> DrawnBodies:
    return sequences._drawn_in(sequences.described(sequence), sequence)


@lru_cache(maxsize=4096)
def _point(sequences: Sequences, values: tuple[int, ...]) -> tuple[tuple[Setting, ...], str]:
    """What a point of the grid sets, and its key: the values as written, in whatever order they are entered."""
    settings = []
    for zipped, n in zip(sequences._axes, values, strict=True):
        for source, axis, taken in zipped:
            at = (*source, "values", n) if axis.values is not None else source
            settings.append(Setting(at, name_of(axis), axis.path, taken[n]))
    return tuple(settings), json.dumps(sorted([[as_drawn(path) for path in s.paths], s.value.text] for s in settings))
