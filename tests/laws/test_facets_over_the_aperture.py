"""The mean over a facet is another at each hydrophone: one expansion over the array against each hydrophone alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.equations.arrays.apertures import aperture_terms
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import Elements, PositionTable, Romanis, Sonar, elements
from sonarsynth.scattering import Kirchhoff
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.direct_sum import exact_signals
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.tracing.arrivals import trace

C = 1500.0
PROFILE = Profile(np.array([0.0]), np.array([C]))
WATER = Environment(depth=200.0, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))
PLACE, EAST = np.array([0.0, 0.0, -100.0]), quaternion(0.5 * np.pi)
ROMANIS = elements(Romanis())
SNAP = Emission(PLACE + [0.5, 2.0, 1.0], 0.0, LogarithmicBubble(), None)
SONAR = Sonar()
EDGES = np.array([SONAR.band.low, SONAR.band.centre, SONAR.band.high])
PANEL = mesh_of(Box(size=(0.006, 0.06, 0.06), edge=0.006))
FAR = np.argsort(np.linalg.norm(ROMANIS.position, axis=1))[[-1, -2, -300]]
SINGLE = elements(PositionTable(positions=((0.0, 0.0, 0.0),), face=ROMANIS.face))


def traced(law: Kirchhoff, place: Floats, array: Elements, alike: float) -> Arrivals:
    panel = PlacedTarget("panel", PANEL, Pose(PLACE + [3.0, 0.2, 0.2], quaternion(0.3)), np.zeros(3))
    receiver, left = Receiver(Pose(place, EAST), array, SONAR), Tolerances(negligible=0.0, facet_mean=alike)
    context = FrameContext(0.0, (panel,), (SNAP,), Medium(WATER, PROFILE), receiver, (law,), left)
    found = trace(context, AutoTracing())
    return found.select(~found.direct)


def alone(law: Kirchhoff, sensor: int) -> Arrivals:
    return traced(law, Pose(PLACE, EAST).to_world(ROMANIS.position[sensor][None])[0], SINGLE, 0.0)


def both(*found: Arrivals) -> list[Arrivals]:
    """The coherent paths that all have, in one order; those that no other path of a facet is mistaken for."""
    some = [x.select(x.coherent) for x in found]
    once = [np.flatnonzero(np.bincount(x.facet, minlength=len(PANEL.faces)) == 1) for x in some]
    kept = [facet for facet in once[0] if all(facet in others for others in once)]
    return [x.select(np.array([np.flatnonzero(x.facet == facet)[0] for facet in kept])) for x in some]


def means(found: Arrivals, q: Floats) -> Floats:
    """What facets and blurs make of the pulse (path, frequency) at a place in the sonar frame."""
    more = (
        found.delay_variance_terms @ aperture_terms(q, ROMANIS.aperture) if found.delay_variance_terms.shape[1] else 0.0
    )
    soft = np.exp(-0.5 * np.multiply.outer(found.delay_std**2 + more, (2.0 * np.pi * EDGES) ** 2))
    return soft * facet_response(
        EDGES, found.coherent, found.corner_delays, found.coherent_fraction, found.height_delay_std, found.centre
    )


@pytest.mark.parametrize(
    ("law", "most", "better"),
    [(Kirchhoff(), 3e-4, 10.0), (Kirchhoff(roughness=1e-3), 3e-4, 20.0), (Kirchhoff(forward="scattered"), 5e-3, 5.0)],
)
def test_what_a_facet_makes_of_the_pulse_is_that_of_a_hydrophone_alone(
    law: Kirchhoff, most: float, better: float
) -> None:
    """Path by path, at the edges of the band: what the second moment of the delays over a facet leaves of the error.

    In a shadow wave the phases over a facet are largest, and so are the higher moments.
    """
    found, shared = traced(law, PLACE, ROMANIS, 0.0), traced(law, PLACE, ROMANIS, 1.0)
    assert found.delay_variance_terms.shape[1] > 0
    assert shared.delay_variance_terms.shape[1] == 0
    for sensor in FAR:
        q = ROMANIS.position[sensor]
        exact, mine, flat = both(alone(law, int(sensor)), found, shared)
        truth = means(exact, np.zeros(3))
        assert len(truth) > 50
        error, plain = (np.abs((means(x, q) - truth) / np.abs(truth).max(axis=0)).max() for x in (mine, flat))
        assert better * error < plain
        assert error < most


def test_a_facet_is_blurred_and_sharpened_by_turns() -> None:
    """A variance below 0 where the array sees the facet more squarely; 0 at its centre."""
    found = traced(Kirchhoff(), PLACE, ROMANIS, 0.0)
    over = found.delay_variance_terms @ aperture_terms(ROMANIS.position, ROMANIS.aperture).T
    assert over.min() < 0.0 < over.max()
    assert np.abs(found.delay_variance_terms[:, 0]).max() == 0.0
    assert not found.delay_std.any()


def test_the_fast_synthesis_follows_facets_over_the_array() -> None:
    found = traced(Kirchhoff(), PLACE, ROMANIS, 0.0)
    part = elements(PositionTable(positions=tuple(map(tuple, ROMANIS.position[::16].tolist())), face=ROMANIS.face))
    start, samples = found.delay.min() - 1e-3, 512
    exact, _ = exact_signals(found, (SNAP,), part, SONAR, None, start, samples)
    for tolerance, most in ((1.5e-4, 2e-4), (1e-6, 3e-6)):
        method = GriddedSynthesis(width=10, precision="float64", tolerance=tolerance)
        got, _ = method.pressure(found, (SNAP,), part, SONAR, None, start, samples)
        assert np.abs(got - exact).max() < most * np.abs(exact).max()
    flat, _ = exact_signals(
        replace(found, delay_variance_terms=np.zeros((len(found.delay), 0))), (SNAP,), part, SONAR, None, start, samples
    )
    assert np.abs(flat - exact).max() > 4e-4 * np.abs(exact).max()
