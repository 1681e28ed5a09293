"""Locating the snap, cancelling its reflections, picking its echoes and placing them: a folder for each family."""

from __future__ import annotations

from sonarsynth.ranging.cancelling import Cancelling
from sonarsynth.ranging.cancelling.cancelling_method import CancellingMethod
from sonarsynth.ranging.cancelling.reflection_cancelling import WavefrontCancelling
from sonarsynth.ranging.location import Locator
from sonarsynth.ranging.location.locating_method import LocatingMethod
from sonarsynth.ranging.location.sensor_delays import SensorDelays
from sonarsynth.ranging.picking import BeamAxis, FirstEcho, Peaks, Picking
from sonarsynth.ranging.placing import AutoPlacing, IsovelocityPlacing, Placing, RefractedPlacing

__all__ = [
    "AutoPlacing",
    "BeamAxis",
    "Cancelling",
    "CancellingMethod",
    "FirstEcho",
    "IsovelocityPlacing",
    "LocatingMethod",
    "Locator",
    "Peaks",
    "Picking",
    "Placing",
    "RefractedPlacing",
    "SensorDelays",
    "WavefrontCancelling",
]
