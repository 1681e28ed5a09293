"""The chain against what it should be, computed another way: tilted mounts, brute-force rays, shadows, narrow lobes."""

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.environment.sea import Absorption, Environment, Tabulated
from sonarsynth.geometry.motion import Still
from sonarsynth.pipeline import beamform_frame, range_frame, render, trace_frame
from sonarsynth.planning import plan
from sonarsynth.planning.measured.sampled_arrivals import reception_of
from sonarsynth.receiver import BeamGrid, Converter, Sonar
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.scattering import MirrorLobe
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Sphere
from sonarsynth.targets.target import Target
from tests.scenes import remus

MOUNT = {"heading": np.deg2rad(88), "pitch": np.deg2rad(10), "roll": np.deg2rad(20)}


def _tilted():
    recipe = remus(
        beams=BeamGrid(azimuth_span=np.deg2rad(20), azimuths=41, elevation_span=np.deg2rad(30), elevations=61)
    )
    trajectory = Trajectory(frames=1, start=2.1, sonar=Still(position=(0.0, 0.0, -5.0), **MOUNT))
    return replace(recipe, scene=replace(recipe.scene, trajectory=trajectory))


def _axes() -> np.ndarray:
    """Forward, port and up of the mount in the world, from the words: nose up, starboard down."""
    heading, pitch, roll = MOUNT.values()
    ahead = np.array([np.sin(heading), np.cos(heading), 0.0])
    level_port = np.array([-np.cos(heading), np.sin(heading), 0.0])
    forward = np.cos(pitch) * ahead + np.sin(pitch) * np.array([0.0, 0.0, 1.0])
    port = np.cos(roll) * level_port + np.sin(roll) * np.cross(forward, level_port)
    return np.stack([forward, port, np.cross(forward, port)])


