"""What is made a block of facets at a time is what is made at once, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from sonarsynth.conventions import NO_TARGET
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry import mesh as meshes
from sonarsynth.geometry.mesh import Mesh, in_blocks
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels import label
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing, Refracted, Straight
from sonarsynth.receiver import BeamGrid, Romanis, Sonar, elements
from sonarsynth.scattering import Kirchhoff, MirrorLobe, PartlyReflecting, Scattering
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing import echoes
from sonarsynth.tracing.arrivals import trace
from sonarsynth.tracing.pruning import EchoLevels, loud_ones
from tests.bodies import mesh_from

ENVIRONMENT = Environment(depth=30.0, sound_speed=Isovelocity(speed=1540.0))
UNIFORM = Profile(np.array([0.0, 30.0]), np.array([1540.0, 1540.0]))
LAYERED = Profile(np.array([0.0, 8.0, 13.0, 30.0]), np.array([1541.0, 1540.0, 1535.0, 1534.0]))
SONAR = Pose(np.array([0.0, 0.0, -10.0]), quaternion(0.5 * np.pi))
ROMANIS = elements(Romanis())


def hull(subdivisions: int) -> Mesh:
    return mesh_from(trimesh.creation.icosphere(subdivisions=subdivisions), [0.8, 0.2, 0.2])


BODIES = tuple(
    PlacedTarget(name, hull(n), Pose(np.array(place), quaternion(0.4, 0.1, 0.2)), np.array([1.0, -2.0, 0.1]))
    for name, n, place in (("large", 4, (20.0, 1.0, -11.0)), ("small", 2, (15.0, 0.5, -11.5)))
)
SNAPS = tuple(
    Emission(np.array(at), 1e-3 * at[0], LogarithmicBubble(), None) for at in ((3.0, 6.0, -30.0), (9.0, -6.0, -30))
)
CASES: dict[str, tuple[Profile, int, Scattering]] = {
    "straight": (UNIFORM, 0, MirrorLobe(width=0.3)),
    "reflected": (UNIFORM, 1, MirrorLobe(width=0.3)),
    "refracted": (LAYERED, 0, MirrorLobe(width=0.3)),
    "refracted and reflected": (LAYERED, 1, MirrorLobe(width=0.5)),
    "coherent and rough": (UNIFORM, 0, Kirchhoff(roughness=1e-3)),
    "partly reflecting": (LAYERED, 0, Kirchhoff(surface=PartlyReflecting(density_ratio=2.0, speed_ratio=1.2))),
    "forward": (UNIFORM, 1, Kirchhoff(forward="scattered")),
}


def found(profile: Profile, bounces: int, law: Scattering) -> Arrivals:
    receiver = Receiver(SONAR, ROMANIS, track=Track(SONAR, np.array([0.5, 0.0, 0.0])))
    water, laws = Medium(ENVIRONMENT, profile, 0.02), (law, MirrorLobe())
    return trace(FrameContext(0.0, BODIES, SNAPS, water, receiver, laws), AutoTracing(bounces=bounces))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("block", [700, 2500])
def test_arrivals_are_the_same_whatever_the_block(monkeypatch: pytest.MonkeyPatch, case: str, block: int) -> None:
    whole = found(*CASES[case])
    assert {NO_TARGET, 0, 1} == set(whole.target.tolist())
    monkeypatch.setattr(meshes, "BLOCK", block)
    assert len(in_blocks(sum(len(body.mesh.faces) for body in BODIES))) > 1
    for name, value in found(*CASES[case]).columns.items():
        np.testing.assert_array_equal(value, whole.columns[name], err_msg=name)


@pytest.mark.parametrize("case", ["straight", "coherent and rough"])
def test_what_was_given_up_too_soon_is_looked_at_again(monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    whole = found(*CASES[case])
    monkeypatch.setattr(meshes, "BLOCK", 700)
    monkeypatch.setattr(echoes, "PRUNE_MARGIN", 1e5)
    for name, value in found(*CASES[case]).columns.items():
        np.testing.assert_array_equal(value, whole.columns[name], err_msg=name)


@pytest.mark.parametrize("straight", [True, False])
def test_labels_are_the_same_whatever_the_block(monkeypatch: pytest.MonkeyPatch, straight: bool) -> None:
    profile, rays = (UNIFORM, Straight()) if straight else (LAYERED, Refracted())
    beams = BeamGrid(azimuth_span=0.5, azimuths=41, elevation_span=0.5, elevations=41)

    def labels() -> dict[str, object]:
        receiver = Receiver(SONAR, ROMANIS, Sonar(beams=beams), Track(SONAR, np.zeros(3)))
        context = FrameContext(0.0, BODIES, SNAPS, Medium(ENVIRONMENT, profile), receiver)
        return vars(label(context, rays, np.zeros(len(SNAPS))))

    whole = labels()
    assert (np.asarray(whole["visible_fraction"]) > 0.0).all() and (np.asarray(whole["beam_target"]) >= 0).any()
    monkeypatch.setattr(meshes, "BLOCK", 300)
    for name, value in labels().items():
        np.testing.assert_array_equal(value, whole[name], err_msg=name)


def test_tables_of_a_mesh_are_the_same_whatever_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = hull(4)
    corners = whole.corners
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_array_equal(whole.area, 0.5 * np.linalg.norm(cross, axis=1))
    monkeypatch.setattr(meshes, "BLOCK", 333)
    part = hull(4)
    for name in ("area", "normal", "centroid", "corners"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name), err_msg=name)


def test_blocks_are_all_and_none_is_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "BLOCK", 10)
    for count in (0, 1, 9, 10, 11, 20, 21, 99):
        parts = in_blocks(count)
        assert [n for part in parts for n in range(part.start, part.stop)] == list(range(count))
        assert max(part.stop - part.start for part in parts) <= 10
        assert len(parts) == max(-(-count // 10), 1)


@pytest.mark.parametrize("seed", range(5))
def test_no_echo_is_faint_beside_what_nobody_may_hear(seed: int) -> None:
    random = np.random.default_rng(seed)
    strength, owner = random.exponential(size=400) ** 6, random.integers(0, 3, 400)
    heard, coherent = random.random(400) < 0.5, random.random(400) < 0.5
    keep = loud_ones(EchoLevels(strength * np.where(heard, 1.0, 1e9), coherent, owner, heard, owner), 1e-3)
    alone = loud_ones(EchoLevels(*(column[heard] for column in (strength, coherent, owner, heard, owner))), 1e-3)
    assert not alone.all()
    assert keep[heard][alone].all()


def test_of_equally_faint_echoes_all_are_left_out_or_none() -> None:
    """Of those of a body that both sides of show alike, say; whatever the order that they come in."""
    for faint, left_out in ((9, True), (11, False)):  # each is a tenth of what is negligible
        strength = np.append(np.full(faint, 1e-2), 1.0)
        none, every = np.zeros(faint + 1, bool), np.ones(faint + 1, bool)
        keep = loud_ones(EchoLevels(strength, none, none.astype(int), every, none.astype(int)), 1e-3)
        assert keep[-1]
        assert (keep[:-1] != left_out).all()
