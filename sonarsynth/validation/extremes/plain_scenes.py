"""Scenes of one sound speed without absorption, whose signals are closed forms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Absorption, Environment, Isovelocity, Profile
from sonarsynth.equations.scattering.facet_pulses import facet_response
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import Band, Elements, LowPass, Sonar
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import SnapModel
from sonarsynth.sources.snap_models import Ricker
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace

if TYPE_CHECKING:
    from sonarsynth.products import Arrivals, Signals
    from sonarsynth.scattering import FacetLaw
    from sonarsynth.signals import SignalSynthesis

C, BOTTOM_DEPTH, RATE = 1500.0, 12e3, 250e3
PULSE = Ricker(frequency=20e3)
SONAR = Sonar(sampling_frequency=RATE, filter=LowPass(cutoff=110e3))
ARRAY = np.array([0.0, 0.0, -0.5 * BOTTOM_DEPTH])
POSE = Pose(ARRAY, quaternion(0.5 * np.pi))
"""The sonar frame is the world's, but for its place: x forward."""
WATER = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=C), absorption=Absorption(formula="none"))
PROFILE = Profile(np.array([0.0]), np.array([C]))


def snap(
    position: Sequence[float] | Floats, time: float = 0.0, model: SnapModel = PULSE, gain: float = 1.0
) -> Emission:
    """A test pulse at a position (xyz) in the sonar frame."""
    return Emission(ARRAY + np.asarray(position, float), time, model, None, gain)


def body(mesh: Mesh, position: Sequence[float] | Floats, turned: float = 0.5 * np.pi) -> PlacedTarget:
    """A body at rest at a position (xyz) in the sonar frame, its heading as the sonar's unless turned."""
    return PlacedTarget("body", mesh, Pose(ARRAY + np.asarray(position, float), quaternion(turned)), np.zeros(3))


def traced(
    snaps: Sequence[Emission],
    elements: Elements,
    bodies: Sequence[PlacedTarget] = (),
    laws: Sequence[FacetLaw] = (),
    band: tuple[float, float] = (25e3, 85e3),
) -> Arrivals:
    """Every path, none of which has a number that is none."""
    receiver = Receiver(POSE, elements, replace(SONAR, band=Band(low=band[0], high=band[1])))
    context = FrameContext(0.0, tuple(bodies), tuple(snaps), Medium(WATER, PROFILE), receiver, tuple(laws))
    arrivals = trace(context, AutoTracing())
    for name, value in arrivals.columns.items():
        if not np.isfinite(value).all():
            raise ArithmeticError(f"{name} of a path is not finite")
    return arrivals


def synthesised(
    method: SignalSynthesis,
    arrivals: Arrivals,
    snaps: Sequence[Emission],
    elements: Elements,
    start: float,
    samples: int,
    sonar: Sonar = SONAR,
) -> Signals:
    """Signals of paths."""
    return method.signals(arrivals, tuple(snaps), Reception(elements, sonar, None, start, samples))


def ricker(time: Floats, frequency: float = PULSE.frequency) -> Floats:
    """The test pulse (...) at times (s): (1 - 2 x^2) exp(-x^2), x = pi f t."""
    x = (np.pi * frequency * time) ** 2
    return np.asarray((1.0 - 2.0 * x) * np.exp(-x))


def times(start: float, samples: int, rate: float = RATE) -> Floats:
    """Times (sample,) of a window (s)."""
    return start + np.arange(samples) / rate


def direct(elements: Elements, position: Sequence[float], time: Floats, frequency: float = PULSE.frequency) -> Floats:
    """What each hydrophone hears of a snap at a position (xyz) in the sonar frame: (sensor, sample)."""
    r = np.linalg.norm(elements.position - np.asarray(position, float), axis=1)[:, None]
    return np.asarray(ricker(time - r / C, frequency) / r)


def transfer(arrivals: Arrivals, frequency: Floats) -> Floats:
    """Pressure (frequency,) at the array centre for a snap of unit spectrum at 1 m: complex, of all paths."""
    total = np.zeros(len(frequency), complex)
    for batch in np.array_split(np.arange(len(arrivals.delay)), len(arrivals.delay) // 100_000 + 1):
        rows = arrivals.select(batch)
        shape = facet_response(
            frequency, rows.coherent, rows.corner_delays, rows.coherent_fraction, rows.height_delay_std, rows.centre
        )  # fmt: skip
        phase = rows.phase[:, None] - 2.0 * np.pi * rows.delay[:, None] * frequency
        blur = np.exp(-0.5 * (2.0 * np.pi * rows.delay_std[:, None] * frequency) ** 2)
        total += (rows.amplitude[:, None] * shape * blur * np.exp(1j * phase)).sum(axis=0)
    return np.asarray(total)
