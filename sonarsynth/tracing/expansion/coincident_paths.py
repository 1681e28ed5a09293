"""Legs that coincide at every sensor added up: a snap on the bottom and its image there are heard as one source."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.products import ArrayExpansion
from sonarsynth.state import Receiver
from sonarsynth.tracing.expansion.probe_sensors import probes
from sonarsynth.tracing.receive_paths import ReceivePaths
from sonarsynth.tracing.transmit_paths import SILENCE


def with_coincident_added(
    legs: ReceivePaths, over: ArrayExpansion, gain: Floats, receiver: Receiver
) -> tuple[ReceivePaths, ArrayExpansion, Floats]:
    """The same of legs of one snap, alike in all directions, of which those that coincide are one: that of the fewest
    reflections, with the modulus and phase of their sum. What a rough bottom blurs stays apart from what it does not.

    legs (leg,): sorted by time; over (leg,): their wavefronts, but for amplitudes; gain (leg, probe): their amplitudes
    at the probes over that at the centre.
    """
    first = np.ones(len(legs.row), bool)
    columns = legs.travel_time[:, None], legs.arrival, legs.delay_std[:, None]
    first[1:] = (np.diff(np.hstack(columns), axis=0) != 0.0).any(axis=1)
    if first.all():
        return legs, over, gain
    probe, begin, number = probes(receiver.elements), np.flatnonzero(first), np.cumsum(first) - 1
    turn = legs.phase[:, None] + over.over("phase", probe.position)
    modulus = legs.spreading * legs.boundary
    centre = np.add.reduceat(modulus * np.exp(1j * legs.phase), begin)
    at_probes = np.add.reduceat(modulus[:, None] * gain * np.exp(1j * turn), begin)
    heard = np.abs(centre) > SILENCE * np.add.reduceat(modulus, begin)
    best = np.lexsort((legs.bounces, number))[begin]
    shared = heard & (np.diff(begin, append=len(first)) > 1)
    ratio = at_probes[shared] / centre[shared, None]
    phase, missed = probe.expand(np.angle(ratio))
    error, gain = np.maximum.reduceat(over.error, begin), gain[best]
    terms = np.zeros((len(begin), probe.basis.shape[1]))
    terms[:, : over.phase.shape[1]] = over.phase[best]
    terms[shared], gain[shared] = phase, np.abs(ratio)
    error[shared] += missed / (2.0 * np.pi * receiver.band[1])
    boundary, turned = legs.boundary[best], legs.phase[best]
    boundary[shared] = np.abs(centre[shared]) / legs.spreading[best][shared]
    turned[shared] = np.angle(centre[shared])
    legs, over = legs.select(best).but(boundary=boundary, phase=turned), over[best].but(phase=terms, error=error)
    rows = np.flatnonzero(heard)
    return legs.select(rows), over[rows], gain[rows]
