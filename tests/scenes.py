"""Small scenes for tests of the whole chain."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.environment.sea import Absorption, Environment, Isovelocity
from sonarsynth.geometry.motion import Line, Still
from sonarsynth.receiver import Band, BandPass, BeamGrid, Romanis, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Physics, Processing, Scene, Trajectory, World
from sonarsynth.scattering import Isotropic
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Remus100, Sphere
from sonarsynth.targets.target import Target


def remus(frames: int = 2, **sonar: Any) -> Recipe:
    """The remus scene, small: a coarse hull and few frames; the vehicle moves to the right as in the whole one."""
    sonar = {"beams": BeamGrid(elevation_span=np.deg2rad(10), azimuths=101, elevations=41), "array": Romanis()} | sonar
    return Recipe(
        title="small",
        seed=3,
        scene=Scene(
            world=World(
                environment=Environment(depth=10.0, sound_speed=Isovelocity(speed=1540.0)),
                targets=(
                    Target(
                        name="remus",
                        shape=Remus100(edge=0.03),
                        motion=Line(start=(20.0, 4.5, -4.5), stop=(20.0, -4.5, -4.5), duration=6.3),
                    ),
                ),
                sources=(SnappingShrimp(position=(14.0, -5.0)),),
            ),
            sonar=Sonar(**sonar),
            trajectory=Trajectory(frames=frames, interval=6.3 / max(frames - 1, 1)),
            processing=Processing(),
        ),
    )


def point_scene(
    target: tuple[float, float, float],
    snap: tuple[float, float, float],
    place: tuple[float, float, float] = (0.0, 0.0, -50.0),
    heading: float = 0.5 * np.pi,
    strength: float = 1e-4,
    **sonar: Any,
) -> Recipe:
    """A tiny sphere of isotropic facets in deep isovelocity water without absorption, and one snap."""
    sonar = {
        "beams": BeamGrid(azimuths=51, elevations=51),
        "filter": BandPass(low=25e3, high=85e3),
        "band": Band(low=25e3, high=85e3),
    } | sonar
    return Recipe(
        scene=Scene(
            world=World(
                environment=Environment(
                    depth=100.0,
                    sound_speed=Isovelocity(speed=1500.0),
                    absorption=Absorption(formula="none"),
                ),
                targets=(
                    Target(name="point", shape=Sphere(radius=0.001), motion=Still(position=target, heading=heading)),
                ),
                sources=(SnappingShrimp(position=snap),),
            ),
            sonar=Sonar(assumed_sound_speed=1500.0, **sonar),
            trajectory=Trajectory(frames=1, sonar=Still(position=place, heading=heading)),
            # one point: not each facet as each hydrophone by itself would see it
            physics=Physics(scattering=Isotropic(strength=strength), subarrays=1, synthesis=GriddedSynthesis()),
        )
    )
