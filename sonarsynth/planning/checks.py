"""Is everything in the water, and can every file be read? Asked before anything is computed."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.description import FieldError
from sonarsynth.recipe import Recipe
from sonarsynth.scene import Frame, Scene
from sonarsynth.sonar import elements
from sonarsynth.world.casts import profile_of
from sonarsynth.world.environment import Profile
from sonarsynth.world.meshes import Mesh, mesh_of


def read_inputs(scene: Scene) -> Profile:
    """Read the cast and the meshes, so that a missing or broken file is known before anything is computed."""
    world = ("scene", "world")
    try:
        profile = profile_of(scene.world.environment.sound_speed)
    except (ValueError, OSError) as error:
        raise FieldError((*world, "environment", "sound_speed"), str(error)) from None
    for i, target in enumerate(scene.world.targets):
        try:
            mesh_of(target.shape)
        except (ValueError, OSError) as error:
            raise FieldError((*world, "targets", i, "shape"), str(error)) from None
    try:
        elements(scene.sonar.array)
    except ValueError as error:
        raise FieldError(("scene", "sonar", "array"), str(error)) from None
    return profile


def check_positions(scene: Scene, recipe: Recipe) -> None:
    """Every body, the array and every shrimp must be in the water at every frame."""
    bed = scene.world.environment.depth
    for i, shrimp in enumerate(scene.world.shrimp):
        position = shrimp.position
        down = -position[2] if len(position) > 2 else bed - shrimp.height
        if not 0 <= down <= bed:
            raise FieldError(
                ("scene", "world", "shrimp", i, "position"), f"depth {down:g} m is outside the water (0 to {bed:g} m)"
            )
    reach = elements(scene.sonar.array).position
    for step in range(recipe.frames):
        _, frame = recipe.frame(step)
        _check_depth(("scene", "trajectory", "sonar"), "the array", frame.sonar_pose.to_world(reach), bed, frame)
        for i, body in enumerate(frame.moment.bodies):
            path = ("scene", "world", "targets", i, "motion")
            _check_depth(path, f"target '{body.name}'", body.pose.to_world(_hull(body.mesh)), bed, frame)


def _hull(mesh: Mesh) -> Floats:
    """Vertices that bound the mesh in every direction: all of them up to 20 000, else the corners of its box."""
    if len(mesh.vertices) <= 20_000:
        return np.asarray(mesh.vertices)
    low, high = mesh.box
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _check_depth(path: tuple[str | int, ...], what: str, points: Floats, bed: float, frame: Frame) -> None:
    shallow, deep = float(depth(points).min()), float(depth(points).max())
    if shallow < 0:
        raise FieldError(path, f"{what} is {-shallow:.3g} m above the surface at frame {frame.index}")
    if deep > bed:
        raise FieldError(path, f"{what} is {deep - bed:.3g} m below the bed at frame {frame.index}")
