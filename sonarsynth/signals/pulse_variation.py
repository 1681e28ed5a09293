"""Pulses that change over the aperture: a reflection gives another phase and another blur at each hydrophone.

At a point of the aperture a path has the phase and the variance of its blur
    phase + turn,  variance + spread,
both polynomials (`ArrayExpansion`). The modes of its pulse (`shapes`) change with them: by the cosine
and the sine of turn, times its modes and those of the pulse a quarter of a period ahead; and by powers of spread, times
those of the pulse times powers of -(2 pi f)^2/2. The part that all paths of a tile share is put into the tile's field.
"""

from __future__ import annotations

from dataclasses import replace
from math import factorial
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Complexes, Floats, Ints
from sonarsynth.products.array_expansion import QUANTITIES
from sonarsynth.signals.array_paths import ArrayPaths, Wavefronts

MOST_POWERS = 8
"""Powers of spread that pulses may be expanded in."""

STEEP = 3.0
"""Np: powers of changes of blur beyond this converge slowly; such paths are each steered to itself, and changed
exactly."""

LOUDEST = 256
"""Paths that modes are made for as they change over the aperture, and that tiles look at."""

Change = tuple[int, int]
"""Power of spread, and 1 for the pulse a quarter of a period ahead."""


class PulseVariation(NamedTuple):
    """How the pulses of a segment change over the aperture, in terms of its modes."""

    kinds: tuple[Change, ...]
    onto: Floats  # (change, mode, mode) weights @ onto: those of the change
    rate: float  # 1/s2: what spread is counted in


UNCHANGING = PulseVariation((), np.zeros((0, 0, 0)), 0.0)


def turn_and_spread(front: Wavefronts, points: Floats) -> tuple[Floats, Floats]:
    """Turn (rad) and spread (s2), (path, point) each, at points (point, xyz)."""
    return front.expansion.over("phase", points), front.expansion.over("delay_variance", points)


def changed(front: Wavefronts, points: Floats, frequency: Floats) -> Complexes:
    """Factor (path, point, bin) on the pulses of paths at points (point, xyz), over those at the centre."""
    turn, spread = turn_and_spread(front, points)
    soft = 0.5 * np.multiply.outer(spread, (2.0 * np.pi * frequency) ** 2) if spread.any() else 0.0
    return np.asarray(np.exp(1j * turn)[:, :, None] * np.exp(-soft))


def aperture_gradient(front: Wavefronts, points: Floats) -> Floats:
    """Gradient (xyz, point, term) of the aperture terms at points (point, xyz); empty where no front has such terms."""
    return front.expansion.gradient(points, "delay", "phase", "delay_variance")


def slopes(front: Wavefronts, gradient: Floats, lowest: float, highest: float) -> Floats:
    """Bounds (xyz, path) in rad/m on how fast pulses change along each axis, as a phase at the highest frequency.

    gradient (xyz, point, term): of the aperture terms, where it is looked at. A phase is as steep at all frequencies:
    it is taken for as much as has its slope at `lowest` (Hz), so that it bounds that at any from there on.
    """
    total = np.zeros((3, front.count))
    for terms, scale in (
        (front.expansion.phase, highest / lowest),
        (front.expansion.delay_variance, 0.5 * (2.0 * np.pi * highest) ** 2),
    ):
        if terms.shape[1]:
            total += scale * np.abs(gradient[:, :, : terms.shape[1]] @ terms.T).max(axis=1)
    return total


def with_changes(front: ArrayPaths) -> ArrayPaths:
    """Paths, and after them the loudest of those that change, as they are elsewhere on the aperture: more and less
    blurred, and as loud as what turns, a quarter of a period ahead."""
    if not (front.expansion.phase.any() or front.expansion.delay_variance.any()):
        return front
    turn, spread = front.expansion.largest("phase"), front.expansion.largest("delay_variance")
    loud = np.abs(front.amplitude)
    copies = [np.arange(front.count)]
    copies += [_loudest(loud * (spread > 0.0))] * 2 + [_loudest(loud * turn)]
    rows, count = np.concatenate(copies), [some.size for some in copies]
    blur = np.repeat([0.0, 1.0, -1.0, 0.0], count)
    ahead = np.repeat([0.0, 0.0, 0.0, 1.0], count)
    every = front.but(occluded=front.occluded[:, :0], expansion=front.expansion.without(*QUANTITIES)).select(rows)
    return replace(
        every,
        amplitude=every.amplitude * np.where(ahead > 0.0, np.minimum(turn[rows], 1.0), 1.0),
        variance=np.maximum(every.variance + blur * spread[rows], 0.0),
        phase=every.phase + 0.5 * np.pi * ahead,
    )


def steep(front: Wavefronts, highest: float) -> Bools:
    """Paths (path,) whose blur changes by more than `STEEP` over the aperture, at a frequency (Hz)."""
    return np.asarray(front.expansion.largest("delay_variance") * 0.5 * (2.0 * np.pi * highest) ** 2 > STEEP)


def from_the_sharpest(front: ArrayPaths, highest: float) -> ArrayPaths:
    """Paths whose steep blur is counted from where on the aperture they are sharpest: from there it only takes away."""
    expansion = front.expansion
    if not (which := steep(front, highest)).any():
        return front
    less = np.where(which, np.minimum(front.variance, expansion.largest("delay_variance")), 0.0)
    terms = expansion.delay_variance + less[:, None] * np.eye(1, expansion.delay_variance.shape[1])
    return replace(front, variance=front.variance - less, expansion=expansion.but(delay_variance=terms))


