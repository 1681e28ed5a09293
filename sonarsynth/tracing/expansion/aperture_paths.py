"""Legs over the aperture: the wavefront of each leg and where each sensor is seen from, at probe sensors.

In uniform water both follow from the image of the array, in refracting water from rays to the probes. Those of a family
from one body vary smoothly with the facet, so that some facets, spread over the body, serve for all of them by
polynomials over the body; held-out facets measure the error, and where it is too large every facet is traced.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats, Ints, scattered
from sonarsynth.equations.kernels.row_products import put_cubics
from sonarsynth.products import ArrayExpansion
from sonarsynth.products.array_expansion import aperture_terms
from sonarsynth.state import Medium, Receiver
from sonarsynth.tracing.expansion.probe_paths import ApertureSamples, ReceiverGeometry, image, traced
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.receive_paths import ReceivePaths

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

SAMPLES = 96
"""Facets of a body and family that rays to the probes are traced from where that is enough; a quarter is held out."""
SMOOTH_TIME = 1e-9
"""s: largest error of a delay from facet to facet: 5e-4 rad at 85 kHz."""
SMOOTH_PHASE = 5e-4
"""rad: largest error of a phase of reflection from facet to facet."""
SMOOTH_BLUR = 4e-15
"""s2: largest error of a squared blur from facet to facet: 5e-4 of the amplitude at 85 kHz."""
SMOOTH_GAIN = 1e-3
"""Largest relative error of an amplitude from facet to facet."""
SMOOTH_DIRECTION = 1e-4
"""Largest error of a direction from facet to facet."""


@dataclass(frozen=True, eq=False)
class AperturePaths:
    """Legs over the aperture, and at its probes."""

    expansion: ArrayExpansion  # (leg,) but for amplitudes
    legs: ReceivePaths
    place: ReceiverGeometry
    probe_departure: Floats | None  # (leg, probe, xyz) world; None: towards the images of the probes
    probe_gain: Floats | None  # (leg, probe); None: 1

    def departure(self, rows: Ints) -> Floats:
        """Where the probes are seen from the points of some legs: (row, probe, xyz), world."""
        if self.probe_departure is not None:
            return self.probe_departure[rows]
        return image(self.legs, self.place.probe.position, self.place.receiver.pose, rows)

    def gain(self, rows: Ints) -> Floats:
        """Amplitude at each probe over that of the sphere (row, probe); 1 in uniform water."""
        if self.probe_gain is not None:
            return self.probe_gain[rows]
        return np.broadcast_to(1.0, (len(rows), len(self.place.probe.sensor)))


@dataclass(frozen=True, eq=False)
class ExpansionSource:
    """What the wavefronts of legs are made from: for all of them, or for some at a time, with the same result."""

    legs: ReceivePaths
    place: ReceiverGeometry
    families: tuple[
        tuple[Ints, ApertureSamples | _FacetInterpolant | None], ...
    ]  # legs of each; None: made from images
    plain: bool  # uniform water, no reflections: all are spheres

    @cached_property
    def whole(self) -> AperturePaths:
        """The wavefronts of all legs."""
        return self.of(slice(0, len(self.legs.row)))

    def of(self, block: slice) -> AperturePaths:
        """The wavefronts of some legs."""
        legs = self.legs if block == slice(0, len(self.legs.row)) else self.legs.select(block)
        count, probe = len(legs.row), self.place.probe
        spheres = ArrayExpansion.none(count, probe.aperture, probe.monomials)
        if self.plain:
            return AperturePaths(spheres, legs, self.place, None, None)
        straight = self.place.propagation.straight(self.place.medium.profile)
        samples = ApertureSamples.room(count, *probe.basis.shape, straight=straight)
        for members, model in self.families:
            first, last = np.searchsorted(members, (block.start, block.stop))
            rows = members[first:last] - block.start
            if isinstance(model, _FacetInterpolant):
                model.put(samples, rows, legs.point)
            elif model is not None:  # of spheres there is what there is room for
                samples.put(rows, {name: value[first:last] for name, value in model.known.items()})
        varying = [name for name in ("phase", "delay_variance") if self._varies(name)]
        varying += ["delay"] if not straight or self._varies("delay") else []
        over = spheres.but(error=samples.error, **{name: getattr(samples, name) for name in varying})
        return AperturePaths(over, legs, self.place, samples.departure, samples.gain)

    def _varies(self, name: str) -> bool:
        """Whether a quantity of any leg does."""
        models = [model for _, model in self.families if model is not None]
        return any(
            name in m.coefficients if isinstance(m, _FacetInterpolant) else getattr(m, name).any() for m in models
        )


def aperture_paths(
    legs: ReceivePaths, group: Ints, medium: Medium, receiver: Receiver, propagation: Propagation
) -> AperturePaths:
    """Wavefronts of all legs, as `expansion_source`."""
    return expansion_source(legs, group, medium, receiver, propagation).of(slice(0, len(legs.row)))


def expansion_source(
    legs: ReceivePaths, group: Ints, medium: Medium, receiver: Receiver, propagation: Propagation
) -> ExpansionSource:
    """Wavefronts of legs. group (leg,): legs of one body; medium: what bends them.

    Reflections turn and blur the pulse by the grazing angle, which varies over the aperture. What the polynomials in
    that miss is in `error`, as delays that are as much at the upper edge of the band.
    """
    geometry = ReceiverGeometry(medium, receiver, probes(receiver.elements), propagation)
    straight = propagation.straight(medium.profile)
    if straight and not legs.bounces.any():
        return ExpansionSource(legs, geometry, (), True)
    families: list[tuple[Ints, ApertureSamples | _FacetInterpolant | None]] = []
    every = _families(legs, group) if len(legs.row) > 2 * SAMPLES else [np.arange(len(legs.row))]
    reflected = legs.bounces > 0
    chosen = [of[_spread(legs.point[of])] if not straight or reflected[of].any() else of[:0] for of in every]
    exact, last = traced(legs.select(np.concatenate(chosen)), geometry), 0
    for members, some in zip(every, chosen, strict=True):
        known: ApertureSamples | _FacetInterpolant | None = None
        if len(some):
            of_some, last = exact.select(slice(last, last + len(some))), last + len(some)
            point, rate = legs.point[members], 2.0 * np.pi * receiver.band[1]
            known = of_some if len(some) == len(members) else _over_body(point, legs.point[some], of_some, rate)
            known = known or traced(legs.select(members), geometry)
        families.append((members, known))
    return ExpansionSource(legs, geometry, tuple(families), False)


def _families(legs: ReceivePaths, group: Ints) -> list[Ints]:
    """Indices of the legs of each body and family."""
    up = legs.departure[:, 2] > 0
    key = group.astype(np.int64)
    for column in (legs.surface, legs.bottom, legs.turning, up * (legs.bounces + legs.turning > 0)):
        key = key * (int(column.max(initial=0)) + 1) + column
    order = np.argsort(key.astype(np.min_scalar_type(key.max(initial=0))), kind="stable")  # few bits: not by comparing
    return np.split(order, np.flatnonzero(np.diff(key[order])) + 1) if len(order) else []


def _spread(point: Floats) -> Ints:
    """Some of many points: the extreme ones along each axis and others spread evenly through their order; else all."""
    if len(point) <= 2 * SAMPLES:
        return np.arange(len(point))
    extreme = np.concatenate([point.argmin(axis=0), point.argmax(axis=0)])
    return np.unique(np.concatenate([extreme, scattered(SAMPLES, len(point))]))


@dataclass(frozen=True, eq=False)
class _FacetInterpolant:
    """Legs of a family from anywhere on a body, by cubics."""

    middle: Floats  # (xyz) m
    half: Floats  # (xyz) m
    coefficients: dict[str, Floats]  # (cubic, value): of each that varies
    error: float  # s

    def put(self, samples: ApertureSamples, rows: Ints, point: Floats) -> None:
        """Write what is known of some legs, of the family, from their points (leg, xyz); the rest stays as in room."""
        for name, solved in self.coefficients.items():
            column = getattr(samples, name)
            put_cubics(rows, point, self.middle, self.half, solved, column.reshape(len(column), -1))
        samples.error[rows] = self.error


def _over_body(point: Floats, sample: Floats, exact: ApertureSamples, rate: float) -> _FacetInterpolant | None:
    """Legs from points (point, xyz) of a body from those of a sample of them, by cubics; None if they err too much;
    rate (rad/s): of the upper edge of the band."""
    low, high = np.transpose([(x.min(), x.max()) for x in np.array(point.T, order="C")])
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), 1e-9)
    at = aperture_terms((sample - middle) / half, 1.0)
    values = {name: value.reshape(len(sample), -1) for name, value in exact.known.items() if name != "error"}
    if not all(np.isfinite(value).all() for value in values.values()):
        return None
    held_out = np.arange(len(sample)) % 4 == 3
    solve = np.linalg.pinv(at[~held_out], rcond=1e-10)
    varying = {name: value for name, value in values.items() if (value != (name == "gain")).any()}
    coefficients = {name: solve @ value[~held_out] for name, value in varying.items()}
    wrong = dict.fromkeys(("delay", "phase", "delay_variance", "gain", "departure"), np.zeros(1))
    wrong |= {
        name: np.abs(at[held_out] @ solved - values[name][held_out]).max(axis=0)
        for name, solved in coefficients.items()
    }
    # monomials over the aperture are at most 1
    late, turned, softer = (float(wrong[name].sum()) for name in ("delay", "phase", "delay_variance"))
    smooth = late <= SMOOTH_TIME and turned <= SMOOTH_PHASE and softer <= SMOOTH_BLUR
    if not (smooth and wrong["gain"].max() <= SMOOTH_GAIN and wrong["departure"].max() <= SMOOTH_DIRECTION):
        return None
    error = late + turned / rate + 0.5 * rate * softer + float(exact.error.max())
    return _FacetInterpolant(middle, half, coefficients, error)
