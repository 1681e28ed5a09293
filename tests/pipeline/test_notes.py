"""What `plan` says of targets before anything is computed."""

from __future__ import annotations

import pytest

import sonarsynth as ss


def warnings(distance: float, law: ss.Kirchhoff | ss.MirrorLobe) -> str:
    ball = ss.Target(
        name="ball",
        shape=ss.Sphere(radius=0.3, edge=0.1),
        motion=ss.Still(position=(distance, 0.0, -5.0)),
        scattering=law,
    )
    world = ss.World(
        environment=ss.Environment(depth=20.0, sound_speed=ss.Isovelocity(speed=1540.0)),
        targets=(ball,),
        shrimp=(ss.SnappingShrimp(name="rock", position=(3.0, 6.0)),),
    )
    quick = ss.Accuracy(signal=0.02)
    return "\n".join(ss.plan(ss.Recipe(scene=ss.Scene(world=world), accuracy=quick)).warnings)


@pytest.mark.parametrize(("distance", "said"), [(2.0, True), (6.0, False)])
def test_a_coherent_target_close_by_is_noted(distance: float, said: bool) -> None:
    assert ("ball: nearer than 2.5 m" in warnings(distance, ss.Kirchhoff())) == said
    assert "nearer than" not in warnings(distance, ss.MirrorLobe())
