"""The base of methods that cancel reflections: one that is added needs no more than `cancel`."""

from __future__ import annotations

from sonarsynth.description.method import FrameSize, Method
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.state import Receiver, Survey


class CancellingMethod(Method):
    """Removes the sound that reaches the array from a snap by surface and bottom, without an echo, from the signals."""

    def cancel(
        self,
        signals: Signals,
        estimates: SourceEstimates,
        receiver: Receiver,
        survey: Survey,
        window: tuple[float, float],
    ) -> Signals:
        """The signals without the reflections of the located snaps in the echo window (start, stop), in s.

        The same object where nothing is taken out; `quantum` stays that of the converter, though pressures are no
        whole multiples of it where something is.
        """
        raise NotImplementedError(f"{type(self).__name__} cancels nothing")

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`."""
        return 18e-6 * size.sensors
