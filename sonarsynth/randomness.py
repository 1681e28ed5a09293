"""The only source of random numbers: streams keyed by what they are for, so that no order of work can change a draw."""

from __future__ import annotations

import hashlib

import numpy as np
import numpy.typing as npt


def stream(seed: int, *path: int | str) -> np.random.Generator:
    """An independent generator (Philox) for (seed, path).

    `stream(7, "noise", sequence, step)` is the same on every machine, in every order, on any number of workers;
    streams whose paths differ in any part are independent. A path part is an int or a str, and 1 is not "1".
    """
    return np.random.Generator(np.random.Philox(key=number(seed, *path)))


def number(seed: int, *path: int | str) -> int:
    """A random whole number of 128 bits for (seed, path): the key of the stream."""
    digest = hashlib.sha256(repr((int(seed), *path)).encode()).digest()
    return int.from_bytes(digest[:16], "little")


def share(seed: int, *path: int | str) -> float:
    """A random number, evenly in 0 to 1 (not 1), for (seed, path): a single draw without the cost of a stream."""
    return (number(seed, *path) >> 75) * 2.0**-53


def uniforms(seed: int, *counters: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Random numbers (...), evenly in 0 to 1 (neither), one for each tuple of whole numbers of `counters`.

    These are arrays that broadcast together: cells of space and time, and what each number is for. The same tuple has
    the same number whatever else is asked for. seed: `number` of what it is all for. A stream for each cell would take
    a thousand times as long. Source: Steele, Lea and Flood (2014), OOPSLA (the mixing function of SplitMix64).
    """
    state = np.asarray(seed & (1 << 64) - 1, np.uint64)
    with np.errstate(over="ignore"):
        for counter in counters:
            z = (np.asarray(counter, np.int64).astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
            z = (state ^ z) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            state = z ^ (z >> np.uint64(31))
    return np.asarray(((state >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52)
