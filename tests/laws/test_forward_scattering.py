"""Sound that has to pass a body: blocked, or with the wave that makes the shadow; against exact series and Fresnel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import fresnel

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Track
from sonarsynth.scattering import Kirchhoff, MirrorLobe, PartlyReflecting
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Sphere
from tests.echoes import ARRAY, BOTTOM_DEPTH, EAST, PROFILE, ROMANIS, SCATTERED, WATER, C, F, body, heard, transfer
from tests.spheres import exact_sphere


def straight(source: Floats, array: Floats = ARRAY) -> Floats:
    """Pressure (frequency,) of the direct wave."""
    r = np.linalg.norm(np.asarray(source) - array)
    return np.exp(-2j * np.pi * F * r / C) / r


def ball(radius: float, fine: float = 0.14) -> Mesh:
    return mesh_of(Sphere(radius=radius, edge=fine * np.sqrt(C / 85e3 * radius)))


@pytest.mark.parametrize(
    ("radius", "degrees", "level", "error"),
    [
        (0.25, 0.0, 1.3, 0.17),  # the bright spot, where all of the edge adds up
        (0.25, 1.0, 1.3, 0.12),  # the shadow ends at 2.6 degrees
        (0.25, 2.0, 1.0, 0.09),
        (0.25, 3.0, 0.8, 0.07),
        (0.25, 5.0, 0.5, 0.05),
        (0.25, 10.0, 0.3, 0.04),
        (0.5, 0.0, 2.5, 0.33),
        (0.5, 3.0, 1.9, 0.11),
        (0.5, 8.0, 0.6, 0.08),
    ],
)
def test_behind_and_beside_a_sphere_the_whole_field_is_that_of_its_series(
    radius: float, degrees: float, level: float, error: float
) -> None:
    """25 to 85 kHz; level in dB of the whole field, error of it in parts of the direct wave."""
    out, back = 12.0, 10.0
    centre, turn = ARRAY + [back, 0.0, 0.0], np.pi - np.deg2rad(degrees)
    source = centre + out * np.array([-np.cos(turn), np.sin(turn), 0.0])
    found = transfer(heard((body(ball(radius), centre),), source))
    exact = straight(source) + exact_sphere(F, C, radius, out, back, np.cos(turn))
    assert np.abs(20.0 * np.log10(np.abs(found / exact))).max() < level
    assert np.abs(found - exact).max() < error * np.abs(straight(source)).max()


def test_far_ahead_a_sphere_sends_half_k_a_squared_a_quarter_turn_late() -> None:
    radius, out, back = 0.1, 300.0, 250.0
    source = ARRAY + [out + back, 0.0, 0.0]
    found = heard((body(ball(radius), ARRAY + [back, 0.0, 0.0]),), source)
    ahead = transfer(found.select(~found.direct)) * out * back
    expected = -0.5j * (2.0 * np.pi * F / C) * radius**2
    curved = 0.5 * (2.0 * np.pi * F / C) * radius**2 * (1.0 / out + 1.0 / back)  # rad: from the middle to the edge
    expected = expected * np.sinc(0.5 * curved / np.pi) * np.exp(-0.5j * curved)
    delay = np.exp(2j * np.pi * F * (out + back) / C)
    np.testing.assert_allclose(ahead * delay, expected, rtol=0.01)


@pytest.mark.parametrize("shift", [0.0, 0.2, 0.7])
def test_the_shadow_of_a_panel_is_fresnels(shift: float) -> None:
    """Babinet: the whole field is what passes beside a rectangle, by Fresnel's integrals."""
    out, back, width, height = 12.0, 10.0, 0.6, 0.4
    panel = mesh_of(Box(size=(0.05, width, height), edge=0.02))
    place = ARRAY + [back, shift, 0.05]
    source = ARRAY + [out + back, 0.0, 0.0]
    found = transfer(heard((body(panel, place),), source)) / straight(source)
    near = back - 0.025 + 0.05  # the lit side
    scale = np.sqrt(2.0 * F / C * (1.0 / near + 1.0 / (out + back - near)))

    def passed(middle: float, across: float) -> Floats:
        s, c = fresnel(np.multiply.outer(scale, [middle - 0.5 * across, middle + 0.5 * across]))
        return (np.diff(c, axis=1) - 1j * np.diff(s, axis=1))[:, 0]

    expected = 1.0 - 0.5j * passed(shift, width) * passed(0.05, height)
    np.testing.assert_allclose(found, expected, atol=0.02)


