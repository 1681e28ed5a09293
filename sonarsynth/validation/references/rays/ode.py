"""Rays through layers by shooting: ray equations integrated by DOP853 from node to node, Newton on the launch angle.

Over the arc length s, with the grazing angle t down positive, c linear in depth between the nodes:
    dx/ds = cos t,  dz/ds = sin t,  dt/ds = -c' cos t/c,  dT/ds = 1/c.
The integration stops at every node, and goes on in the next layer; at surface and bottom it is reflected; at a jump it
obeys Snell's law. For the change of depth with the launch angle neighbours of the ray are followed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.validation.rays.ray_matching import Rays

TOLERANCE = 1e-13
ROUNDS = 6  # of Newton's iteration
TURN = 2
NEIGHBOUR = 1e-5  # rad, or less: a hundredth of the launch angle


@dataclass(frozen=True)
class End:
    """A ray where it has covered the distance."""

    depth: float  # m
    angle: float  # rad, down positive
    time: float  # s
    surface: int
    bottom: int
    turning: int

    @property
    def way(self) -> tuple[int, int, int]:
        """Counts of its vertices."""
        return self.surface, self.bottom, self.turning


def follow(depth: Floats, speed: Floats, start: float, angle: float, distance: float) -> End:
    """Follow one ray from a depth (m) at a launch angle (rad, down positive) through nodes (node,) m and m/s."""
    layer = int(np.clip(np.searchsorted(depth, start) - 1, 0, len(depth) - 2))
    state = np.array([0.0, start, angle, 0.0])
    surface = bottom = turning = 0
    while True:
        state, edge = _cross(depth, speed, layer, state, distance)
        if edge == TURN:
            turning += 1
            continue
        if edge == 0:
            return End(float(state[1]), float(state[2]), float(state[3]), surface, bottom, turning)
        beyond = layer + edge
        c = float(speed[layer + (edge > 0)])
        while 0 <= beyond < len(depth) - 1 and depth[beyond] == depth[beyond + 1]:
            beyond += edge
        if not 0 <= beyond < len(depth) - 1:
            surface, bottom = surface + (edge < 0), bottom + (edge > 0)
            state[2] = -state[2]
            continue
        cosine = np.cos(state[2]) * speed[beyond + (edge < 0)] / c
        if cosine >= 1.0:
            turning += 1
            state[2] = -state[2]
            continue
        if speed[beyond + (edge < 0)] != c:
            state[2] = edge * np.arccos(cosine)
        layer = beyond


def _cross(depth: Floats, speed: Floats, layer: int, state: Floats, distance: float) -> tuple[Floats, int]:
    """The state where the ray leaves a layer, upwards (-1) or downwards (1), is level in it, or is at the distance (0).

    Between level places depth is monotone, so that no node is passed unseen.
    """
    from scipy.integrate import solve_ivp

    top, base = float(depth[layer]), float(depth[layer + 1])
    gradient = float(speed[layer + 1] - speed[layer]) / (base - top)

    def slopes(s: float, y: Floats) -> list[float]:
        c = speed[layer] + gradient * (y[1] - top)
        cosine = np.cos(y[2])
        return [cosine, np.sin(y[2]), -gradient * cosine / c, 1.0 / c]

    def above(s: float, y: Floats) -> float:
        return float(y[1] - top)

    def below(s: float, y: Floats) -> float:
        return float(y[1] - base)

    def far(s: float, y: Floats) -> float:
        return float(y[0] - distance)

    stops = [_stop(above, -1), _stop(below, 1), _stop(far, 1)]
    bend = slopes(0.0, state)[2]
    longest = 100.0 * (distance - state[0] + base - top)
    level = abs(state[2] / bend) if state[2] * bend < 0.0 else np.inf  # p c' is the same all along an arc
    solution = solve_ivp(
        slopes, (0.0, min(longest, level)), state, events=stops, method="DOP853", rtol=TOLERANCE, atol=1e-14
    )
    met = [(times[0], i) for i, times in enumerate(solution.t_events) if len(times)]
    if not met:
        exact = solution.y[:, -1].copy()
        exact[2] = 0.0
        return exact, TURN
    length, which = min(met)
    exact = solve_ivp(slopes, (0.0, length), state, method="DOP853", rtol=TOLERANCE, atol=1e-14).y[:, -1]
    slope = np.array(slopes(length, exact))  # the place of an event is an interpolation: the rest of the way
    aim, row = ((top, 1), (base, 1), (distance, 0))[which]
    exact = exact + slope * (aim - exact[row]) / slope[row]
    exact[row] = aim
    return exact, (-1, 1, 0)[which]


def _stop(function: Callable[[float, Floats], float], direction: int) -> Callable[[float, Floats], float]:
    function.terminal, function.direction = True, direction  # type: ignore[attr-defined]
    return function


def followed_rays(depth: Floats, speed: Floats, computed: Rays, start: Floats, end: Floats, distance: Floats) -> Rays:
    """The rays near those computed, with the vertices that they meet; NaN where there is none near by.

    Newton's iteration of the miss in depth from the launch angle of each ray (ray,); ends start, end (pair,) m at
    distances (pair,) m, not within one layer's rounding of a node.
    """
    rows = []
    for pair, angle in zip(computed.pair, -computed.start_angle, strict=True):
        ends = (float(start[pair]), float(end[pair]), float(distance[pair]))
        rows.append(_shoot(depth, speed, float(angle), *ends))
    columns = np.array(rows, float).reshape(-1, 7).T
    time, first, last, amplitude = columns[:4]
    surface, bottom, turning = (columns[k].astype(int) for k in (4, 5, 6))
    return Rays(computed.pair, time, first, last, amplitude, surface, bottom, turning, np.full(len(computed.pair), -1))


def _shoot(depth: Floats, speed: Floats, angle: float, start: float, end: float, distance: float) -> list[float]:
    def shot(launch: float) -> End:
        return follow(depth, speed, start, launch, distance)

    ray = shot(angle)
    slope = _slope(shot, angle, ray.way)
    for _ in range(ROUNDS):
        miss = ray.depth - end
        if abs(miss) <= 1e-13 * (end + distance):
            break
        if not np.isfinite(slope):
            break
        angle -= miss / slope
        ray = shot(angle)
    if not abs(ray.depth - end) <= 1e-9 * (end + distance):
        return [np.nan] * 4 + [-1.0] * 3
    c = np.interp([start, end], depth, speed)
    amplitude = np.sqrt(c[1] / c[0] * np.cos(angle) / (distance * abs(slope) * np.cos(ray.angle)))
    return [ray.time, -angle, -ray.angle, float(amplitude), *map(float, ray.way)]


def _slope(shot: Callable[[float], End], angle: float, way: tuple[int, int, int]) -> float:
    """Change of the depth with the launch angle (m/rad) by differences of fourth order between rays of one way."""
    step = min(NEIGHBOUR, 0.01 * abs(angle))
    for _ in range(4):
        near = {k: shot(angle + k * step) for k in (-2, -1, 1, 2)}
        if all(ray.way == way for ray in near.values()):
            z = {k: ray.depth for k, ray in near.items()}
            return (8.0 * (z[1] - z[-1]) - (z[2] - z[-2])) / (12.0 * step)
        step *= 0.1
    return float("nan")
