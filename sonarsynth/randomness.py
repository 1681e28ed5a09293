"""The only source of random numbers: streams keyed by what they are for, so that no order of work can change a draw."""

from __future__ import annotations

import hashlib

import numpy as np


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
