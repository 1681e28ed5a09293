"""Every ray between points in the water, asked for directly: without a scene, a sonar or a recipe."""

from __future__ import annotations

import operator
import warnings
from dataclasses import dataclass
from typing import get_args

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.environment.casts import profile_of
from sonarsynth.environment.sound_speed import SoundSpeed, reaches
from sonarsynth.equations.rays import ray_solutions as kernel
from sonarsynth.equations.water.formula_ranges import OutOfRange

MOST_VERTICES = 1000
FARTHEST = 1e9
"""m."""
ROWS = 20
"""Rays that are printed; the rest is counted."""
COLUMNS = " pair      time/s  launch/deg  arrival/deg  surface  bottom  turning  caustics  loss/dB"


@dataclass(frozen=True, eq=False, repr=False)
class RayArrivals:
    """Rays from sources to receivers, sorted by pair, then by travel time. Printed, it shows a table.

    A pair may have no ray (a shadow zone) or several. Angles are those of travel, from the horizontal, down positive.
    """

    pair: Ints  # (ray,) flat index of the pair in the shape that the arguments have together
    travel_time: Floats  # (ray,) s
    length: Floats  # (ray,) m, along the ray
    launch_angle: Floats  # (ray,) rad at the source; NaN where source and receiver coincide
    arrival_angle: Floats  # (ray,) rad at the receiver
    surface: Ints  # (ray,) reflections from the surface
    bottom: Ints  # (ray,) reflections from the bottom
    turning: Ints  # (ray,) turning points
    caustics: Ints  # (ray,) caustics passed: each takes a quarter period off the phase
    ray_parameter: Floats  # (ray,) s/m: p = cos(angle)/c, the same all along the ray, and the slope dT/dR
    amplitude: Floats  # (ray,) 1/m: geometric, re 1 m from the source; without absorption and loss at boundaries
    departure: Floats  # (ray, xyz) unit vector of travel at the source, world axes; NaN where the points coincide
    arrival: Floats  # (ray, xyz) unit vector of travel at the receiver
    flag: Ints  # (ray,) 0 good; else why ray theory ends here: `reason`

    def __len__(self) -> int:
        return len(self.pair)

    @property
    def reason(self) -> tuple[str, ...]:
        """What the flag of each ray means."""
        return tuple(kernel.REASONS[flag] for flag in self.flag.tolist())

    @property
    def transmission_loss(self) -> Floats:
        """(ray,) geometric transmission loss in dB re 1 m."""
        with np.errstate(divide="ignore"):
            return np.asarray(-20.0 * np.log10(self.amplitude))

    def select(self, keep: Bools | Ints) -> RayArrivals:
        """The rays picked by a mask or by indices (ray,)."""
        return RayArrivals(**{name: value[keep] for name, value in vars(self).items()})

    def __repr__(self) -> str:
        lines = [f"{len(self)} ray{'' if len(self) == 1 else 's'}"]
        if len(self):
            lines.append(COLUMNS)
        loss = self.transmission_loss
        for i in range(min(len(self), ROWS)):
            reason = kernel.REASONS[int(self.flag[i])].partition(":")[0] if self.flag[i] != kernel.GOOD else ""
            row = (
                f"{self.pair[i]:5d} {self.travel_time[i]:11.7f} {np.rad2deg(self.launch_angle[i]):11.4f}"
                f" {np.rad2deg(self.arrival_angle[i]):12.4f} {self.surface[i]:8d} {self.bottom[i]:7d}"
                f" {self.turning[i]:8d} {self.caustics[i]:9d} {loss[i]:8.2f}  {reason}"
            )
            lines.append(row.rstrip())
        if len(self) > ROWS:
            lines.append(f"... and {len(self) - ROWS} more")
        return "\n".join(lines)


