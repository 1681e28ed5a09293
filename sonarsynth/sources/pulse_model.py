"""What a model of a pulse says of itself: one that is added needs no more than `pulse`."""

from __future__ import annotations

from typing import Self

from sonarsynth.description.method import Method, returned_rows
from sonarsynth.equations.bubble.pulses import Pulse

Stamp = tuple[int, int]
"""What changes when a file does."""


class PulseModel(Method):
    """What a source sounds like at 1 m."""

    def pulse(self, depth: float, highest: float) -> Pulse:
        """The pulse (Pa at 1 m) at a depth (m), for waves up to `highest` (Hz); time 0 is the collapse of a bubble.

        Its `peak` is what a source level is of: the largest pressure before any filter, or as the model takes it.
        Raises ValueError in one line where the model has none.
        """
        raise NotImplementedError(f"{type(self).__name__} has no pulse")

    def checked_pulse(self, depth: float, highest: float) -> Pulse:
        """What `pulse` returns, once it has the shape of a pulse."""
        found, known = self.pulse(depth, highest), ("time", "strength")
        pulse: Pulse = returned_rows(self, "pulse", found, Pulse, "time", known, {})
        return pulse

    def at_depth(self, depth: float) -> Self:
        """The model where its source is (m), if it has no depth of its own."""
        return self

    @property
    def file(self) -> Stamp | None:
        """The stamp of the file that it is read from; none without one. Raises ValueError for a file that is gone."""
        return None

    def fault(self, longest: float, limit: float) -> str:
        """Why there is no such pulse, told before it is computed; empty where nothing is wrong so far. The pulse may be
        `longest` times as long, and must be over in `limit` seconds."""
        return ""
