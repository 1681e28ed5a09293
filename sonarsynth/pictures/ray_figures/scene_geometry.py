"""Where everything is in a frame: array and elements, snaps, targets and their tracks, the field of view."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats, direction
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import pose
from sonarsynth.pictures.figures.frame_figure import Hull
from sonarsynth.receiver import BeamGrid, Elements, elements
from sonarsynth.recipe.scene import Frame, Scene

MOST_STEPS = 200
"""Points of a track."""


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """What stands around the rays of a frame; world, m."""

    bottom: float  # depth
    bearing: float  # rad, from x to y: of the vertical plane that is drawn
    array: Floats  # (xyz) centre
    elements: Elements  # sonar frame
    sensors: Floats  # (sensor, xyz)
    places: Mapping[str, Floats]  # points (xyz) to name
    hulls: tuple[Hull, ...]
    tracks: Mapping[str, Floats]  # (step, xyz) of what moves from frame to frame
    view: Mapping[str, Floats]  # (point, xyz): edges of the field of view, across and upright

    def on_plane(self, points: Floats) -> Floats:
        """Horizontal distance from the array along the plane, and height (point, 2), of points (point, xyz)."""
        away = (points - self.array) @ np.array([np.cos(self.bearing), np.sin(self.bearing), 0.0])
        return np.stack([away, points[:, 2]], axis=1)


def scene_geometry(scene: Scene, frame: Frame, bearing: float) -> SceneGeometry:
    """Geometry of a frame of a scene, to be drawn on the vertical plane towards `bearing` (rad, from x to y)."""
    bottom, array = scene.world.environment.depth, frame.sonar_pose.position
    hulls = tuple(Hull(b.name, b.pose.to_world(b.mesh.vertices), b.mesh.faces.astype(int)) for b in frame.moment.bodies)
    snaps = [snap.position for snap in frame.moment.snaps]
    first = {tuple(position): n for n, position in reversed(list(enumerate(snaps)))}  # of snaps at one place the first
    listening = elements(scene.sonar.array)
    ends = np.concatenate([[array], *(s[None] for s in snaps), *(hull.vertices for hull in hulls)])
    reach = 1.1 * float(np.linalg.norm(ends - array, axis=1).max()) or bottom
    return SceneGeometry(
        bottom=bottom,
        bearing=bearing,
        array=array,
        elements=listening,
        sensors=frame.sonar_pose.to_world(listening.position),
        places={"array": array} | {f"snap {n}": snaps[n] for n in sorted(first.values())},
        hulls=hulls,
        tracks=_tracks(scene),
        view=_field_of_view(scene.sonar.beams, frame.sonar_pose, reach, bottom),
    )


def _tracks(scene: Scene) -> dict[str, Floats]:
    trajectory = scene.trajectory
    steps = np.unique(np.linspace(0, trajectory.frames - 1, MOST_STEPS).astype(int))
    motions = {"array": trajectory.sonar} | {target.name: target.motion for target in scene.world.targets}
    tracks = {n: np.array([pose(m, trajectory.time(int(s))).position for s in steps]) for n, m in motions.items()}
    return {name: track for name, track in tracks.items() if np.ptp(track, axis=0).any()}


def _field_of_view(beams: BeamGrid, sonar: Pose, reach: float, bottom: float) -> dict[str, Floats]:
    """Sectors of the beams at elevation 0 and at azimuth 0, as far as `reach` (m) and where there is water."""
    level = np.zeros(33)
    sectors = {"across": (_spread(beams.azimuth), level), "upright": (level, _spread(beams.elevation))}
    outlines = {}
    for name, (azimuth, elevation) in sectors.items():
        towards = sonar.turn_to_world(direction(azimuth, elevation))
        z, climb = sonar.position[2], towards[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            wet = np.where(climb > 0, -z / climb, np.where(climb < 0, (-bottom - z) / climb, np.inf))
        arc = sonar.position + np.minimum(reach, wet)[:, None] * towards
        outlines[name] = np.concatenate([[sonar.position], arc, [sonar.position]])
    return outlines


def _spread(angles: Floats) -> Floats:
    return np.linspace(angles[0], angles[-1], 33)
