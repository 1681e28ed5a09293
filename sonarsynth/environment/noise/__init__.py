"""Ambient noise at the hydrophones, by each model. `Noise` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.environment.noise.flat_noise import FlatNoise
from sonarsynth.environment.noise.knudsen_noise import KnudsenNoise
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.environment.noise.rain_noise import RainNoise
from sonarsynth.environment.noise.recorded_noise import RecordedNoise
from sonarsynth.environment.noise.tabulated_noise import TabulatedNoise
from sonarsynth.environment.noise.thermal_noise import ThermalNoise
from sonarsynth.environment.noise.wenz_noise import WenzNoise
from sonarsynth.environment.noise.wind_noise import WindNoise

Noise = Annotated[
    FlatNoise | KnudsenNoise | RainNoise | RecordedNoise | TabulatedNoise | ThermalNoise | WenzNoise | WindNoise,
    BY_KIND,
]
"""Models of ambient noise, by `kind`."""

__all__ = [
    "FlatNoise",
    "KnudsenNoise",
    "Noise",
    "NoiseField",
    "RainNoise",
    "RecordedNoise",
    "TabulatedNoise",
    "ThermalNoise",
    "WenzNoise",
    "WindNoise",
]
