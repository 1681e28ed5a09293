"""Facets at the limb of a body, which some hydrophones see and others do not: one expansion against each alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals, Kind
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import POINT, Elements, Sonar
from sonarsynth.scattering import Kirchhoff, MirrorLobe, PartlyReflecting
from sonarsynth.scattering.components import CoherentKirchhoff
from sonarsynth.scattering.facet_geometry import patches
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, OcclusionPoint, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere
from sonarsynth.tracing.arrivals import trace
from sonarsynth.tracing.echoes import echoes
from sonarsynth.tracing.facet_paths import facet_paths
from tests.echoes import EAST, PROFILE, ROMANIS, C
from tests.laws.test_synthesis import some_of

WATER = Environment(depth=200.0, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))
PLACE = np.array([0.0, 0.0, -100.0])
SONAR = Sonar()
BALL = mesh_of(Sphere(radius=0.08, edge=0.008))
SNAP = Emission(PLACE + [4.0, 6.0, 1.0], 0.0, LogarithmicBubble(), None)
ARRAY = some_of(ROMANIS, 6)
FAR = np.argsort(np.linalg.norm(ARRAY.position, axis=1))[[-1, -2, 30]]
SINGLE = replace(POINT, face=ARRAY.face)
FLUID = PartlyReflecting(density_ratio=1.5, speed_ratio=1.2)
LAWS = [(Kirchhoff(), 5.0), (Kirchhoff(surface=FLUID, roughness=0.001), 4.0)]


def traced(
    law: Kirchhoff | MirrorLobe,
    place: Floats,
    array: Elements,
    occlusion: OcclusionPoint = "sensors",
) -> Arrivals:
    """Echoes of a ball 8 m ahead, lit from the side: the coherent ones, or those of laws with a diffuse floor."""
    ball = PlacedTarget("ball", BALL, Pose(PLACE + [8.0, 0.3, 0.2], EAST), np.zeros(3))
    receiver = Receiver(Pose(place, EAST), array, SONAR)
    none = Tolerances(negligible=0.0, occlusion=occlusion)
    context = FrameContext(0.0, (ball,), (SNAP,), Medium(WATER, PROFILE), receiver, (law,), none)
    found = trace(context, AutoTracing())
    return found.select(found.coherent == (isinstance(law, Kirchhoff) and law.diffuse == 0.0))


def heard(found: Arrivals, array: Elements, start: float) -> Floats:
    return DirectSum().pressure(found, (SNAP,), Reception(array, SONAR, None, start, 512))[0]


def alone(law: Kirchhoff | MirrorLobe, sensor: int) -> Arrivals:
    return traced(law, Pose(PLACE, EAST).to_world(ARRAY.position[sensor][None])[0], SINGLE)


@pytest.mark.long
@pytest.mark.parametrize(("law", "better"), LAWS)
def test_one_expansion_hears_what_each_hydrophone_sees(law: Kirchhoff, better: float) -> None:
    found, centre = (traced(law, PLACE, ARRAY, occlusion) for occlusion in ("sensors", "centre"))
    start, part = found.delay.min() - 2e-4, ARRAY.select(FAR)
    assert found.hidden(ARRAY.count)[:, FAR].any()
    exact = np.vstack([heard(alone(law, int(n)), SINGLE, start) for n in FAR])
    mine, plain = (np.linalg.norm(heard(x.for_sensors(FAR, ARRAY.count), part, start) - exact) for x in (found, centre))
    # fourth degree in the aperture errs 5e-4 here, 8e-4 of a rough fluid ball
    assert mine < 1e-3 * np.linalg.norm(exact)
    assert better * mine < plain


def test_facets_that_the_centre_does_not_see_are_heard_where_they_are_seen() -> None:
    """Facet by facet: amplitudes where each is seen, those of a hydrophone alone; below 0 where it is not.

    Least alike are those that the snap grazes as well: their amplitudes turn within the array."""
    found = traced(Kirchhoff(), PLACE, ARRAY)
    louder = 1.0 + found.expansion.over("amplitude", ARRAY.position[FAR])
    beyond = found.occluded[:, 0] >= 128
    assert (found.amplitude[beyond] < 0.0).all()
    assert (found.amplitude[~beyond] > 0.0).all()
    assert not found.seen_from_centre.occluded.any()
    for n, sensor in enumerate(FAR):
        exact = alone(Kirchhoff(), int(sensor))
        away = found.radius[:, None] * found.direction - ARRAY.position[sensor]
        mine = found.amplitude * louder[:, n] * found.radius / np.linalg.norm(away, axis=1)
        seen = ~found.hidden(ARRAY.count)[:, sensor]
        assert set(found.facet[seen]) == set(exact.facet)
        at = dict(zip(exact.facet, exact.amplitude, strict=True))
        error = np.abs(mine[seen] - [at[f] for f in found.facet[seen]]) / exact.amplitude.max()
        assert np.sqrt((error**2).mean()) < 1e-3
        assert error.max() < 1e-2
    assert beyond.sum() > 3


@pytest.mark.parametrize("law", [Kirchhoff(), Kirchhoff(surface=FLUID)])
def test_amplitudes_go_on_from_those_that_are_seen(law: Kirchhoff) -> None:
    """The same where a facet is lit and seen, continuous past that in value and slope, and 0 where it is not lit."""
    whole, count = patches(BALL), 401
    patch = whole.select(np.zeros(count, int))
    normal = patch.normal[0]
    side = np.cross(normal, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    angle = np.linspace(0.3, -0.3, count)[:, None]  # rad above the plane of the facet
    scattered = np.cos(angle) * side + np.sin(angle) * normal
    incident = np.broadcast_to(0.8 * side - 0.6 * normal, (count, 3))
    wavenumber = np.full(count, 200.0)
    plain, goes_on = (
        CoherentKirchhoff(law, b).amplitude(incident, scattered, patch, wavenumber) for b in (False, True)
    )
    seen = scattered @ normal > 0.0
    assert goes_on[seen] == pytest.approx(plain[seen], rel=1e-12)
    assert not plain[~seen].any()
    assert np.abs(np.diff(goes_on, 2)).max() < 1e-3 * np.abs(goes_on).max()
    assert not CoherentKirchhoff(law, True).amplitude(-incident, scattered, patch, wavenumber).any()


@pytest.mark.parametrize(
    "law", [MirrorLobe(reflectivity=0.5, diffuse=0.2), Kirchhoff(diffuse=0.2), Kirchhoff(diffuse=0.2, roughness=1e-3)]
)
def test_facets_with_a_diffuse_floor_are_heard_where_the_centre_does_not_see_them(law: MirrorLobe | Kirchhoff) -> None:
    found = traced(law, PLACE, ARRAY)
    for sensor in FAR:
        seen = ~found.hidden(ARRAY.count)[:, sensor]
        assert set(found.facet[seen]) == set(alone(law, int(sensor)).facet)


@pytest.mark.parametrize("profile", [PROFILE, Profile(np.array([0.0, 200.0]), np.array([1540.0, 1500.0]))])
def test_paths_that_serve_any_snap_serve_those_that_are_known(profile: Profile) -> None:
    """Facets that only hydrophones beside the centre face are among them: reflected sound may light them."""
    ball = PlacedTarget("ball", BALL, Pose(PLACE + [8.0, 0.3, 0.2], EAST), np.zeros(3))
    receiver, law = Receiver(Pose(PLACE, EAST), ARRAY, SONAR), (MirrorLobe(),)
    medium, sees = Medium(WATER, profile), Tolerances(occlusion="sensors")
    context = FrameContext(0.0, (ball,), (SNAP,), medium, receiver, law, sees)
    known, every = (facet_paths(context, AutoTracing(), snaps=snaps) for snaps in ((SNAP,), None))
    assert set(known.facets.facet) < set(every.facets.facet)
    found, sought = (echoes(array, 0, (law[0].parts,), Kind.ECHO) for array in (known, every))
    np.testing.assert_array_equal(found.facet, sought.facet)
    np.testing.assert_array_equal(found.amplitude, sought.amplitude)
