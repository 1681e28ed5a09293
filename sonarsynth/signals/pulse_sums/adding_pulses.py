"""Pulses of many paths, added at every sensor where each arrives."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.products.pulse_arrivals import PulseArrivals
from sonarsynth.receiver import Elements
from sonarsynth.signals.pulse_sums.pulse_modes import FRACTIONS, PulseModes, shape_of

CAVITY = 3.5e-3
"""m: the radius of the bubble of a snap. Sound falls as 1/r from there on; nearer, it is what it is there."""
TURN = 0.1
"""rad: what the phase at the edge of a face may turn by, from the middle of a block of sensors to its edge. Errors of
paths go as this, and so does what they cost: 1 % of their peaks."""


def sensor_blocks(elements: Elements) -> tuple[Ints, tuple[tuple[Ints, Floats, float], ...]]:
    """Sensors in an order, (sensor,), in which each half, quarter, ... is a block; and, of each level of blocks, where
    they begin (block + 1,), their middles (block, xyz) in m and the largest radius (m)."""
    return _blocks(elements.position.tobytes())


@lru_cache(maxsize=16)
def _blocks(places: bytes) -> tuple[Ints, tuple[tuple[Ints, Floats, float], ...]]:
    """The same of positions (sensor, xyz): of those that err, frame after frame."""
    position = np.frombuffer(places).reshape(-1, 3)
    order, bounds = np.arange(len(position)), [0, len(position)]
    levels = []
    while True:
        blocks = [position[order[a:b]] for a, b in pairwise(bounds)]
        middle = np.array([block.mean(axis=0) for block in blocks])
        radius = max(float(np.linalg.norm(b - m, axis=1).max()) for b, m in zip(blocks, middle, strict=True))
        levels.append((np.array(bounds), middle, radius))
        if len(blocks) == len(position):
            return order, tuple(levels)
        finer = [0]
        for a, b in pairwise(bounds):
            points = position[order[a:b]]
            axis = int(np.argmax(np.ptp(points, axis=0)))
            order[a:b] = order[a:b][np.argsort(points[:, axis], kind="stable")]
            finer += [(a + b) // 2, b] if b - a > 1 else [b]
        bounds = finer


def add_arrivals(
    flat: npt.NDArray[np.float32],
    length: int,
    arrivals: PulseArrivals,
    modes: PulseModes,
    *,
    louder: Floats | float,
    elements: Elements,
    rate: float,
    absorption: Floats,
    origin: float,
) -> None:
    """Add the pulses of arrivals, `louder` (path,) times as loud as their gains say, to flat (sensor in the order of
    blocks, `length` and one more), from `origin` (s) on at `rate` (Hz); absorption: dB/m at the frequencies of modes.
    """
    from sonarsynth.signals.pulse_sums.pulse_kernels import add_pulses

    speed = arrivals.sound_speed
    order, levels = sensor_blocks(elements)
    source = arrivals.direction * arrivals.length[:, None]
    turns = np.pi * modes.frequency[0] * elements.face / speed
    level = np.zeros(len(arrivals.delay), int)
    for number, (_, _, radius) in enumerate(levels[:-1]):
        level[turns * radius > TURN * arrivals.length] = number + 1
    position = np.ascontiguousarray(elements.position[order].T)
    for number, (bounds, middle, _) in enumerate(levels):
        rows = np.flatnonzero(level == number)
        if not rows.size:
            continue
        rows = rows[np.argsort(arrivals.delay[rows], kind="stable")]  # neighbours in time are neighbours in memory
        row, block = np.repeat(rows, len(middle)), np.tile(np.arange(len(middle)), rows.size)
        towards = source[row] - middle[block]
        away = np.maximum(np.linalg.norm(towards, axis=1), CAVITY)
        shape = shape_of(
            modes.frequency, towards / away[:, None], away, arrivals.delay_std[row], absorption, elements.face, speed,
        )  # fmt: skip
        weight = (louder * arrivals.gain)[row, None] * (shape @ modes.shapes.T)
        phase = arrivals.phase[row, None]
        turned = bool(arrivals.phase.any())
        weight = np.hstack([weight * np.cos(phase), weight * np.sin(phase)]) if turned else weight
        table = modes.table if turned else modes.table[: len(modes.shapes)]
        start = (arrivals.delay[row] - origin) * rate - modes.before
        taps = table.shape[1] // (FRACTIONS + 1)
        add_pulses(
            table.ravel(), taps, FRACTIONS, weight.astype(np.float32), bounds[:-1][block], bounds[1:][block],
            source[row], arrivals.length[row], start, position, float(rate), 1.0 / speed, CAVITY, length, length + 1,
            flat,
        )  # fmt: skip