def test_sound_is_blocked_or_scattered_forward_never_both() -> None:
    mesh, place = ball(0.3, 0.3), ARRAY + [10.0, 0.0, 0.0]
    source = ARRAY + [20.0, 0.3, 0.0]
    blocked, scattered = (heard((body(mesh, place),), source, (law,)) for law in (Kirchhoff(), SCATTERED))
    assert not len(blocked.delay)  # neither the direct wave, nor an echo: no facet is both lit and seen
    assert scattered.direct.sum() == 1
    ahead = scattered.select(~scattered.direct)
    assert len(ahead.facet) == len(set(ahead.facet.tolist())) > 1000
    assert (ahead.target == 0).all() and ahead.coherent.all()
    beside = ARRAY + [3.0, 6.0, 1.0]
    echoes, more = (heard((body(mesh, place),), beside, (law,)) for law in (Kirchhoff(), SCATTERED))
    assert len(more.delay) > len(echoes.delay)
    for name in ("amplitude", "delay", "corner_delays", "facet"):
        np.testing.assert_array_equal(getattr(more, name)[: len(echoes.delay)], getattr(echoes, name))
    np.testing.assert_array_equal(more.expansion.amplitude[: len(echoes.delay)], echoes.expansion.amplitude)


@pytest.mark.parametrize(
    "law",
    [
        Kirchhoff(forward="scattered", surface="soft"),
        Kirchhoff(forward="scattered", roughness=0.01, slope=0.3, diffuse=0.5),
        Kirchhoff(forward="scattered", surface=PartlyReflecting(density_ratio=1.5, speed_ratio=1.2, loss_tangent=0.1)),
    ],
)
def test_the_shadow_does_not_tell_what_a_body_is_made_of(law: Kirchhoff) -> None:
    mesh, place, source = ball(0.3, 0.3), ARRAY + [10.0, 0.0, 0.0], ARRAY + [20.0, 0.1, 0.2]
    rigid, other = (heard((body(mesh, place),), source, (each,)) for each in (SCATTERED, law))
    np.testing.assert_allclose(transfer(other), transfer(rigid), rtol=1e-9)


def test_straight_ahead_source_and_array_may_be_exchanged() -> None:
    """A box that is no mirror image of itself: lit from one end and from the other it has the same outline."""
    mesh = mesh_of(Box(size=(0.5, 0.3, 0.2), edge=0.015))
    place, source = ARRAY + [9.0, 0.05, 0.03], ARRAY + [20.0, 0.0, 0.0]
    bodies = (body(mesh, place, turned=0.9),)
    there, back = transfer(heard(bodies, source)), transfer(heard(bodies, ARRAY, array=source))
    np.testing.assert_allclose(there, back, atol=0.03 * np.abs(straight(source)).max())


@pytest.mark.parametrize("boundary", ["surface", "bottom"])
@pytest.mark.parametrize("first", [True, False])
def test_what_comes_by_a_boundary_is_shadowed_like_what_comes_straight(boundary: str, first: bool) -> None:
    """With the body after the reflection, or before it: as from the snap's image, or at the array's."""
    level = 0.0 if boundary == "surface" else -BOTTOM_DEPTH
    source = ARRAY + [24.0, 0.0, 3.0]
    flip = np.array([1.0, 1.0, -1.0])
    up = np.array([0.0, 0.0, 2.0 * level])
    image, there = source * flip + up, ARRAY * flip + up
    start, end = (image, ARRAY) if first else (source, there)
    place = (end + 0.3 * (start - end)) if first else (start + 0.3 * (end - start))
    bodies = (body(ball(0.4, 0.3), place + [0.0, 0.15, 0.0]),)
    found = heard(bodies, source, bounces=1)
    touched = found.surface if boundary == "surface" else found.bottom
    some = found.select((touched == 1) & (found.direct | ((found.arrives_by > 0) == (not first))))
    free = Environment(depth=3 * BOTTOM_DEPTH, sound_speed=WATER.sound_speed, absorption=WATER.absorption)
    lower = np.array([0.0, 0.0, -BOTTOM_DEPTH])
    below = (replace(bodies[0], pose=Pose(bodies[0].pose.position + lower, EAST)),)
    alone = heard(below, start + lower, array=end + lower, water=free)
    expected = transfer(alone)
    assert np.abs(expected[-1]) < 0.3 * np.abs(straight(start, end)[-1])
    sign = np.exp(1j * found.phase[touched == 1][0]) * np.sign(found.boundary[touched == 1][0])
    loss = abs(found.boundary[found.direct & (touched == 1)][0])
    np.testing.assert_allclose(transfer(some), sign * loss * expected, atol=0.02 * np.abs(straight(start, end)).max())


