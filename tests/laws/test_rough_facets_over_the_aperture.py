"""Rough facets at each hydrophone: one expansion over the array against each hydrophone traced alone."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import POINT, Elements, Sonar
from sonarsynth.scattering import Kirchhoff
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.tracing.arrivals import trace
from sonarsynth.tracing.expansion.probe_sensors import sphere
from tests.echoes import EAST, ROMANIS
from tests.laws.test_synthesis import some_of

C, DEPTH = 1500.0, 40.0
EVEN = Profile(np.array([0.0, DEPTH]), np.array([C, C]))
BENT = Profile(np.array([0.0, 18.0, 22.0, DEPTH]), np.array([1500.0, 1500.0, 1490.0, 1490.0]))
WATER = Environment(depth=DEPTH, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))
PLACE = np.array([0.0, 0.0, -20.5])
SONAR, ARRAY = Sonar(), some_of(ROMANIS, 6)
FAR = np.argsort(np.linalg.norm(ARRAY.position, axis=1))[[-1, -2, -9, 30]]
"""Hydrophones that are traced alone, the outmost one among them, which the aperture is measured by."""
SINGLE = replace(POINT, face=ARRAY.face)
PANEL = mesh_of(Box(size=(0.02, 0.2, 0.2), edge=0.025))


class View(NamedTuple):
    """A panel, and the snap that lights it."""

    place: tuple[float, float, float]  # m from the array
    heading: float  # rad, of its front
    snap: tuple[float, float, float]  # m from the array


ROUGH = Kirchhoff(roughness=0.002, slope=0.2)
NORMAL = View((12.0, 0.2, 0.2), np.radians(275.0), (0.5, 2.0, 1.0))
GRAZING = View((12.0, -2.2, 0.2), np.radians(4.0), (24.0, 0.5, 1.0))
"""At 80 degrees from the normal, within the lobe."""


def array_of(scale: float) -> Elements:
    return replace(ARRAY, position=scale * ARRAY.position)


def traced(
    law: Kirchhoff, view: View, place: Floats, array: Elements, profile: Profile = EVEN, bounces: int = 0
) -> Arrivals:
    """What the front of the panel echoes without phase in common."""
    panel = PlacedTarget("panel", PANEL, Pose(PLACE + view.place, quaternion(view.heading)), np.zeros(3))
    snap = Emission(PLACE + view.snap, 0.0, LogarithmicBubble(), None)
    receiver = Receiver(Pose(place, EAST), array, SONAR)
    none = Tolerances(negligible=0.0)
    context = FrameContext(0.0, (panel,), (snap,), Medium(WATER, profile), receiver, (law,), none)
    found = trace(context, AutoTracing(bounces=bounces))
    front = np.isin(found.facet, np.flatnonzero(PANEL.normal[:, 0] > 0.9))
    return found.select(~found.direct & ~found.coherent & front)


def heard(found: Arrivals, array: Elements, start: float) -> Floats:
    snap = Emission(PLACE, 0.0, LogarithmicBubble(), None)
    return DirectSum().pressure(found, (snap,), Reception(array, SONAR, None, start, 512))[0]


def bounced(found: Arrivals, bounces: int) -> Arrivals:
    """Of paths with so many reflections from the surface, all on the way to the array, and none from the bottom."""
    return found.select((found.surface == bounces) & (found.bottom == 0) & (found.arrives_by == bounces))


def energy(signals: Floats) -> float:
    return float(np.sum(signals**2))


def errors(
    law: Kirchhoff, view: View, array: Elements, profile: Profile = EVEN, bounces: int = 0
) -> tuple[float, float]:
    """Of the signals, relative: of one expansion, and of that where all lose to heights what the centre does.

    Root mean squares over all random signs of facets, which is what powers of single facets add up to.
    """
    found, plain = (
        bounced(traced(x, view, PLACE, array, profile, bounces), bounces) for x in (law, replace(law, roughness=1.0))
    )
    assert len(found.delay) == len(plain.delay) > 50
    start, part = found.delay.min() - 2e-4, array.select(FAR)
    place = Pose(PLACE, EAST).to_world(array.position[FAR])
    alone = [bounced(traced(law, view, at, SINGLE, profile, bounces), bounces) for at in place]
    shared = replace(found, expansion=replace(found.expansion, amplitude=plain.expansion.amplitude))
    powers = np.zeros(3)
    for facet in np.unique(found.facet)[::16]:
        one, other, *exact = (x.select(x.facet == facet) for x in (found, shared, *alone))
        known = np.vstack([heard(x, SINGLE, start) for x in exact])
        powers += [energy(known), *(energy(heard(x, part, start) - known) for x in (one, other))]
    return float(np.sqrt(powers[1] / powers[0])), float(np.sqrt(powers[2] / powers[0]))


@pytest.mark.parametrize(
    ("view", "height", "gain", "halved"),
    [
        (NORMAL, 0.0003, 50.0, 0.6),
        (NORMAL, 0.002, 3.5, 0.6),
        (GRAZING, 0.0003, 100.0, 0.1),
        (GRAZING, 0.002, 60.0, 0.45),
        (GRAZING, 0.01, 3.5, 0.55),
    ],
)
def test_one_expansion_hears_nearly_what_each_hydrophone_hears_alone(
    view: View, height: float, gain: float, halved: float
) -> None:
    """Facets in full view change little by their heights over the array; grazed ones change by 7 %. What heights change
    at other frequencies than the middle one of the band is left out: parts of an array leave out less."""
    law = Kirchhoff(roughness=height, slope=0.2)
    (mine, shared), (half, _) = (errors(law, view, array_of(scale)) for scale in (1.0, 0.5))
    assert gain * mine < shared
    assert mine < 0.02
    assert half < halved * mine


def test_facets_that_heights_leave_nothing_in_phase_are_one_expansion() -> None:
    mine, shared = errors(Kirchhoff(roughness=0.01, slope=0.2), NORMAL, array_of(1.0))
    assert mine == pytest.approx(shared, rel=1e-3)
    assert mine < 4e-5


@pytest.mark.parametrize(("profile", "bounces", "gain"), [(BENT, 0, 3.5), (EVEN, 1, 10.0)], ids=["bent", "mirrored"])
def test_bent_and_mirrored_waves_too(profile: Profile, bounces: int, gain: float) -> None:
    mine, shared = errors(Kirchhoff(roughness=0.002, slope=0.2), NORMAL, array_of(1.0), profile, bounces)
    assert mine < 2.2e-4
    assert gain * mine < shared


def test_a_floor_does_not_lose_to_heights() -> None:
    """The share of the lobe in what is sent changes with direction."""
    mine, shared = errors(Kirchhoff(roughness=0.002, slope=0.2, diffuse=0.3), GRAZING, array_of(0.5))
    assert 5.5 * mine < shared


@pytest.mark.parametrize(
    ("profile", "bounces"),
    [(EVEN, 0), (EVEN, 1), (BENT, 0), (BENT, 1)],
    ids=["even", "mirrored", "bent", "bent and mirrored"],
)
def test_echoes_come_from_their_points(profile: Profile, bounces: int) -> None:
    """Path by path, when each is heard: from the middles of these facets it would be up to 4e-7 s off."""
    law, array = Kirchhoff(roughness=0.002, slope=0.2, diffuse=0.5), array_of(1.0)
    found = bounced(traced(law, NORMAL, PLACE, array, profile, bounces), bounces)
    place = Pose(PLACE, EAST).to_world(array.position[FAR])
    for at, q in zip(place, array.position[FAR], strict=True):
        alone = bounced(traced(law, NORMAL, at, SINGLE, profile, bounces), bounces)
        a, b = (np.lexsort((np.round(x.delay, 5), x.facet)) for x in (found, alone))
        assert (found.facet[a] == alone.facet[b]).all()
        late = found.delay + sphere(found.direction, found.radius, q[None])[:, 0] / found.sound_speed
        late = late + found.expansion.over("delay", q[None])[:, 0]
        error = late[a] - alone.delay[b]
        assert np.abs(error).max() < 1e-10
