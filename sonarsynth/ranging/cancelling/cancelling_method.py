"""What a method that cancels reflections says of itself: one that is added needs no more than `cancel`."""

from __future__ import annotations

from sonarsynth.description.method import Method
from sonarsynth.geometry import Pose
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.receiver import Elements, Sonar


class CancellingMethod(Method):
    """Takes what reaches the array by surface and bottom without an echo out of what it hears."""

    def cancel(
        self,
        signals: Signals,
        estimates: SourceEstimates,
        elements: Elements,
        sonar: Sonar,
        sonar_pose: Pose,
        bottom_depth: float,
        window: tuple[float, float],
    ) -> Signals:
        """The signals without the reflections of the located snaps in the echo window (start, stop), in s.

        The same object where nothing is taken out; `quantum` stays that of the converter, though pressures are no
        whole multiples of it where something is. bottom_depth in m, positive down.
        """
        raise NotImplementedError(f"{type(self).__name__} cancels nothing")

    def seconds(self, sensors: int) -> float:
        """Seconds that a frame takes on one core of the machine that costs are measured on."""
        return 18e-6 * sensors
