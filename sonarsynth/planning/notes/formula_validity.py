"""Formulas of the environment that a scene uses outside their range: one line each, with the field, said once.

Frames use the same formulas without a word.
"""

from __future__ import annotations

from sonarsynth.description import FieldError
from sonarsynth.environment.absorption import absorption_notes
from sonarsynth.environment.boundary_numbers import boundary_notes
from sonarsynth.environment.sea import Profile
from sonarsynth.planning.notes.noise_checks import noise_notes
from sonarsynth.recipe.scene import Scene


def validity(scene: Scene, profile: Profile) -> tuple[str, ...]:
    """Notes on the environment of a scene, over its depths and the band of its sonar; profile is that of its water.

    Raises FieldError where the sound speed that the sonar believes in cannot be read.
    """
    environment, band = scene.world.environment, scene.sonar.band
    field_notes = [("sound_speed", note) for note in profile.notes]
    field_notes += [
        ("absorption", note)
        for note in absorption_notes(environment.absorption, [[band.low], [band.high]], [0.0, environment.depth])
    ]
    if scene.physics.tracing.bounces:
        for name, boundary in (("surface", environment.surface), ("bottom", environment.bottom)):
            field_notes += [(f"{name}.{field}", note) for field, note in boundary_notes(boundary, band.low, band.high)]
    lines = [f"scene.world.environment.{field}: {note}" for field, note in field_notes]
    return (*lines, *noise_notes(scene), *(f"{'.'.join(BELIEVED)}: {note}" for note in _believed(scene)))


BELIEVED = ("scene", "processing", "placing", "profile")


def _believed(scene: Scene) -> tuple[str, ...]:
    """Notes on the sound speed that the sonar ranges with."""
    try:
        return scene.processing.placing.notes()
    except (ValueError, OSError, ImportError) as error:
        raise FieldError(BELIEVED, str(error)) from None
