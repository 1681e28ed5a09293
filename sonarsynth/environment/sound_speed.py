"""What people write about the sound speed, and the profile that rays go through."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import ValidationInfo, field_validator, model_validator

from sonarsynth.conventions import (
    Floats,
    Latitude,
    MetresPerSecond,
    NonNegativeMetres,
    Number,
    PositiveMetres,
    PositiveSeconds,
    WaterSoundSpeed,
)
from sonarsynth.description import BY_KIND, description
from sonarsynth.environment.hydrography import Longitude, SpeedFormula, WaterSalinity, WaterTemperature
from sonarsynth.environment.profiles import carried_on, catenary_nodes, munk_nodes
from sonarsynth.environment.speed_model import SpeedModel

Depths = Annotated[tuple[NonNegativeMetres, ...], MinLen(1)]


def _ascending(depth: tuple[float, ...]) -> tuple[float, ...]:
    for i, (above, below) in enumerate(pairwise(depth), start=1):
        if below < above:
            raise ValueError(f"must not decrease, but entry {i} ({below:g} m) is above entry {i - 1} ({above:g} m)")
    return depth


def _as_long_as_depth(values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
    if (depth := info.data.get("depth")) is not None and len(values) != len(depth):
        raise ValueError(f"has {len(values)} entries, but depth has {len(depth)}")
    return values


def _of_water(model: Any) -> Any:
    _ = model.nodes  # raises where a speed is not of water
    return model


@description
class Isovelocity(SpeedModel):
    """The same sound speed everywhere."""

    kind: Literal["isovelocity"] = "isovelocity"
    speed: WaterSoundSpeed
    """Sound speed at all depths."""


@description
class Tabulated(SpeedModel):
    """Sound speed at depths, linear between them, constant beyond the ends. Two equal depths make a jump."""

    kind: Literal["tabulated"] = "tabulated"
    measured: ClassVar[bool] = True
    depth: Depths
    """Depths below the surface (m), not decreasing."""
    speed: tuple[WaterSoundSpeed, ...]
    """Sound speed at each depth."""

    _depth = field_validator("depth")(_ascending)
    _speed = field_validator("speed")(_as_long_as_depth)


@description
class TemperatureSalinity(SpeedModel):
    """Sound speed from temperature and salinity at depths; linear between the depths.

    Between 2 and 30 degC and 30 and 40 psu the formulas differ by 0.43 m/s at most over the upper 200 m (Mackenzie, Del
    Grosso and TEOS-10 by 0.18), and by 1.15 over the upper 1000. A plan notes one that is used out of its range.
    """

    kind: Literal["temperature_salinity"] = "temperature_salinity"
    measured: ClassVar[bool] = True
    depth: Depths
    """Depths below the surface (m), not decreasing."""
    temperature: tuple[WaterTemperature, ...]
    """Temperature at each depth."""
    salinity: tuple[WaterSalinity, ...]
    """Practical salinity at each depth."""
    formula: SpeedFormula = "mackenzie"
    """How sound speed follows from them."""
    latitude: Latitude | None = None
    """Latitude of the place ("1.3 deg"), for the pressure at a depth; left out: 45 degrees."""
    longitude: Longitude | None = None
    """Longitude of the place, for what the salt there consists of (teos10); left out: standard sea water."""

    _depth = field_validator("depth")(_ascending)
    _values = field_validator("temperature", "salinity")(_as_long_as_depth)


@description
class Cast(SpeedModel):
    """A cast in a file, as the instrument or the archive has it: what is read is in the page on casts.

    Depth (m or dbar) and sound speed, or temperature and salinity (or conductivity), are found by name. The down-cast
    is taken (the up-cast where there is none), without rows in the air, heave loops and missing values; a note says so.
    """

    kind: Literal["cast"] = "cast"
    measured: ClassVar[bool] = True
    path: str
    """Path of the file, relative to the recipe."""
    quantity: Literal["auto", "sound_speed", "temperature_salinity"] = "auto"
    """Which columns to use; auto takes the instrument's own sound speed where there is one."""
    formula: SpeedFormula = "mackenzie"
    """How sound speed follows from temperature and salinity."""
    latitude: Latitude | None = None
    """Latitude of the place ("1.3 deg"), for depth and pressure; left out: what the file says, else 45 degrees."""
    longitude: Longitude | None = None
    """Longitude of the place, for what its salt consists of (teos10); left out: what the file says, else standard."""
    salinity: WaterSalinity | None = None
    """Salinity at all depths, where the file has none (an expendable thermograph); left out: such a file is refused."""
    profile: Annotated[int, Ge(0)] | None = None
    """Which of several profiles in the file, from 0; left out: the first, with a note."""
    smoothing: PositiveMetres | None = None
    """Left out: every node as it is, micro-layers kept. Else layers of this thickness (or a little less, to fit), with
    the speeds at their nodes that are nearest to the cast in the mean square over depth: straight parts, the mean and
    so the vertical travel time stay, noise finer than the layers goes."""


