"""Can the tracks of a scene be read, and do they last as long as its frames?"""

from __future__ import annotations

from collections.abc import Iterator

from sonarsynth.description import FieldError
from sonarsynth.geometry.motion import Motion
from sonarsynth.geometry.recorded_track import RecordedTrack, track_span
from sonarsynth.geometry.track_files import TrackError
from sonarsynth.recipe.scene import Scene

ROUNDING = 1e-9
"""s by which a frame may lie beyond a point of a track."""


def check_tracks(scene: Scene) -> None:
    """Every track must be there at every frame. Raises FieldError.

    Between frames, while sound is under way, a body goes straight on beyond the ends of its track.
    """
    trajectory = scene.trajectory
    for path, motion in _motions(scene):
        if not isinstance(motion, RecordedTrack):
            continue
        try:
            first, last = track_span(motion)
        except TrackError as error:
            raise FieldError(path, str(error)) from None
        for step in (0, trajectory.frames - 1):
            if not first - ROUNDING <= (time := trajectory.time(step)) <= last + ROUNDING:
                raise FieldError(
                    path,
                    f"{motion.path}: is from {first:.12g} to {last:.12g} s of the motions, but frame {step} of a "
                    f"sequence is at {time:.12g} s (see `start`)",
                )


def _motions(scene: Scene) -> Iterator[tuple[tuple[str | int, ...], Motion]]:
    """Each motion of a scene, and where it is in the recipe."""
    yield ("scene", "trajectory", "sonar"), scene.trajectory.sonar
    for i, target in enumerate(scene.world.targets):
        yield ("scene", "world", "targets", i, "motion"), target.motion
    for i, source in enumerate(scene.world.noise_sources):
        yield ("scene", "world", "noise_sources", i, "motion"), source.motion