def eigenrays(
    sound_speed: SoundSpeed,
    bottom_depth: npt.ArrayLike,
    source_depth: npt.ArrayLike,
    receiver_depth: npt.ArrayLike,
    horizontal_range: npt.ArrayLike,
    *,
    vertices: int = 2,
) -> RayArrivals:
    """Every ray with at most `vertices` vertices (surface and bottom reflections and turning points) between points.

    Surface and bottom are flat and perfect: losses are for the caller. None is missed, none comes twice: the search is
    exact for piecewise linear profiles. Smooth ones have travel times to their tolerance; what layers do to amplitudes
    and near foci is said in `Munk`. Directions lie in the x-z plane, from source to receiver along x.

    Parameters
    ----------
    sound_speed: a description, such as `Isovelocity`, `Linear`, `Tabulated`, `Cast`, `Thermocline`, `Munk`.
    bottom_depth: m, positive down; this and the next three are numbers or arrays of any shapes that broadcast.
    source_depth: m, positive down.
    receiver_depth: m, positive down.
    horizontal_range: m.
    vertices: the most that a ray may have.

    Returns
    -------
    Times (s), directions, counts, caustics and losses (dB) of the rays of each pair, the first to arrive first;
    printed, they are a table.

    Raises
    ------
    ValueError in one line that names the argument and the pair: for a point outside the water, a negative range, a
    number that is not finite, a formula that ends above the bottom; `CastError` for a cast that cannot be read.

    Examples
    --------

    >>> import sonarsynth as ss
    >>> ss.eigenrays(ss.Isovelocity(speed=1500.0), 20.0, 5.0, 10.0, 100.0, vertices=1)
    3 rays
     pair      time/s  launch/deg  arrival/deg  surface  bottom  turning  caustics  loss/dB
        0   0.0667499      2.8624       2.8624        0       0        0         0    40.01
        0   0.0674125     -8.5308       8.5308        1       0        0         0    40.10
        0   0.0687184     14.0362     -14.0362        0       1        0         0    40.26
    """
    names = ("bottom_depth", "source_depth", "receiver_depth", "horizontal_range")
    values = (bottom_depth, source_depth, receiver_depth, horizontal_range)
    bottom_depth, start, end, distance = _together(
        names, [_numbers(n, value) for n, value in zip(names, values, strict=True)]
    )
    return _find(sound_speed, bottom_depth, start, end, distance, np.array([[1.0, 0.0]]), names, vertices)


