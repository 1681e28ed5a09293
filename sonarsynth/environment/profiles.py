"""Sound speed in depth as formulas, and the layers of linear sound speed that stand for them.

Rays through a profile of chords arrive late or early by the mean of what the chords are wrong by: of first order in the
sagitta. The layers here have node speeds nearest to the formula in the mean square over depth, so that the error of
every layer has no mean and no first moment; what is left comes from where rays turn. Around a turning point, where the
gradient is g, layers of thickness h in a formula of curvature c'' make an error of the travel time of at most

    0.048 c'' h^2.5 / (c^1.5 g^0.5)

(the Fourier series of c'' h^2 B2/2, B2 the Bernoulli polynomial, through int dz/(c^2 sqrt(2 g z/c)), both ways). It is
made the same everywhere, which grades the layers: h = (tolerance c^1.5 g^0.5 / 0.048 c'')^0.4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import FASTEST, SLOWEST, Floats

DEEPEST = 12e3
"""Depth (m) down to which a curved formula is given layers: deeper than any sea."""
STRAIGHT_TO = 1e6
"""Depth (m) to which straight pieces go on."""

TURNING_ERROR = 0.048
CAUTION = 1.5
"""Layers are made for a tolerance smaller by this: the law above holds for layers thinner than all else."""

GAUSS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Curve:
    """A formula of sound speed: speed (m/s), gradient (1/s) and curvature (1/(m s)) at depths (m)."""

    speed: Callable[[Floats], Floats]
    gradient: Callable[[Floats], Floats]
    curvature: Callable[[Floats], Floats]


def munk(axis_depth: float, scale: float, epsilon: float, axis_speed: float) -> Curve:
    """The canonical deep sound channel: c = c1 (1 + eps (eta - 1 + exp(-eta))), eta = 2 (z - z1)/B.

    Munk (1974), Sound channel in an exponentially stratified ocean, with application to SOFAR, JASA 55, 220-226.
    """

    def eta(z: Floats) -> Floats:
        return 2.0 * (z - axis_depth) / scale

    return Curve(
        lambda z: axis_speed * (1.0 + epsilon * (eta(z) + np.expm1(-eta(z)))),
        lambda z: -axis_speed * epsilon * 2.0 / scale * np.expm1(-eta(z)),
        lambda z: axis_speed * epsilon * 4.0 / scale**2 * np.exp(-eta(z)),
    )


def catenary(axis_depth: float, scale: float, axis_speed: float) -> Curve:
    """A duct whose rays have closed forms: c = c1 cosh((z - z1)/g).

    Every ray crosses the axis again after pi g and the time pi g/c1, whatever its angle: with w = sinh((z - z1)/g),
    X = 2 g int dw/sqrt(w_turn^2 - w^2). A benchmark of Reilly and Goodrich (2006), Geodetic acoustic rays in the time
    domain.
    """

    def part(z: Floats) -> Floats:
        return (z - axis_depth) / scale

    return Curve(
        lambda z: axis_speed * np.cosh(part(z)),
        lambda z: axis_speed / scale * np.sinh(part(z)),
        lambda z: axis_speed / scale**2 * np.cosh(part(z)),
    )


def _check_of_water(z: float, c: float) -> None:
    if not SLOWEST <= c <= FASTEST:
        raise ValueError(f"the sound speed at {z:g} m is {c:g} m/s; it must be {SLOWEST:g} to {FASTEST:g} m/s")


def carried_on(depth: list[float], speed: list[float], gradient: float) -> tuple[Floats, Floats]:
    """Nodes (m, m/s) with one more, on a gradient (1/s), far below or where no water is as slow or fast.

    Raises ValueError where a node is not of a sound speed of water.
    """
    for z, c in zip(depth, speed, strict=True):
        _check_of_water(z, c)
    end = max(STRAIGHT_TO, depth[-1])
    limit = FASTEST if gradient > 0 else SLOWEST
    last = speed[-1] + gradient * (end - depth[-1])
    if not SLOWEST <= last <= FASTEST:
        end, last = depth[-1] + (limit - speed[-1]) / gradient, limit
    return np.array([*depth, end]), np.array([*speed, last])


def nearest(node: Floats, edge: Floats, speed: Callable[[Floats], Floats]) -> Floats:
    """Speeds (m/s) at nodes (m, rising) of the piecewise linear profile nearest to another one in the mean square.

    edge: depths (m, not falling) between which the other one is smooth, all nodes among them (between them 16-point
    Gauss integration). A linear profile is kept as it is; of any other the mean over the depth and the first moment.
    """
    from scipy.linalg import solveh_banded

    thickness = np.diff(edge)
    x = (edge[:-1, None] + 0.5 * thickness[:, None] * (GAUSS[0] + 1.0)).ravel()
    weight = (0.5 * thickness[:, None] * GAUSS[1]).ravel()
    base = speed(node)
    off = weight * (speed(x) - np.interp(x, node, base))
    layer = np.clip(np.searchsorted(node, x, side="right") - 1, 0, len(node) - 2)
    h = np.diff(node)
    share = (x - node[layer]) / h[layer]
    moment = np.bincount(layer, off * (1.0 - share), len(node)) + np.bincount(layer + 1, off * share, len(node))
    diagonal = (np.append(h, 0.0) + np.append(0.0, h)) / 3.0
    return np.asarray(base + solveh_banded(np.stack([np.append(0.0, h / 6.0), diagonal]), moment))


def graded(curve: Curve, bottom: float, axis: float, scale: float, tolerance: float) -> Floats:
    """Node depths (m) from the surface to `bottom` for a travel time error (s) at each turning point.

    axis, scale (m): where the curve varies most in kind, and over what; it is looked at more closely there.
    """
    z = axis + scale * np.sinh(np.linspace(np.arcsinh(-axis / scale), np.arcsinh((bottom - axis) / scale), 20001))
    z[0], z[-1] = 0.0, bottom
    allowed = tolerance / (CAUTION * TURNING_ERROR) * curve.speed(z) ** 1.5
    bend = np.abs(curve.curvature(z))
    least = np.sqrt(allowed) * bend**0.75  # the gradient one layer off an axis, where it would vanish
    gradient = np.hypot(curve.gradient(z), least) + np.finfo(float).tiny
    density = (bend / (allowed * np.sqrt(gradient))) ** 0.4
    count = np.append(0.0, np.cumsum(0.5 * np.diff(z) * (density[1:] + density[:-1])))
    layers = max(1, int(np.ceil(count[-1])))
    if count[-1] == 0.0:
        return np.array([0.0, bottom])
    node = np.interp(np.linspace(0.0, count[-1], layers + 1), count, z)
    node[0], node[-1] = 0.0, bottom
    return np.asarray(node)


def deepest(curve: Curve, axis: float) -> float:
    """The depth (m) down to which a curve that rises below its axis has speeds of water, `DEEPEST` at most.

    Raises ValueError where it has none at the surface or on its axis.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        for z in (0.0, axis):
            _check_of_water(z, float(curve.speed(np.asarray(z))))
        low, high = axis, max(axis, DEEPEST)
        if curve.speed(np.asarray(high)) <= FASTEST:
            return high
        while high - low > 1e-9 * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if curve.speed(np.asarray(middle)) <= FASTEST else (low, middle)
    return low


@lru_cache(maxsize=64)
def munk_nodes(
    axis_depth: float, scale: float, epsilon: float, axis_speed: float, tolerance: float
) -> tuple[Floats, Floats]:
    """Node depths (m) and speeds (m/s) for `munk`; raises ValueError where no water is as fast."""
    return _layers(munk(axis_depth, scale, epsilon, axis_speed), axis_depth, scale, tolerance)


@lru_cache(maxsize=64)
def catenary_nodes(axis_depth: float, scale: float, axis_speed: float, tolerance: float) -> tuple[Floats, Floats]:
    """Node depths (m) and speeds (m/s) for `catenary`; raises ValueError where no water is as fast."""
    return _layers(catenary(axis_depth, scale, axis_speed), axis_depth, scale, tolerance)


def _layers(curve: Curve, axis: float, scale: float, tolerance: float) -> tuple[Floats, Floats]:
    node = graded(curve, deepest(curve, axis), axis, scale, tolerance)
    nodes = node, nearest(node, node, curve.speed)
    for values in nodes:
        values.flags.writeable = False
    return nodes
