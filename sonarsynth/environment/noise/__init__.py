"""Ambient noise at the hydrophones, by each model. `Noise` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.environment.noise.flat_noise import FlatNoise
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.environment.noise.wenz_noise import WenzNoise

Noise = Annotated[FlatNoise | WenzNoise, BY_KIND]
"""Models of ambient noise, by `kind`."""

__all__ = ["FlatNoise", "Noise", "NoiseField", "WenzNoise"]