@description
class Linear(SpeedModel):
    """Sound speed of one gradient, to the depth where it would leave 100 to 10 000 m/s, which no water reaches."""

    kind: Literal["linear"] = "linear"
    surface_speed: WaterSoundSpeed
    """Sound speed at the surface."""
    gradient: Number
    """Rise of the sound speed with depth (m/s per m); 0.0163 is that of pressure alone."""

    @property
    def nodes(self) -> tuple[Floats, Floats]:
        """Depths (m) and speeds (m/s), exactly linear between."""
        return carried_on([0.0], [self.surface_speed], self.gradient)


@description
class Thermocline(SpeedModel):
    """A warm mixed layer, a thermocline and the water below it: three straight pieces, exactly.

    The defaults are those of a shallow tropical site. Mixed water of 29.2 degC and 32.4 psu has 1541 m/s (Mackenzie
    1981), as in the Malacca Strait; below the thermocline it is 2.8 K colder, as on the Sunda shelf, where 29 to 31
    degC lie over 25 to 29 (Roseli et al. 2015, Open J. Marine Sci. 5, 455-467). The thermocline is a sharp one, -4.3
    per second: rays of 350 m radius, so that bending shows at 20 m.
    """

    kind: Literal["thermocline"] = "thermocline"
    surface_speed: WaterSoundSpeed = 1541.0
    """Sound speed in the mixed layer."""
    mixed_depth: NonNegativeMetres = 5.0
    """Depth of the top of the thermocline."""
    thickness: NonNegativeMetres = 1.5
    """Thickness of the thermocline; 0 makes a jump."""
    drop: MetresPerSecond = 6.45
    """Sound speed lost from its top to its bottom."""
    gradient: Number = 0.0163
    """Rise with depth in the mixed layer and below the thermocline (m/s per m): by pressure (Mackenzie 1981)."""

    @property
    def nodes(self) -> tuple[Floats, Floats]:
        """Depths (m) and speeds (m/s), exactly linear between."""
        mixed = self.surface_speed + self.gradient * self.mixed_depth
        depth = [0.0, self.mixed_depth, self.mixed_depth + self.thickness]
        return carried_on(depth, [self.surface_speed, mixed, mixed - self.drop], self.gradient)

    _check = model_validator(mode="after")(_of_water)


RayTimeError = Annotated[PositiveSeconds, Ge(1e-9), Le(1e-4)]


@description
class Munk(SpeedModel):
    """The canonical deep sound channel, c1 (1 + eps (eta - 1 + exp(-eta))), eta = 2 (z - z1)/B (Munk 1974).

    Rays go through layers of linear sound speed that stand for the formula (`environment.profiles`). Travel times
    measured against rays integrated through the formula (ends at 100 to 4500 m, up to 3 vertices; left out are rays
    that graze the bottom at under 1 degree or for which the integration did not converge, 5 % at 50 km), largest and
    root mean square error in s; `chords` are even nodes on the formula itself:

        tolerance   nodes     10 km               50 km               100 km
        1e-5           53     3.6e-6   5.6e-7     1.2e-5   3.4e-6     1.9e-5   9.4e-6
        1e-6          133     8.3e-7   8.0e-8     1.2e-6   3.0e-7     1.7e-6   8.5e-7
        1e-7          333     5.9e-8   6.1e-9     1.3e-7   2.9e-8     2.3e-7   8.5e-8
        1e-8          836     5.9e-9   6.3e-10    1.4e-8   3.6e-9     2.3e-8   7.8e-9
        chords        133     6.6e-5   2.2e-5     9.9e-5   6.6e-5     1.6e-4   9.6e-5

    Layers have corners where the formula has none: the amplitude of a ray that turns goes with the gradient there. At
    1e-6 it is off by 0.25 dB in the median, 1.1 dB for one ray in ten and 3.4 dB at most (100 km). Near a focus two
    false rays may come with a true one, within the tolerance in time (1e-5: 6 of 1375 rays; from 1e-6 on: none).
    """

    kind: Literal["munk"] = "munk"
    axis_depth: Annotated[PositiveMetres, Le(12e3)] = 1300.0
    """Depth z1 of the slowest water."""
    scale: PositiveMetres = 1300.0
    """Depth B over which the stratification falls off."""
    epsilon: Annotated[Number, Ge(0), Le(1)] = 0.00737
    """How strong the channel is, without a unit."""
    axis_speed: WaterSoundSpeed = 1500.0
    """On the axis of the channel, the least."""
    tolerance: RayTimeError = 1e-6
    """Largest error of the travel time that layers may make where a ray turns."""

    @property
    def nodes(self) -> tuple[Floats, Floats]:
        """Depths (m) and speeds (m/s) of the layers."""
        return munk_nodes(self.axis_depth, self.scale, self.epsilon, self.axis_speed, self.tolerance)

    _check = model_validator(mode="after")(_of_water)