def _nearest_facet(look: np.ndarray, corners: np.ndarray) -> tuple[int, float]:
    """Facet that a ray from the origin meets first, and its distance: every facet is tried (Moller and Trumbore)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    across = np.cross(look, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / np.sum((b - a) * across, axis=1)
        u = -np.sum(a * across, axis=1) * scale
        turned = np.cross(-a, b - a)
        v, t = turned @ look * scale, np.sum((c - a) * turned, axis=1) * scale
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    return int(np.argmin(t)), float(t.min())


def test_image_cloud_bearing_and_truth_follow_a_tilted_mount() -> None:
    made = plan(_tilted())
    traced = trace_frame(made, 0)
    heard = beamform_frame(made, 0, traced)
    values, body = range_frame(made, 0, traced, heard), traced.frame.moment.bodies[0]
    axes, array = _axes(), np.array([0.0, 0.0, -5.0])

    source, met = np.array([14.0, -5.0, -10.0]), 0.0
    for _ in range(5):  # labels are of where its sound meets the hull, which moves
        met = float(np.linalg.norm(body.pose.position + met * body.velocity - source)) / 1540.0
    body = replace(body, pose=replace(body.pose, position=body.pose.position + met * body.velocity))

    snap = axes @ (source - array)
    assert heard.estimates is not None and heard.estimates.position[0] == pytest.approx(snap, abs=0.01)

    corners = (body.pose.to_world(body.mesh.corners) - array) @ axes.T
    looks = direction(heard.image.azimuth, heard.image.elevation[:, None])
    target, distance = traced.truth.beam_target, traced.truth.beam_range
    near = (
        looks @ (corners.mean(axis=(0, 1)) / 20)
        > np.cos(np.deg2rad(4)) * np.linalg.norm(corners.mean(axis=(0, 1))) / 20
    )
    assert (target[~near] < 0).all() and (target >= 0).any()
    for row, column in np.argwhere(near):
        facet, far = _nearest_facet(looks[row, column], corners)
        assert (target[row, column] >= 0) == np.isfinite(far)
        if np.isfinite(far):
            assert traced.truth.beam_facet[row, column] == facet and distance[row, column] == pytest.approx(
                far, rel=1e-6
            )

    row, column = np.unravel_index(np.argmax(heard.image.energy), heard.image.energy.shape)
    assert (target[row - 2 : row + 3, column - 2 : column + 3] >= 0).any()
    found = np.stack([values["/cloud", name] for name in "xyz"], axis=-1)
    there = found[np.isfinite(found[..., 0])] @ axes + array
    hull = body.pose.to_world(body.mesh.vertices)
    gap = np.linalg.norm(there[:, None] - hull, axis=2).min(axis=1)
    assert len(there) and np.median(gap) < 0.2


def test_int16_is_decoded_by_its_scale_alone() -> None:
    """What a frame is rendered to: pressure in Pa once the stated scale is applied."""
    recipe = remus(converter=Converter(bits=16, full_scale=200.0))
    found = render(plan(recipe), 0)["signals/pressure"]
    exact = render(plan(remus()), 0)["signals/pressure"]
    scale = found.attrs.get("scale_factor", 1.0)
    assert np.abs(found.values * scale - exact.values).max() <= 0.501 * 200.0 / 2**15


def test_a_rendered_frame_is_in_its_units() -> None:
    found = render(plan(remus(converter=Converter(bits=16, full_scale=200.0))), 0)["signals/pressure"]
    exact = render(plan(remus()), 0)["signals/pressure"]
    assert found.attrs["units"] == "Pa" and np.abs(found.values).max() == pytest.approx(
        np.abs(exact.values).max(), rel=1e-3
    )


def test_narrow_lobes_are_synthesised_as_stated() -> None:
    """The amplitude of a narrow lobe varies over the array; the fast synthesis must follow it as the exact one does."""
    recipe = remus()
    scene = replace(recipe.scene, physics=replace(recipe.scene.physics, scattering=MirrorLobe(width=np.deg2rad(5))))
    made = plan(replace(recipe, scene=scene))
    traced = trace_frame(made, 0)
    echoes = np.flatnonzero(~traced.arrivals.direct)
    chosen = echoes[np.argsort(-traced.arrivals.amplitude[echoes])[:40]]
    reception = reception_of(made, traced.frame)
    arguments = traced.arrivals.select(np.sort(chosen)), traced.frame.moment.snaps, reception
    exact, fast = DirectSum().pressure(*arguments)[0], GriddedSynthesis().signals(*arguments).pressure
    assert np.abs(fast - exact).max() < 2e-4 * np.abs(exact).max()


def test_a_target_half_in_the_shadow_is_labelled_where_it_is() -> None:
    """Downward refraction hides the upper half of a ball: what a beam meets is on it, and some of it is unseen."""
    scene = Scene(
        world=World(
            environment=Environment(
                depth=10.0, sound_speed=Tabulated(depth=(0.0, 10.0), speed=(1540.0, 1480.0)), absorption=Absorption()
            ),
            targets=(
                Target(name="ball", shape=Sphere(radius=0.9, edge=0.15), motion=Still(position=(50.0, 0.0, -1.5))),
            ),
            sources=(SnappingShrimp(position=(10.0, -3.0)),),
        ),
        sonar=Sonar(beams=BeamGrid(azimuth_span=0.1, azimuths=21, elevation_span=0.3, elevations=61)),
        trajectory=Trajectory(sonar=Still(position=(0.0, 0.0, -1.2), heading=0.5 * np.pi)),
    )
    truth = trace_frame(plan(replace(remus(), scene=scene)), 0).truth
    on = truth.beam_target >= 0
    assert on.any() and (np.abs(truth.beam_range[on] - 50.0) < 1.0).all()
    assert truth.visible_fraction[0] < 0.9


def test_a_loud_snap_after_a_quiet_one_still_gives_an_image() -> None:
    recipe = remus(frames=1)
    quiet = SnappingShrimp(name="quiet", position=(14.0, -5.0), source_level=180.0)
    loud = SnappingShrimp(name="loud", position=(10.0, 4.0), source_level=195.0, snap_times=(4e-3,))
    world = replace(recipe.scene.world, sources=(quiet, loud))
    made = plan(replace(recipe, scene=replace(recipe.scene, world=world)))
    image = beamform_frame(made, 0, trace_frame(made, 0)).image
    assert image is not None and np.isfinite(image.energy).all()