def eigenrays_between(
    sound_speed: SoundSpeed,
    bottom_depth: npt.ArrayLike,
    source: npt.ArrayLike,
    receiver: npt.ArrayLike,
    *,
    vertices: int = 2,
) -> RayArrivals:
    """Every ray between positions in 3-D.

    Parameters
    ----------
    sound_speed: a description, as of `eigenrays`.
    bottom_depth: m, positive down.
    source: positions (..., xyz) in the world, m: z is up, and the water is at z < 0.
    receiver: positions (..., xyz), likewise; the two broadcast.
    vertices: the most that a ray may have.

    Returns
    -------
    What `eigenrays` does; departure and arrival are in world axes, those of a vertical ray (0, 0, +-1).

    Raises
    ------
    ValueError and CastError as `eigenrays` does.

    Examples
    --------

    >>> import sonarsynth as ss
    >>> rays = ss.eigenrays_between(ss.Isovelocity(speed=1500.0), 20.0, (0, 0, -10), (3, 4, -10), vertices=0)
    >>> rays.departure.tolist()
    [[0.6, 0.8, 0.0]]
    """
    start, end = _numbers("source", source), _numbers("receiver", receiver)
    for name, position in (("source", start), ("receiver", end)):
        if position.shape[-1:] != (3,):
            raise ValueError(f"{name} must be positions (..., xyz), but its shape is {position.shape}")
        wrong = ~np.isfinite(position).all(axis=-1)
        if wrong.any():
            which = f" {int(np.argmax(wrong))}" if wrong.size > 1 else ""
            raise ValueError(f"{name}{which} must be finite, but is {position.reshape(-1, 3)[int(np.argmax(wrong))]}")
    names = ("bottom_depth", "source", "receiver")
    bottom_depth = _numbers("bottom_depth", bottom_depth)
    bottom_depths, from_row, to_row = _together(names, [bottom_depth, _rows(start), _rows(end)])
    start, end = start.reshape(-1, 3)[from_row.astype(int)], end.reshape(-1, 3)[to_row.astype(int)]
    span = end[:, :2] - start[:, :2]
    distance = np.hypot(span[:, 0], span[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        ahead = np.where(distance[:, None] > 0.0, span / distance[:, None], 0.0)
    named = ("bottom_depth", "source", "receiver", "horizontal distance")
    return _find(sound_speed, bottom_depths, -start[:, 2], -end[:, 2], distance, ahead, named, vertices)


def _find(
    sound_speed: SoundSpeed,
    bottom_depth: Floats,
    start: Floats,
    end: Floats,
    distance: Floats,
    ahead: Floats,
    names: tuple[str, ...],
    vertices: int,
) -> RayArrivals:
    """Rays of pairs in water down to bottoms (pair,), a search for each depth of bottom; ahead: (pair or 1, xy)."""
    if not isinstance(sound_speed, get_args(get_args(SoundSpeed)[0])):
        kinds = ", ".join(kind.__name__ for kind in get_args(get_args(SoundSpeed)[0]))
        raise ValueError(f"sound_speed must be one of {kinds}, not {type(sound_speed).__name__}")
    try:
        max_vertices = operator.index(vertices)
    except TypeError:
        raise ValueError(f"vertices must be a whole number, not {vertices!r}") from None
    if not 0 <= max_vertices <= MOST_VERTICES:
        raise ValueError(f"vertices must lie between 0 and {MOST_VERTICES}, but is {max_vertices}")
    _check(names, bottom_depth, start, end, distance)
    profile = profile_of(sound_speed)
    for note in profile.notes:
        warnings.warn(note, OutOfRange, stacklevel=2)
    groups, pairs = [], []
    for depth in np.unique(bottom_depth) if len(bottom_depth) else []:
        reaches(sound_speed, float(depth))
        chosen = np.flatnonzero(bottom_depth == depth)
        water = kernel.water(profile.depth, profile.speed, float(depth))
        rays = kernel.eigenrays(water, start[chosen], end[chosen], distance[chosen], max_vertices, max_vertices)
        groups.append(_arrivals(rays, chosen[rays.pair], ahead, distance))
        pairs.append(groups[-1].pair)
    if not groups:
        nothing = np.empty(0)
        water = kernel.water(profile.depth, profile.speed, 1.0)
        return _arrivals(kernel.eigenrays(water, nothing, nothing, nothing), np.empty(0, np.int64), ahead, nothing)
    order = np.argsort(np.concatenate(pairs), kind="stable")
    return RayArrivals(**{name: np.concatenate([vars(g)[name] for g in groups])[order] for name in vars(groups[0])})


def _arrivals(rays: kernel.Eigenrays, pair: Ints, ahead: Floats, distance: Floats) -> RayArrivals:
    toward = np.broadcast_to(ahead, (len(distance), 2))[pair]
    vertical = distance[pair] == 0.0
    angles, directions = [], []
    for sine, speed in ((rays.start_sine, rays.start_speed), (rays.end_sine, rays.end_speed)):
        cosine = np.where(np.isnan(sine), np.nan, np.where(vertical, 0.0, rays.slowness * speed))
        angles.append(np.arctan2(0.0 - sine, cosine))
        directions.append(np.concatenate([toward * cosine[:, None], sine[:, None]], axis=1))
    return RayArrivals(
        pair=pair,
        travel_time=rays.travel_time,
        length=rays.length,
        launch_angle=angles[0],
        arrival_angle=angles[1],
        surface=rays.surface,
        bottom=rays.bottom,
        turning=rays.turning,
        caustics=rays.caustics,
        ray_parameter=rays.slowness,
        amplitude=rays.amplitude,
        departure=directions[0],
        arrival=directions[1],
        flag=rays.flag,
    )


def _numbers(name: str, values: npt.ArrayLike) -> Floats:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be numbers") from None


def _rows(position: Floats) -> Floats:
    """Numbers (...) of the positions (..., xyz) in a flat list of them."""
    return np.arange(position.size // 3, dtype=float).reshape(position.shape[:-1])


def _together(names: tuple[str, ...], arrays: list[Floats]) -> list[Floats]:
    """The arrays broadcast and made flat (pair,)."""
    try:
        return [np.ascontiguousarray(a).reshape(-1) for a in np.broadcast_arrays(*arrays)]
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(names, arrays, strict=True))
        raise ValueError(f"these shapes do not broadcast: {shapes}") from None


def _check(names: tuple[str, ...], bottom_depth: Floats, start: Floats, end: Floats, distance: Floats) -> None:
    """Raises ValueError in one line that names what is wrong, and which of them."""

    def first(wrong: Bools, name: str, values: Floats, problem: str) -> None:
        if wrong.any():
            i = int(np.argmax(wrong))
            which = f"{name} of pair {i}" if len(values) > 1 else name
            raise ValueError(f"{which} {problem.format(value=values[i], bottom_depth=bottom_depth[i])}")

    for name, values in zip(names, (bottom_depth, start, end, distance), strict=True):
        first(~np.isfinite(values), name, values, "must be finite, but is {value:g} m")
    first(bottom_depth <= 0.0, names[0], bottom_depth, "must be positive, but is {value:g} m")
    for name, values in ((names[1], start), (names[2], end)):
        wrong = (values < -kernel.TOLERANCE) | (values > bottom_depth + kernel.TOLERANCE)
        first(wrong, name, values, "at {value:.12g} m depth is not in the water, which is {bottom_depth:.12g} m deep")
    first(distance < 0.0, names[3], distance, "must not be negative, but is {value:g} m")
    first(distance > FARTHEST, names[3], distance, f"must be at most {FARTHEST:g} m, but is {{value:g}} m")