@description
class Catenary(SpeedModel):
    """A deep duct with closed forms, c1 cosh((z - z1)/g): every ray meets the axis again after pi g, at once.

    In units of travel time it is a sphere and its rays are great circles. The perfect lens, for checks; in layers like
    `Munk`, but foci are where layers do worst: some rays there come as three.
    """

    kind: Literal["catenary"] = "catenary"
    axis_depth: Annotated[NonNegativeMetres, Le(12e3)]
    """Depth of the axis of the duct."""
    scale: PositiveMetres
    """Depth g over which the sound speed rises by half."""
    axis_speed: WaterSoundSpeed = 1500.0
    """Sound speed on the axis, the least."""
    tolerance: RayTimeError = 1e-6
    """Largest error of the travel time that layers may make where a ray turns."""

    @property
    def nodes(self) -> tuple[Floats, Floats]:
        """Depths (m) and speeds (m/s) of the layers."""
        return catenary_nodes(self.axis_depth, self.scale, self.axis_speed, self.tolerance)

    _check = model_validator(mode="after")(_of_water)


SoundSpeed = Annotated[
    Isovelocity | Linear | Tabulated | TemperatureSalinity | Cast | Thermocline | Munk | Catenary, BY_KIND
]


def reaches(sound_speed: SoundSpeed, depth: float) -> None:
    """Raises ValueError in one line where a formula of sound speed ends above a bottom at `depth` (m)."""
    if isinstance(sound_speed, (Linear, Thermocline, Munk, Catenary)):
        node, speed = sound_speed.nodes
        if node[-1] < depth:
            raise ValueError(
                f"the sound speed, {sound_speed.kind}, goes down to {node[-1]:g} m, where it is {speed[-1]:g} m/s: "
                f"not to the bottom at {depth:g} m"
            )


@dataclass(frozen=True, eq=False)
class Profile:
    """Sound speed (m/s) at node depths (m), piecewise linear, constant beyond the ends: what rays go through."""

    depth: Floats  # (node,) not decreasing
    speed: Floats  # (node,)
    notes: tuple[str, ...] = ()  # where a formula that made it was used outside its range, one line each

    @cached_property
    def uniform(self) -> bool:
        """True where the sound speed is the same everywhere."""
        return bool(np.all(self.speed == self.speed[0]))

    def at(self, depth: np.ndarray | float) -> Floats:
        """Sound speed (m/s) at depths (m, positive down)."""
        speed = np.full(np.shape(depth), self.speed[0])
        return speed if self.uniform else np.asarray(np.interp(depth, self.depth, self.speed))


@lru_cache(maxsize=64)  # the same in all frames of a sonar that stands still
def mean_gradient(profile: Profile, depth: float, other_depth: float, least: float) -> float:
    """Mean of |dc/dz| (1/s) between two depths (m), over no less than `least` (m) about them; jumps count."""
    middle, half = 0.5 * (depth + other_depth), 0.5 * max(abs(depth - other_depth), least)
    between = np.abs(profile.depth - middle) < half
    speed = [profile.at(middle - half), *profile.speed[between], profile.at(middle + half)]
    return float(np.sum(np.abs(np.diff(speed)))) / (2 * half)


@lru_cache(maxsize=64)
def kink(profile: Profile, depth: float, reach: float) -> float:
    """Change (1/s) of the gradient of the sound speed within `reach` (m) of a depth (m): 0 of one slope."""
    inside = profile.depth[np.abs(profile.depth - depth) < reach]
    node = np.unique([depth - reach, *inside, depth + reach])
    slope = np.diff(profile.at(node)) / np.diff(node)
    return float(np.ptp(slope)) if len(slope) else 0.0  # a reach that rounding swallows
