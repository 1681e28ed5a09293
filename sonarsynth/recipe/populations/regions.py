"""Where bodies of a population may be. Adding one: a description with `place`, and its name in `Region`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt, Le, MaxLen, MinLen
from pydantic import model_validator

from sonarsynth.conventions import Floats, Metres, NonNegativeMetres, Number, Position, PositiveMetres, direction
from sonarsynth.description import BY_KIND, description
from sonarsynth.geometry import Pose
from sonarsynth.recipe.populations.drawn_tracks import between

Heights = tuple[Metres, Metres]
"""Lowest and highest z, negative under the surface."""


@dataclass(frozen=True, eq=False)
class SonarView:
    """What the sonar sees in the middle of the sequence."""

    pose: Pose
    azimuth_span: float  # rad
    elevation_span: float  # rad


@description
class FieldOfView:
    """Within the beams of the sonar in the middle of the sequence: evenly in range, azimuth and sine of elevation."""

    kind: Literal["field_of_view"] = "field_of_view"
    near: PositiveMetres
    """Shortest range."""
    far: PositiveMetres
    """Longest range."""
    share: Annotated[Number, Gt(0), Le(2)] = 1.0
    """Share of the spans of the beams in which bodies are: over 1, some bodies are out of view."""

    @model_validator(mode="after")
    def _check(self) -> FieldOfView:
        if not self.near < self.far:
            raise ValueError(f"near must be less than far: {self.near:g} to {self.far:g} m")
        return self

    def place(self, draws: Floats, view: SonarView) -> Floats | None:
        """(xyz) m in the world by three draws (0 to 1); None: none there."""
        reach = self.near + (self.far - self.near) * draws[0]
        azimuth = self.share * view.azimuth_span * (draws[1] - 0.5)
        highest = np.sin(min(0.5 * self.share * view.elevation_span, 0.5 * np.pi))
        elevation = np.arcsin(highest * (2.0 * draws[2] - 1.0))
        return np.asarray(view.pose.to_world(reach * direction(np.float64(azimuth), np.float64(elevation))))


@description
class BoxRegion:
    """Evenly in a box along the axes of the world."""

    kind: Literal["box"] = "box"
    low: Position
    """Least x, y and z."""
    high: Position
    """Largest x, y and z."""

    @model_validator(mode="after")
    def _check(self) -> BoxRegion:
        for axis, low, high in zip("xyz", self.low, self.high, strict=True):
            if low > high:
                raise ValueError(f"low must not be over high: {axis} from {low:g} to {high:g} m")
        return self

    def place(self, draws: Floats, view: SonarView) -> Floats | None:
        """As `FieldOfView.place`."""
        low, high = np.array(self.low), np.array(self.high)
        return np.asarray(low + (high - low) * draws)


@description
class Annulus:
    """Evenly in area between two circles, and in height."""

    kind: Literal["annulus"] = "annulus"
    centre: tuple[Metres, Metres]
    """Centre of both circles: x (east) and y (north)."""
    inner: NonNegativeMetres = 0.0
    """Radius of the inner circle."""
    outer: PositiveMetres
    """Radius of the outer circle."""
    heights: Heights
    """Lowest and highest z."""

    @model_validator(mode="after")
    def _check(self) -> Annulus:
        if not self.inner < self.outer:
            raise ValueError(f"inner must be less than outer: {self.inner:g} to {self.outer:g} m")
        _check_heights(self.heights)
        return self

    def place(self, draws: Floats, view: SonarView) -> Floats | None:
        """As `FieldOfView.place`."""
        radius = np.sqrt(self.inner**2 + (self.outer**2 - self.inner**2) * draws[0])
        x, y = np.array(self.centre) + radius * np.array([np.cos(2 * np.pi * draws[1]), np.sin(2 * np.pi * draws[1])])
        return np.array([x, y, between(self.heights, draws[2])])


@description
class PolygonRegion:
    """Evenly in area within a polygon that does not cross itself, and in height."""

    kind: Literal["polygon"] = "polygon"
    corners: Annotated[tuple[tuple[Metres, Metres], ...], MinLen(3), MaxLen(1000)]
    """x and y of each, in order."""
    heights: Heights
    """Lowest and highest z."""

    @model_validator(mode="after")
    def _check(self) -> PolygonRegion:
        _check_heights(self.heights)
        x, y = np.array(self.corners).T
        if not abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) > 0.0:
            raise ValueError("corners enclose no area")
        return self

    def place(self, draws: Floats, view: SonarView) -> Floats | None:
        """As `FieldOfView.place`: of draws over the box round the polygon, those outside are none."""
        corners = np.array(self.corners)
        x, y = corners.min(axis=0) + np.ptp(corners, axis=0) * draws[:2]
        (ax, ay), (bx, by) = corners.T, np.roll(corners, -1, axis=0).T
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            right = x < ax + (y - ay) / (by - ay) * (bx - ax)
        inside = np.count_nonzero(crosses & right) % 2 == 1
        return np.array([x, y, between(self.heights, draws[2])]) if inside else None


Region = Annotated[FieldOfView | BoxRegion | Annulus | PolygonRegion, BY_KIND]


def _check_heights(heights: Heights) -> None:
    if heights[0] > heights[1]:
        raise ValueError(f"heights must be the lowest and the highest z: {heights[0]:g} to {heights[1]:g} m")
