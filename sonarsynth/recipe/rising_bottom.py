"""What of the bottom rises over its mean plane, put among the targets of a scene."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import Final

from sonarsynth.description import FieldError
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.recipe.scene import Scene
from sonarsynth.sources import Source
from sonarsynth.targets.meshes import file_stamp
from sonarsynth.targets.relief import BOTTOM, highest_within

WHERE: Final = ("scene", "world", "relief", "shape")


def with_relief(scene: Scene) -> Scene:
    """A scene with what rises of its bottom last among its targets, and its shrimp on it. Raises FieldError."""
    if scene.world.relief is None:
        return scene
    if BOTTOM in scene.world.target_names:
        raise FieldError(WHERE, f"is a body that is called '{BOTTOM}': no target and no population can be")
    try:
        return _with_relief(scene, file_stamp(scene.world.relief.shape))
    except (ValueError, OSError) as error:
        raise FieldError(WHERE, str(error)) from None


@lru_cache(maxsize=16)
def _with_relief(scene: Scene, stamp: tuple[int, int] | None) -> Scene:
    """The same, kept until the file changes."""
    world, depth = scene.world, scene.world.environment.depth
    assert world.relief is not None
    if (rise := world.relief.target(depth)) is None:
        return scene
    risen = replace(scene, world=replace(world, targets=(*world.targets, rise)))
    return with_sources(risen, world.sources)


def with_sources(scene: Scene, sources: tuple[Source, ...]) -> Scene:
    """A scene with other sources, those that say no depth on what rises of its bottom."""
    if (mesh := relief_of(scene)) is not None:
        ground = partial(highest_within, mesh, radius=0.0)
        sources = tuple(source.on_relief(scene.world.environment.depth, ground) for source in sources)
    return replace(scene, world=replace(scene.world, sources=sources))


def relief_of(scene: Scene) -> Mesh | None:
    """What rises of the bottom of a scene: x east, y north, z up from the mean plane; None: nothing."""
    if scene.world.relief is None:
        return None
    named = [number for number, target in enumerate(scene.world.targets) if target.name == BOTTOM]
    return scene.mesh_of(named[0]) if named else None
