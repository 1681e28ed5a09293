"""The windows hold what is heard, however targets and sonar move, sound bends and boundaries blur."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.environment.boundaries import SeaSurface
from sonarsynth.environment.sea import Environment, Isovelocity, Tabulated
from sonarsynth.geometry.motion import Line, Still
from sonarsynth.pipeline import synthesise, trace_frame
from sonarsynth.planning import plan
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import PlanarLattice, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Physics, Scene, Trajectory, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Sphere
from sonarsynth.targets.target import Target

UNIFORM = Isovelocity(speed=1530.0)
BENDING = Tabulated(depth=(0.0, 60.0), speed=(1540.0, 1500.0))


def recipe(
    distance, speed, water=UNIFORM, depth=20.0, below=5.0, sonar=0.0, bounces=0, snap=0.0, surface=None
) -> Recipe:
    """A sphere straight ahead that comes nearer or goes away; a snap on the bottom; few sensors."""
    stop = (distance + 10.0 * speed, 0.0, -below)
    away = Still(position=(distance, 0.0, -below)) if speed == 0 else None
    environment = Environment(depth=depth, sound_speed=water, surface=surface or SeaSurface())
    target = Target(
        name="ball",
        shape=Sphere(radius=0.3),
        motion=away or Line(start=(distance, 0.0, -below), stop=stop, duration=10.0),
    )
    mount = Line(start=(0.0, 0.0, -below), stop=(10.0 * sonar, 0.0, -below), duration=10.0, heading=0.5 * np.pi)
    still = Still(position=(0.0, 0.0, -below), heading=0.5 * np.pi)
    return Recipe(
        scene=Scene(
            world=World(
                environment=environment,
                targets=(target,),
                sources=(SnappingShrimp(position=(14.0, -5.0), snap_times=(snap,)),),
            ),
            sonar=Sonar(array=PlanarLattice(columns=2, rows=2, pitch=0.5)),
            trajectory=Trajectory(frames=1, sonar=mount if sonar else still),
            physics=Physics(tracing=AutoTracing(bounces=bounces)),
        )
    )


CASES = {
    "receding, a late snap": recipe(20.0, 1.4, snap=1.0),
    "sonar advancing, a late snap": recipe(20.0, 0.0, sonar=1.4, snap=1.0),
    "500 m, receding": recipe(500.0, 3.0),
    "200 m, fast": recipe(200.0, 10.0),
    "200 m, closing fast": recipe(200.0, -10.0),
    "closing, a late snap": recipe(20.0, -1.4, snap=1.0),
    "bending over 600 m": recipe(600.0, 0.0, water=BENDING, depth=60.0, below=25.0),
    "bending, with reflections": recipe(600.0, 2.0, water=BENDING, depth=60.0, below=25.0, bounces=2),
    "rough": recipe(20.0, 1.0, bounces=2, surface=SeaSurface(rms_height=0.01)),
    "a gale": recipe(20.0, 1.0, bounces=2, surface=SeaSurface(wind_speed=15.0)),
}


@pytest.mark.parametrize("which", CASES)
def test_nothing_falls_outside_and_the_echo_window_holds_the_echoes(which: str) -> None:
    made = plan(CASES[which])
    traced = trace_frame(made, 0)
    assert synthesise(made, traced).outside == 0
    found = traced.arrivals
    audible = found.delay_std < 1e-4
    direct = found.delay[found.direct & (found.surface + found.bottom == 0)][0]
    echoes = found.delay[~found.direct & audible] - direct
    assert made.windows.echo_start <= echoes.min() and echoes.max() <= made.windows.echo_stop


def test_wind_does_not_move_the_window_past_the_echoes() -> None:
    calm, gale = (plan(CASES["rough"]), plan(CASES["a gale"]))
    assert gale.windows.echo_start <= calm.windows.echo_start + 1e-9
    assert gale.windows.echo_stop < calm.windows.echo_stop + 5e-3


def test_without_doppler_nothing_is_added_for_motion() -> None:
    moving = CASES["200 m, fast"]
    frozen = replace(moving, scene=replace(moving.scene, physics=Physics(doppler=False)))
    assert plan(frozen).windows.samples < plan(moving).windows.samples
