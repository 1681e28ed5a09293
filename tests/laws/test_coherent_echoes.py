"""Echoes of smooth and rough facets in a frame: against exact series, and by their laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.geometry import Pose
from sonarsynth.products import Arrivals
from sonarsynth.scattering import Isotropic, Kirchhoff, MirrorLobe, PartlyReflecting
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Sphere
from tests.echoes import ARRAY, BOTTOM_DEPTH, EAST, ROMANIS, C, F, body, heard, transfer
from tests.spheres import exact_sphere


def echo(*scene: object, **more: object) -> Arrivals:
    """Every path of `heard` but the direct one."""
    found = heard(*scene, **more)
    return found.select(~found.direct)


@pytest.mark.parametrize("angle", [0.0, 60.0, 100.0])
@pytest.mark.parametrize("surface", ["rigid", "soft"])
def test_a_sphere_near_by_echoes_as_its_series_says_in_level_and_phase(angle: float, surface: str) -> None:
    radius, centre = 0.25, ARRAY + [10.0, 0.0, 0.0]
    mesh = mesh_of(Sphere(radius=radius, edge=0.1 * np.sqrt(C / 85e3 * radius)))
    turn = np.deg2rad(angle)
    source = centre + 12.0 * np.array([-np.cos(turn), np.sin(turn), 0.0])
    found = transfer(echo((body(mesh, centre),), source, (Kirchhoff(surface=surface),)))
    ratio = found / exact_sphere(F, C, radius, 12.0, 10.0, np.cos(turn), rigid=surface == "rigid")
    assert np.abs(20.0 * np.log10(np.abs(ratio))).max() < 0.5
    assert np.abs(np.angle(ratio)).max() < 0.2


def test_facets_cut_into_parts_echo_the_same() -> None:
    """A panel of 30 cm near its mirror direction, cut to 1.6 and to 0.8 cm: what differs is the distances to parts."""
    levels = []
    for edge in (0.016, 0.008):
        panel = mesh_of(Box(size=(0.3, 0.3, 0.3), edge=edge))
        found = echo(
            (body(panel, ARRAY + [12.0, 0.0, 0.0], turned=0.45 * np.pi),), ARRAY + [1.0, 3.0, 0.5], (Kirchhoff(),)
        )
        levels.append(transfer(found))
    assert np.abs(levels[0] - levels[1]).max() < 2e-3 * np.abs(levels[1]).max()


def test_roughness_takes_from_the_coherent_echo_what_it_scatters() -> None:
    """Eckart's factor on a panel in mirror position, and by power the lobe of the rest."""
    panel, source = mesh_of(Box(size=(0.4, 0.4, 0.4), edge=0.02)), ARRAY + [0.0, 0.0, 2.0]
    place = (body(panel, ARRAY + [10.0, 0.0, 1.0]),)
    smooth = transfer(echo(place, source, (Kirchhoff(),)))
    height = 0.003
    found = echo(place, source, (Kirchhoff(roughness=height, slope=0.2),))
    left = transfer(found.select(found.coherent)) / smooth
    cosine = (10.0 - 0.2) / np.hypot(10.0 - 0.2, 1.0)
    np.testing.assert_allclose(left, np.exp(-0.5 * (2.0 * np.pi * F / C * height * 2.0 * cosine) ** 2), rtol=2e-2)
    rough = found.select(~found.coherent)
    shape = facet_response(
        F, rough.coherent, rough.corner_delays, rough.coherent_fraction, rough.height_delay_std, rough.centre
    )
    np.testing.assert_allclose(np.abs(shape[0]) ** 2, 1.0 - np.abs(left) ** 2, atol=2e-3)
    power = ((rough.scattering**2) * np.abs(shape[:, -1]) ** 2).sum()
    assert power == pytest.approx(0.4**2 / (8.0 * np.pi * 0.2**2), rel=0.05)  # sigma0 at its peak


