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

SWIMMING = """
title: A ball that circles before a crate that swings, before a sonar that turns as it goes
seed: 3
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1530 m/s}}
    targets:
      - name: ball
        shape: {kind: sphere, radius: 0.4 m, edge: 8 cm}
        motion: {kind: circle, centre: [14, 0, -5], radius: 1.5 m, speed: 6 m/s}
      - name: crate
        shape: {kind: box, size: [1.2 m, 0.6 m, 0.5 m], edge: 8 cm}
        motion: {kind: hover, position: [17, -3, -6], heading: 40 deg, pitch: 20 deg, yaw: 60 deg, period: 2 s}
    sources: [{kind: snapping_shrimp, position: [12, -6], source_level: 188 dB}]
  sonar:
    array: {kind: planar_lattice, columns: 16, rows: 12, pitch: 4 cm}
    assumed_sound_speed: 1530 m/s
    beams: {azimuth_span: 40 deg, azimuths: 41, elevation_span: 30 deg, elevations: 31}
  trajectory:
    frames: 16
    interval: 0.3 s
    sonar: {kind: hover, position: [0, 0, -6], heading: 90 deg, surge: 1 m, yaw: 20 deg, period: 4 s}
"""
"""A recipe of bodies that move and turn, before a sonar that does."""


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
