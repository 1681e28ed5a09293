"""`tools/bench cloud`: points by the thesis's picking, by axes of beams, and by peaks, from the same signals.

Distances are to the true surface, in the frame of the target. Covered: the share of the lit surface (facing snap and
array) with a point of that frame within 10 cm. Chamfer: the mean of both one-way mean distances between the fused
points and the surface lit in any frame, sampled at 1 cm.
"""

from __future__ import annotations

import statistics
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from benchmarks.timing import markdown, once
from sonarsynth.casting.surface_distances import surface_distances
from sonarsynth.geometry import Pose
from sonarsynth.pipeline import BeamformedFrame, beamform_frame, cloud_of, trace_frame
from sonarsynth.planning import Plan, plan
from sonarsynth.ranging import BeamAxis, FirstEcho, Peaks
from sonarsynth.recipe import reading
from sonarsynth.recipe.scene import Frame

RECIPE, EVERY = "configs/remus.yaml", 4
SCENES = {
    "as shipped": [],
    "noise of 45 dB re 1 uPa2/Hz": ["scene.world.environment.noise={kind: flat, level: 45 dB}"],
    "Kirchhoff facets": ["scene.physics.scattering={kind: kirchhoff}"],
}
PICKINGS: dict[str, Any] = {
    "the thesis's first echo": FirstEcho(locality=60.0),
    "on the axes of beams": BeamAxis(),
    "peaks": Peaks(),
}
NEAR, TOUCHED = 0.05, 0.10
"""m: points that lie on the surface, and surface that points cover."""


def lit(frame: Frame, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Whether samples of the surface (sample, xyz), in the frame of the body, face the array and the snap."""
    body = frame.moment.bodies[0]
    eyes = [frame.sonar_pose.position, *(snap.position for snap in frame.moment.snaps)]
    seen = [np.sum(normals * (body.pose.to_body(eye[None]) - places), axis=1) > 0.0 for eye in eyes]
    return np.logical_and.reduce(seen)


def scored(made: Plan, heard: list[tuple[Frame, BeamformedFrame]], picking: Any) -> dict[str, float]:
    """Figures of the points of some frames."""
    mesh = made.scene.meshes[0]
    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    places, facets = trimesh.sample.sample_surface(shape, int(shape.area / 1e-4), seed=1)
    normals = shape.face_normals[facets]
    fused, ever, near, covered, spent = [], np.zeros(len(places), bool), [], [], []
    chosen = replace(made, choices=replace(made.choices, picking=picking))
    for frame, sound in heard:
        cloud_of(chosen, frame, sound)  # compiles, and fills caches
        cloud, seconds = once(partial(cloud_of, chosen, frame, sound))
        spent.append(1e3 * seconds)
        body, own = frame.moment.bodies[0], cloud.position.astype(float)
        world = frame.sonar_pose.to_world(own)
        near.append(surface_distances(body, world))
        fused.append(Pose(body.pose.position, body.pose.orientation).to_body(world))
        seen = lit(frame, places, normals)
        ever |= seen
        far = cKDTree(fused[-1]).query(places[seen])[0] if len(own) else np.full(seen.sum(), np.inf)
        covered.append(float(np.mean(far < TOUCHED)))
    distance, points = np.concatenate(near), np.concatenate(fused)
    there, back = cKDTree(places[ever]).query(points)[0], cKDTree(points).query(places[ever])[0]
    return {
        "points_a_frame": len(points) / len(heard),
        "within_5_cm": float(np.mean(distance < NEAR)),
        "median_cm": 100.0 * float(np.median(distance)),
        "covered": statistics.mean(covered),
        "chamfer_cm": 50.0 * float(there.mean() + back.mean()),
        "ms": statistics.median(spent),
    }


def bench() -> dict[str, Any]:
    """Every fourth frame of the recipe, in three scenes, by three ways of picking."""
    found: dict[str, Any] = {"recipe": RECIPE}
    for scene, settings in SCENES.items():
        made = plan(reading.load(RECIPE, settings))
        heard = []
        for index in range(0, made.recipe.frames, EVERY):
            traced = trace_frame(made, index)
            heard.append((traced.frame, beamform_frame(made, index, traced)))
        found[scene] = {name: scored(made, heard, picking) for name, picking in PICKINGS.items()}
    return found


def table(result: dict[str, Any]) -> str:
    """A row for each scene and way of picking."""
    rows = [("scene, picking", "points a frame", "within 5 cm", "median, cm", "covered", "Chamfer, cm", "ms")]
    for scene in SCENES:
        for name, row in result[scene].items():
            points, near, *lengths = (row[key] for key in ("points_a_frame", "within_5_cm", "median_cm", "chamfer_cm"))
            median, chamfer = (f"{length:.2g}" for length in lengths)
            figures = f"{points:.2g}", f"{near:.2f}", median, f"{row['covered']:.2f}", chamfer, f"{row['ms']:.1f}"
            rows.append((f"{scene}, {name}", *figures))
    return "\n".join(markdown(rows))