def test_a_body_in_the_shadow_of_another_adds_nothing() -> None:
    """One shadow, not two: the farther panel is lit by nothing, and the nearer one's shadow goes through it."""
    large, small = (mesh_of(Box(size=(0.02, size, size), edge=0.03)) for size in (0.8, 0.3))
    near, far = body(large, ARRAY + [15.0, 0.0, 0.0], "near"), body(small, ARRAY + [12.0, 0.0, 0.0], "far")
    source = ARRAY + [22.0, 0.0, 0.0]
    alone = heard((near,), source)
    for bodies in ((near, far), (far, near)):
        both = heard(bodies, source, (SCATTERED,) * 2)
        assert set(both.target[~both.direct].tolist()) == {bodies.index(near)}
        np.testing.assert_allclose(transfer(both), transfer(alone), rtol=1e-12)


@pytest.mark.parametrize("law", [Kirchhoff(), MirrorLobe()])
def test_a_body_that_blocks_hides_the_shadow_as_well(law: object) -> None:
    large, small = (mesh_of(Box(size=(0.02, size, size), edge=0.03)) for size in (0.9, 0.3))
    source = ARRAY + [22.0, 0.0, 0.0]
    for wall, other in ((15.0, 12.0), (9.0, 12.0)):
        bodies = (body(large, ARRAY + [wall, 0.0, 0.0], "wall"), body(small, ARRAY + [other, 0.0, 0.0], "other"))
        assert not len(heard(bodies, source, (law, SCATTERED)).delay)


def test_the_hydrophones_hear_the_shadow_each_where_it_is() -> None:
    """The shadow wave at sensors off the centre, by the wavefronts of the paths and by tracing to the sensor."""
    bodies = (body(ball(0.25, 0.2), ARRAY + [6.0, 0.0, 0.0]),)

    def shadow(source: Floats, array: Floats, sensor: Floats | None = None) -> Floats:
        every, echoes = (heard(bodies, source, (law,), array=array) for law in (SCATTERED, Kirchhoff()))
        return transfer(every.select(~every.direct), sensor) - transfer(echoes.select(~echoes.direct), sensor)

    for side in (0.25, 2.5):
        source = ARRAY + [14.0, side, 0.1]
        for sensor in ROMANIS.position[[0, len(ROMANIS.position) // 2, -1]]:
            there = shadow(source, Pose(ARRAY, EAST).to_world(sensor))
            error = 1e-3 * np.abs(straight(source)).max()
            np.testing.assert_allclose(shadow(source, ARRAY, sensor), there, atol=error, err_msg=f"{side} {sensor}")


def test_a_body_that_moves_keeps_its_shadow() -> None:
    """Along the line of sight nothing changes but where it is when the sound passes it."""
    mesh, source = ball(0.3, 0.25), ARRAY + [20.0, 0.0, 0.0]
    velocity = np.array([2.0, 0.0, 0.0])
    place = ARRAY + [10.0, 0.1, 0.0]
    swimmer = replace(body(mesh, place), velocity=velocity)
    moved = heard((swimmer,), source, moving=Track(Pose(ARRAY, EAST), np.zeros(3)))
    met = place + velocity * 10.0 / C
    still = heard((body(mesh, met),), source)
    np.testing.assert_allclose(transfer(moved), transfer(still), atol=2e-3 * np.abs(straight(source)).max())
    assert np.abs(moved.doppler).max() < 1e-5  # ahead there is no Doppler


def test_bent_rays_are_cancelled_like_straight_ones() -> None:
    panel = mesh_of(Box(size=(0.02, 1.0, 1.0), edge=0.02))
    source = ARRAY + [20.0, 0.0, 0.0]
    bends = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([1485.0, 1515.0]))
    sagged = 10.0 * 10.0 * 1.0 / (2.0 * C)  # of a ray between ends 20 m apart in 1/s
    found = [
        transfer(heard((body(panel, ARRAY + [10.0, 0.0, down]),), source, profile=profile))
        for profile, down in ((bends, -sagged), (PROFILE, 0.0))
    ]
    np.testing.assert_allclose(np.abs(found[0]), np.abs(found[1]), atol=0.03 * np.abs(straight(source)).max())
    assert np.abs(found[0][-1]) < 0.45 * np.abs(straight(source)[-1])
