"""Meshes of targets whose shape varies: each different one is kept once, numbered in the order of the sequences."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Ints
from sonarsynth.description import FieldError
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.recipe.sequences import Sequences
from sonarsynth.recipe.variation.values import Where, where

MOST_VARIANTS = 1000
"""Different meshes of a target that a dataset may have."""

Variants = tuple[tuple[tuple[int, Mesh], ...], ...]
"""Of each target: the first sequence that has a mesh, and the mesh."""


def target_meshes(sequences: Sequences) -> Variants:
    """The meshes of each target. Raises FieldError for more than MOST_VARIANTS, or a scene that cannot be."""
    return _found(sequences)[0]


def variant_numbers(sequences: Sequences) -> Ints:
    """Which of its meshes each target has (sequence, target)."""
    return _found(sequences)[1]


@lru_cache(maxsize=8)
def _found(sequences: Sequences) -> tuple[Variants, Ints]:
    scene = sequences.scene(0)
    targets = len(scene.world.targets)
    numbers = np.zeros((sequences.count, targets), np.int64)
    kept: list[tuple[tuple[int, Mesh], ...]] = []
    for target in range(targets):
        shaping = _shaping(sequences, target)
        if not shaping:
            kept.append(((0, scene.meshes[target]),))
            continue
        found: dict[str, int] = {}
        known: dict[tuple[str, ...], int] = {}
        meshes: list[tuple[int, Mesh]] = []
        gridded = max(shaping) < len(sequences.grid_settings(0))  # nothing that is drawn matters
        for sequence in range(sequences.count):
            settings = sequences.grid_settings(sequence) if gridded else sequences.settings(sequence)
            signature = tuple(settings[i].value.text for i in shaping)
            if signature not in known:
                mesh = _mesh(sequences, sequence, target)
                known[signature] = found.setdefault(mesh.digest, len(found))
                if len(found) > len(meshes):
                    meshes.append((sequence, mesh))
                if len(found) > MOST_VARIANTS:
                    place = sequences.entries[shaping[-1]][0]
                    raise FieldError(place, f"makes more than {MOST_VARIANTS} different meshes: choose among fewer")
            numbers[sequence, target] = known[signature]
        kept.append(tuple(meshes))
    return tuple(kept), numbers


def _mesh(sequences: Sequences, sequence: int, target: int) -> Mesh:
    with sequences.naming(sequence):
        scene = sequences.scene(sequence)
        if target >= len(scene.world.targets):
            raise FieldError(("scene", "world", "targets"), "the number of targets must be the same in all sequences")
        try:
            return scene.mesh_of(target)
        except (ValueError, OSError) as error:
            raise FieldError(("scene", "world", "targets", target, "shape"), str(error)) from None


def _shaping(sequences: Sequences, target: int) -> list[int]:
    """Numbers of the entries that may change the mesh of a target."""
    places: tuple[Where, ...] = tuple(("scene", "world", "targets", target, field) for field in ("shape", "scattering"))
    meets = [
        any(all(a == b for a, b in zip(where(path), place, strict=False)) for path in entry.path for place in places)
        for _, entry in sequences.entries
    ]
    return [i for i, met in enumerate(meets) if met]
