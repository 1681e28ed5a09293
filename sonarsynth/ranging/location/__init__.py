"""When a snap reached the array and where it was, from the signals. `Locator` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.ranging.location.sensor_delays import SensorDelays

Locator = Annotated[SensorDelays, BY_KIND]
"""Methods that locate sources, by `kind`."""
