"""The only source of random numbers: streams keyed by what they are for, so that no order of work can change a draw."""

from __future__ import annotations

import hashlib

import numpy as np


def stream(seed: int, *path: int | str) -> np.random.Generator:
    """An independent generator (Philox) for (seed, path).

    `stream(7, "noise", sequence, step)` is the same on every machine, in every order, on any number of workers;
    streams whose paths differ in any part are independent. A path part is an int or a str, and 1 is not "1".
    """
    digest = hashlib.sha256(repr((int(seed), *path)).encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "little")))