def _loudest(loud: Floats) -> Ints:
    """The loudest (path,), not those that are silent."""
    order = np.argsort(-loud)[:LOUDEST]
    return np.asarray(order[loud[order] > 0.0])


def changes(front: Wavefronts, frequency: Floats, spectrum: Complexes) -> PulseVariation:
    """What the pulses of paths change by, from the spectra (mode, bin) of modes that hold it (`with_changes`)."""
    turns, spreads = bool(front.expansion.phase.any()), bool(front.expansion.delay_variance.any())
    if not (turns or spreads):
        return UNCHANGING
    exponent = 0.5 * (2.0 * np.pi * frequency) ** 2
    rate = float(exponent[-1])
    kinds = [(power, ahead) for power in range(1 + MOST_POWERS * spreads) for ahead in range(1 + turns)][1:]
    both = np.concatenate([spectrum.real, spectrum.imag], axis=1)
    solve = np.linalg.inv(both @ both.T)
    onto = []
    for power, ahead in kinds:
        value = spectrum * (1j**ahead * (-exponent / rate) ** power / factorial(power))
        onto.append(np.concatenate([value.real, value.imag], axis=1) @ both.T @ solve)
    return PulseVariation(tuple(kinds), np.array(onto), rate)


class ResidualVariation(NamedTuple):
    """What pulses of a tile change by beside the reference, which the whole field of the tile changes with."""

    phase: Floats  # (term,) rad of the reference; none where it does not change
    delay_variance: Floats  # (term,) s2
    which: Ints  # (some,) changes that count
    size: Floats  # (some, path) bounds on how much there is of each in some paths of the tile
    paths: Ints  # (path,) those


def rest(front: Wavefronts, paths: Ints, variation: PulseVariation, tolerance: float) -> ResidualVariation:
    """Of the tile of these paths; changes that add less than `tolerance` are left out, to all together or to the
    loudest."""
    none, some = np.zeros(0), slice(None, None, max(1, paths.size // LOUDEST))
    sampled = paths[some]
    loud, weight = np.abs(front.amplitude[sampled]), front.modes[sampled]
    if not variation.kinds:
        return ResidualVariation(none, none, np.zeros(0, int), np.zeros((0, sampled.size)), sampled)
    turn, turned = _shared(front.expansion.phase, paths, some)
    spread, softer = _shared(front.expansion.delay_variance, paths, some)
    share = np.array([np.minimum(turned, 1.0) ** a * (softer * variation.rate) ** p for p, a in variation.kinds])
    changed = weight @ variation.onto  # (change, path, mode)
    size = np.sqrt(np.einsum("cpm,cpm->cp", changed, changed)) * share * loud
    mean = np.sqrt((size**2).sum(axis=1) / (loud**2).sum())
    which = np.flatnonzero(np.maximum(mean, size.max(axis=1) / loud.max()) > tolerance)
    return ResidualVariation(turn, spread, which, share[which], sampled)


def pulses(front: Wavefronts, paths: Ints, over: ResidualVariation, variation: PulseVariation) -> tuple[Floats, Floats]:
    """Weights (pulse, mode) of the pulses of paths, with what some of them change by, and how loud (pulse,) each is."""
    weight, loud = [np.take(front.modes, paths, axis=0)], [np.abs(np.take(front.amplitude, paths))]
    for change, size in zip(over.which, over.size, strict=True):
        weight.append(front.modes[over.paths] @ variation.onto[change])
        loud.append(np.abs(front.amplitude[over.paths]) * size)
    return np.concatenate(weight), np.concatenate(loud)


def _shared(terms: Floats, paths: Ints, some: slice) -> tuple[Floats, Floats]:
    """What some paths share of their terms (path, term), and bounds on what one in some of them has beside it: their
    mean, unless a path would then change by more than it does, which no modes are made for (`with_changes`)."""
    from sonarsynth.signals.gridded.variation_kernels import moduli

    mean, (own, beside) = terms[paths[some]].mean(axis=0), np.empty((2, paths.size))
    return (np.zeros_like(mean), own[some]) if moduli(terms, paths, mean, own, beside) else (mean, beside[some])


def shares(
    front: Wavefronts, reference: Wavefronts, which: Ints, variation: PulseVariation, points: Floats, dtype: str
) -> Floats:
    """How much there is of pulses and of each change that counts, (1 + some, point, path), beside the reference."""
    if not which.size:
        return np.zeros((0, 0, 0), dtype)
    turn, spread = (value.T for value in turn_and_spread(front, points))
    own, softer = turn_and_spread(reference, points)
    turn, spread = (
        (turn - own[0][:, None]).astype(dtype),
        ((spread - softer[0][:, None]) * variation.rate).astype(dtype),
    )
    kinds = [(0, 0), *(variation.kinds[k] for k in which)]
    if any(ahead for _, ahead in kinds):
        quarter = np.cos(turn), np.sin(turn)
    else:
        quarter = np.ones_like(turn), turn
    return np.array([quarter[ahead] * spread**power if power else quarter[ahead] for power, ahead in kinds])
