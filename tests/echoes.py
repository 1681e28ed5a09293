"""What the array hears of a snap and of bodies at rest, at its centre or at a sensor: every path, and their sum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import Romanis, elements
from sonarsynth.scattering import Kirchhoff
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from sonarsynth.validation.extremes import plain_scenes

C = 1500.0
BOTTOM_DEPTH = 30.0
WATER = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))
PROFILE = Profile(np.array([0.0]), np.array([C]))
ARRAY = np.array([0.0, 0.0, -15.0])
EAST = quaternion(0.5 * np.pi)
ROMANIS = elements(Romanis())
F = np.linspace(25e3, 85e3, 7)
SCATTERED = Kirchhoff(forward="scattered")


def body(mesh: Mesh, place: Floats, name: str = "body", turned: float = 0.5 * np.pi) -> PlacedTarget:
    """A body at rest at a place (xyz) of the world."""
    return PlacedTarget(name, mesh, Pose(np.array(place, float), quaternion(turned)), np.zeros(3))


def heard(
    bodies: tuple[PlacedTarget, ...],
    source: Floats,
    laws: tuple[object, ...] = (SCATTERED,),
    *,
    array: Floats = ARRAY,
    bounces: int = 0,
    profile: Profile = PROFILE,
    moving: Track | None = None,
    water: Environment = WATER,
) -> Arrivals:
    """Every path from a snap at a place (xyz) to the array."""
    snaps = (Emission(np.array(source, float), 0.0, LogarithmicBubble(), None),)
    receiver = Receiver(Pose(np.array(array, float), EAST), ROMANIS, track=moving)
    return trace(FrameContext(0.0, bodies, snaps, Medium(water, profile), receiver, laws), AutoTracing(bounces=bounces))


def transfer(found: Arrivals, sensor: Floats | None = None) -> Floats:
    """Pressure (frequency,) at the array centre, or at a sensor (xyz), for a snap of unit spectrum at 1 m."""
    if sensor is not None:
        away = np.linalg.norm(found.radius[:, None] * found.direction - sensor, axis=1)
        late, louder = (found.expansion.over(name, sensor[None])[:, 0] for name in ("delay", "amplitude"))
        delay = found.delay + (away - found.radius) / found.sound_speed + late
        found = replace(found, delay=delay, amplitude=found.amplitude * found.radius / away * (1.0 + louder))
    return plain_scenes.transfer(found, F)