def test_incoherent_echoes_have_no_common_phase() -> None:
    """Mean power of the sum over frequencies is the sum of powers, within the scatter of some tens of draws."""
    ball = mesh_of(Sphere(radius=0.5, edge=0.03))
    found = echo(
        (body(ball, ARRAY + [10.0, 0.0, 1.0]),), ARRAY + [0.0, 0.0, 2.0], (Kirchhoff(roughness=0.02, slope=0.5),)
    )
    rough = found.select(~found.coherent)
    power = (rough.amplitude**2).sum()
    frequency = np.linspace(25e3, 85e3, 400)
    total = rough.amplitude @ np.exp(-2j * np.pi * np.multiply.outer(rough.delay, frequency))
    assert 0.6 < np.mean(np.abs(total) ** 2) / power < 1.7


def test_a_body_of_water_is_not_heard_and_a_dense_one_is_rigid() -> None:
    mesh, place, source = mesh_of(Sphere(radius=0.2, edge=0.012)), ARRAY + [10.0, 0.0, 0.0], ARRAY + [2.0, 5.0, 1.0]

    def by(surface: object) -> Floats:
        return transfer(echo((body(mesh, place),), source, (Kirchhoff(surface=surface),)))

    rigid = by("rigid")
    heavy = by(PartlyReflecting(density_ratio=1e6, speed_ratio=1.0))
    np.testing.assert_allclose(heavy, rigid, rtol=1e-5)
    np.testing.assert_allclose(by("soft"), -rigid, rtol=1e-12)
    same = echo(
        (body(mesh, place),), source, (Kirchhoff(surface=PartlyReflecting(density_ratio=1.0, speed_ratio=1.0)),)
    )
    assert not len(same.delay)
    like = by(PartlyReflecting(density_ratio=1.1, speed_ratio=1.0))
    np.testing.assert_allclose(like, 0.1 / 2.1 * rigid, rtol=1e-9)


def test_the_phase_of_a_lossy_reflection_is_that_of_each_hydrophone() -> None:
    """A panel in mirror position under its critical angle: the same from an array whose centre is at the hydrophone."""
    panel, source = mesh_of(Box(size=(0.02, 0.3, 0.3), edge=0.01)), ARRAY + [13.0, -1.0, 0.0]
    place = (body(panel, ARRAY + [7.0, 1.5, 0.0], turned=0.0),)  # its large faces look north and south
    law = (Kirchhoff(surface=PartlyReflecting(density_ratio=2.0, speed_ratio=1.6, loss_tangent=0.02)),)
    found = echo(place, source, law)
    rigid = echo(place, source, (Kirchhoff(),))
    far = np.argmax(np.abs(ROMANIS.position[:, 1]))
    there = echo(place, source, law, array=ARRAY + Pose(ARRAY, EAST).turn_to_world(ROMANIS.position[far]))
    assert not rigid.expansion.delay.shape[1]
    shared = found.select(np.isin(found.facet, there.facet))
    exact = there.select(np.isin(there.facet, shared.facet))
    np.testing.assert_array_equal(shared.facet, exact.facet)
    turned = exact.phase - shared.phase
    assert np.abs(turned).max() > 0.1
    assert not rigid.expansion.phase.shape[1] and not found.expansion.delay.shape[1]
    np.testing.assert_allclose(shared.expansion.over("phase", ROMANIS.position[far][None])[:, 0], turned, atol=2e-3)
    assert found.wavefront_error < 2e-3 / (2.0 * np.pi * 85e3)


def test_facets_near_the_limb_are_as_loud_at_each_hydrophone_as_it_sees_them() -> None:
    """A small sphere, 140 degrees off backscatter: the echo at the rim of the array, against an array that is there."""
    ball = mesh_of(Sphere(radius=0.1, edge=0.008))
    place, source = (body(ball, ARRAY + [5.0, 1.0, 1.0]),), ARRAY + [9.0, -1.0, -1.0]
    law = (Kirchhoff(),)
    found = echo(place, source, law)
    for far in (np.argmax(ROMANIS.position[:, 1]), np.argmin(ROMANIS.position[:, 1])):
        q = ROMANIS.position[far]
        seen = echo(place, source, law, array=ARRAY + Pose(ARRAY, EAST).turn_to_world(q))
        away = np.linalg.norm(found.radius[:, None] * found.direction - q, axis=1)
        louder = 1.0 + found.expansion.over("amplitude", q[None])[:, 0]
        heard = replace(
            found,
            delay=found.delay + (away - found.radius) / C,
            amplitude=found.amplitude * found.radius / away * louder,
        )
        exact = transfer(seen)
        assert np.abs(transfer(heard) - exact).max() < 0.05 * np.abs(exact).max()


