"""Where the sources of a recipe stand, as the sonar is told."""

from __future__ import annotations

from sonarsynth.recipe.scene import Scene
from sonarsynth.state import source_position

OFF = 3.0
"""A source this many standard errors of the bottom's depth above the bottom stands off it."""


def standing_off(scene: Scene) -> tuple[str, ...]:
    """Names of the shrimp that are not on the bottom, to what the sonar knows of its depth."""
    bottom, error = scene.world.environment.depth, scene.sonar.bed_depth_error
    height = {shrimp.name: float(source_position(shrimp, bottom)[2]) + bottom for shrimp in scene.world.sources}
    return tuple(name for name, up in height.items() if up > OFF * error)
