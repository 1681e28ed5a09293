"""Meshes of targets whose shape varies: each different one is kept once, numbered in the order of the sequences."""

from __future__ import annotations

from functools import lru_cache

from sonarsynth.description import FieldError
from sonarsynth.description.field_messages import Where
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.recipe.scene import Scene
from sonarsynth.recipe.sequences import Sequences
from sonarsynth.recipe.variation.setting import Stamps
from sonarsynth.recipe.variation.values import where
from sonarsynth.targets.target import base_mesh

MOST_VARIANTS = 1000
"""Different meshes of a target that a dataset may have."""


def target_meshes(sequences: Sequences) -> dict[str, tuple[Mesh, ...]]:
    """The meshes of each target of the recipe, and of the models of each population, by its name.

    Raises FieldError for more than MOST_VARIANTS, or a scene that cannot be.
    """
    return _meshes_and_numbers(sequences, sequences.stamps)[0]


def mesh_number(sequences: Sequences, scene: Scene, target: int) -> int:
    """Which of its meshes a target of the scene of a sequence has."""
    numbers, name = _meshes_and_numbers(sequences, sequences.stamps)[1], scene.world.targets[target].name
    digest = _base_mesh(scene, target).digest
    group = next((p.name for p in sequences.base.world.populations if name in p.slots), name)
    return numbers[group][digest]


@lru_cache(maxsize=8)
def _meshes_and_numbers(
    sequences: Sequences, stamps: Stamps
) -> tuple[dict[str, tuple[Mesh, ...]], dict[str, dict[str, int]]]:
    """Meshes of each group, and their numbers by their digests."""
    scene = sequences.described(0)
    meshes = {target.name: _of_target(sequences, n) for n, target in enumerate(scene.world.targets)}
    for index, population in enumerate(scene.world.populations):
        meshes[population.name] = tuple(_of_model(scene, index, n) for n in range(len(population.models)))
    alone = {name: tuple({mesh.digest: mesh for mesh in variants}.values()) for name, variants in meshes.items()}
    return alone, {name: {mesh.digest: n for n, mesh in enumerate(variants)} for name, variants in alone.items()}


def _of_target(sequences: Sequences, target: int) -> tuple[Mesh, ...]:
    """The meshes of a target of the recipe, in the order of the sequences."""
    shaping = _shaping(sequences, target)
    if not shaping:
        return (_mesh(sequences, 0, target),)
    variants: dict[str, Mesh] = {}
    signatures = set[tuple[str, ...]]()
    gridded = max(shaping) < len(sequences.grid_settings(0))  # nothing that is drawn matters
    for sequence in range(sequences.count):
        settings = sequences.grid_settings(sequence) if gridded else sequences.settings(sequence)
        signature = tuple(settings[i].value.text for i in shaping)
        if signature in signatures:
            continue
        signatures.add(signature)
        mesh = _mesh(sequences, sequence, target)
        variants.setdefault(mesh.digest, mesh)
        if len(variants) > MOST_VARIANTS:
            at = sequences.entries[shaping[-1]][0]
            raise FieldError(at, f"makes more than {MOST_VARIANTS} different meshes: choose among fewer")
    return tuple(variants.values())


def _of_model(scene: Scene, index: int, number: int) -> Mesh:
    population = scene.world.populations[index]
    model = population.models[number]
    law = model.scattering or scene.physics.scattering
    try:
        return base_mesh(model.shape, law, scene.sonar.shortest_wavelength, model.scale[1])
    except (ValueError, OSError) as error:
        field = ("scene", "world", "populations", index, "models", number, "shape")
        raise FieldError(field, str(error)) from None


def _base_mesh(scene: Scene, target: int) -> Mesh:
    return scene.world.targets[target].base_mesh(scene.laws[target], scene.sonar.shortest_wavelength)


def _mesh(sequences: Sequences, sequence: int, target: int) -> Mesh:
    with sequences.naming(sequence):
        scene = sequences.described(sequence)
        if target >= len(scene.world.targets):
            raise FieldError(("scene", "world", "targets"), "the number of targets must be the same in all sequences")
        try:
            return _base_mesh(scene, target)
        except (ValueError, OSError) as error:
            raise FieldError(("scene", "world", "targets", target, "shape"), str(error)) from None


def _shaping(sequences: Sequences, target: int) -> list[int]:
    """Numbers of the entries that may change the mesh of a target."""
    places: tuple[Where, ...] = tuple(
        ("scene", "world", "targets", target, name) for name in ("shape", "scattering", "mesh_scale")
    )
    meets = [
        any(all(a == b for a, b in zip(where(path), field, strict=False)) for path in entry.path for field in places)
        for _, entry in sequences.entries
    ]
    return [i for i, met in enumerate(meets) if met]