def test_source_and_array_exchanged_hear_the_same() -> None:
    mesh = mesh_of(Sphere(radius=0.2, edge=0.015))
    place, source = ARRAY + [9.0, 2.0, 1.0], ARRAY + [3.0, -6.0, -2.0]
    law = Kirchhoff(surface=PartlyReflecting(density_ratio=2.0, speed_ratio=1.3), roughness=0.001)
    there = echo((body(mesh, place),), source, (law,))
    back = echo((body(mesh, place),), ARRAY, (law,), array=np.array(source, float))
    for part in (True, False):
        one, other = (a.select(a.coherent == part) for a in (there, back))
        sent, returned = transfer(one), transfer(other)
        assert np.abs(sent - returned).max() < 2e-4 * np.abs(sent).max()  # but for the faintest


def test_each_target_has_its_law_and_hides_what_is_behind_it() -> None:
    ball = mesh_of(Sphere(radius=0.3, edge=0.02))
    near, far = body(ball, ARRAY + [8.0, 0.3, 0.0], "near"), body(ball, ARRAY + [12.0, 0.0, 0.0], "far")
    source = ARRAY + [0.0, 0.0, 1.0]
    laws = (Isotropic(strength=1e-3), Kirchhoff(roughness=0.01))
    both = echo((near, far), source, laws)
    assert not both.coherent[both.target == 0].any()
    assert both.coherent[both.target == 1].any() and not both.coherent[both.target == 1].all()
    alone = echo((far,), source, laws[1:])
    seen, free = set(both.facet[both.target == 1].tolist()), set(alone.facet.tolist())
    assert seen < free and len(seen) < 0.9 * len(free)
    # those that are left are as if they were alone
    one = both.select((both.target == 1) & both.coherent)
    other = alone.select(alone.coherent & np.isin(alone.facet, one.facet))
    one = one.select(np.isin(one.facet, other.facet))
    np.testing.assert_allclose(one.amplitude, other.amplitude, rtol=1e-12)
    np.testing.assert_allclose(one.delay, other.delay, rtol=1e-14)


@pytest.mark.parametrize("height", [0.3, 0.3 - 1e-12])
def test_a_ball_that_lies_on_the_bed_echoes(height: float) -> None:
    ball = mesh_of(Sphere(radius=0.3, edge=0.02))
    lying = body(ball, np.array([10.0, 0.0, height - BOTTOM_DEPTH + 1e-12]))
    found = echo((lying,), ARRAY + [0.0, 3.0, 0.0], (Kirchhoff(),), bounces=1)
    assert np.isfinite(found.amplitude).all() and len(found.delay) > 1000
    up = echo(
        (replace(lying, pose=Pose(lying.pose.position + [0.0, 0.0, 1e-3], EAST)),),
        ARRAY + [0.0, 3.0, 0.0],
        (Kirchhoff(),),
    )
    direct = found.select((found.surface == 0) & (found.bottom == 0))
    np.testing.assert_allclose(np.abs(transfer(direct)), np.abs(transfer(up)), rtol=0.02)


def test_a_lobe_is_as_it_was_beside_a_coherent_target() -> None:
    ball = mesh_of(Sphere(radius=0.3, edge=0.03))
    one, two = body(ball, ARRAY + [10.0, 2.0, 0.0], "one"), body(ball, ARRAY + [10.0, -2.0, 0.0], "two")
    source = ARRAY + [0.0, 0.0, 1.0]
    mixed = echo((one, two), source, (MirrorLobe(), Kirchhoff()))
    alone = echo((one,), source, (MirrorLobe(),))
    kept = mixed.select(mixed.target == 0)
    shared = np.isin(kept.facet, alone.facet)
    np.testing.assert_allclose(kept.amplitude[shared], alone.amplitude, rtol=1e-12)
