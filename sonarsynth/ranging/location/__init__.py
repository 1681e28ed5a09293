"""When a snap reached the array and where it was: measured, or known. `Locator` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.ranging.location.sensor_delays import SensorDelays
from sonarsynth.ranging.location.triggered import Triggered

Locator = Annotated[SensorDelays | Triggered, BY_KIND]
"""Methods that locate sources by their direct arrivals, or by triggers, by `kind`."""
