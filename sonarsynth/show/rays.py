"""The rays that a recipe asks for, drawn: in a vertical section with the profile beside it, and in space."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sonarsynth.pictures.frames import Hull
from sonarsynth.pictures.rays import section_figure, space_figure
from sonarsynth.planning import Plan
from sonarsynth.render import follow_rays
from sonarsynth.tracing.fan import EVENTS


def show_rays(plan: Plan, index: int, out: Path) -> tuple[list[Path], str]:
    """Write `section.png` and `space.png` of a frame's rays into a folder; their paths, and a line about the rays.

    The section is the vertical plane of the sonar's axis. Where rays are sent on to the shrimp, their colour in space
    is their coefficient, and only those that met a target are drawn. Raises FieldError where no rays are asked for.
    """
    rays = follow_rays(plan, index)
    frame = plan.recipe.frame(index)[1]
    count = int(rays.ray.max()) + 1
    lines = [rays.position[rays.ray == n] for n in range(count)]
    hulls = [Hull(b.name, b.pose.to_world(b.mesh.vertices), b.mesh.faces.astype(int)) for b in frame.moment.bodies]
    ahead = frame.sonar_pose.turn_to_world([1.0, 0.0, 0.0])
    bed = plan.scene.world.environment.depth
    section = section_figure(
        lines, hulls, plan.profile.depth, plan.profile.speed, bed, float(np.arctan2(ahead[1], ahead[0]))
    )
    sent = np.isfinite(rays.coefficient)
    drawn = np.flatnonzero(sent) if sent.any() else np.arange(count)
    strength = np.where(sent, rays.coefficient, 1.0)[drawn]
    places = {"array": frame.sonar_pose.position} | {f"snap {n}": s.position for n, s in enumerate(frame.moment.snaps)}
    space = space_figure([lines[n] for n in drawn], strength, hulls, places)
    out.mkdir(parents=True, exist_ok=True)
    files = [out / "section.png", out / "space.png"]
    section.savefig(files[0])
    space.savefig(files[1])
    met = {name: int((rays.event == number).sum()) for number, name in enumerate(EVENTS)}
    words = ", ".join(f"{number} x {name}" for name, number in met.items() if number)
    return files, f"{count} rays: {words}"
