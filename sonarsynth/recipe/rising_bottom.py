"""What of the bottom rises over its mean plane, put among the targets of a scene."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial

from sonarsynth.description import FieldError
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.recipe.scene import Scene
from sonarsynth.targets.relief import BOTTOM, highest_within


@lru_cache(maxsize=16)
def with_relief(scene: Scene) -> Scene:
    """A scene with what rises of its bottom last among its targets, and its shrimp on it. Raises FieldError."""
    world, where = scene.world, ("scene", "world", "relief", "shape")
    if world.relief is None:
        return scene
    if BOTTOM in world.target_names:
        raise FieldError(where, f"is a body that is called '{BOTTOM}': no target and no population can be")
    depth = world.environment.depth
    try:
        rise = world.relief.target(depth)
    except (ValueError, OSError) as error:
        raise FieldError(where, str(error)) from None
    if rise is None:
        return scene
    made = replace(scene, world=replace(world, targets=(*world.targets, rise)))
    ground = partial(highest_within, made.mesh_of(len(world.targets)), radius=0.0)
    sources = tuple(source.on_relief(depth, ground) for source in world.sources)
    return replace(made, world=replace(made.world, sources=sources))


def relief_of(scene: Scene) -> Mesh | None:
    """What rises of the bottom of a scene: x east, y north, z up from the mean plane; None: nothing."""
    if scene.world.relief is None:
        return None
    named = [number for number, target in enumerate(scene.world.targets) if target.name == BOTTOM]
    return scene.mesh_of(named[0]) if named else None
