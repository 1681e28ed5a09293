"""Straight rays where they are exact enough, else refracted ones."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.description.method import Demand
from sonarsynth.environment.sea import Profile
from sonarsynth.products import Paths
from sonarsynth.propagation.bounces import Bounces
from sonarsynth.propagation.path_model import KnownRays, PathModel, RaysBeside
from sonarsynth.propagation.refracted import Refracted
from sonarsynth.propagation.straight import Straight


@description
class AutoTracing(PathModel):
    """`Straight` where that errs by little enough, else `Refracted`; without a plan, where the water is uniform."""

    kind: Literal["auto"] = "auto"
    bounces: Bounces = 0
    """Most reflections from surface and bottom on the way from the snap to the array."""

    def resolve(self, demand: Demand) -> tuple[Straight | Refracted, float]:
        """Straight rays where they err by no more than is allowed."""
        straight = Straight(bounces=self.bounces)
        error = demand.error(straight)
        return (straight, error) if error <= demand.allowed else (Refracted(bounces=self.bounces), 0.0)

    @property
    def layered(self) -> bool:
        """As `PathModel.layered`."""
        return True

    def straight(self, profile: Profile) -> bool:
        """As `PathModel.straight`."""
        return profile.uniform

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """Paths of the exact model; arguments and errors as in `PathModel`."""
        model = Straight(bounces=self.bounces) if profile.uniform else Refracted(bounces=self.bounces)
        return model.connect(profile, environment_depth, start, end)

    def beside(self, profile: Profile, environment_depth: float, rays: KnownRays, end: Floats) -> RaysBeside | None:
        """As `PathModel.beside`."""
        return Refracted(bounces=self.bounces).beside(profile, environment_depth, rays, end)
