"""The search for the rays of one family that reach a distance, with the vertices in given layers or on the boundaries.

Between boundaries, X(q) of q = cot(grazing angle)/c_m rises and is concave: one root, Newton from below cannot
overshoot. With a turning point, X(v) of v = c_m tan(grazing angle) is a falling part (full layers) plus a rising one
(the layers that it turns in): `ray_chain.bounds` gives rigorous bounds of value and slope on any interval, so that
intervals are split until each is free of roots or monotone, and no root is missed or found twice.
"""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats
from sonarsynth.equations.rays.ray_chain import GRAZING, bounds, sweep

CLOSE = 1e-8  # relative miss of the range that one more Newton step removes
ENOUGH = 2e-17  # relative error of the travel time at which Newton stops: it is second order in what is left of X - R


@compiled(borrows=True)
def settled(misfit: float, distance: float, slope: float) -> bool:
    """Whether one more Newton step ends the search: X - R is small for the travel time, and for angle and amplitude."""
    return misfit * misfit <= ENOUGH * distance * slope and abs(misfit) <= CLOSE * distance


@compiled(borrows=True)
def refine(
    low: float,
    high: float,
    guess: float,
    rising: bool,
    fastest: float,
    distance: float,
    d: Floats,
    k: Floats,
    first: int,
    last: int,
    turn_up: float,
    turn_down: float,
) -> tuple[float, float]:
    """The root of X(v) = distance in a bracket, as (sine at the fastest depth, p): safeguarded Newton."""
    v = guess if low < guess < high else 0.5 * (low + high)
    for _ in range(200):
        p = 1.0 / math.sqrt(v * v + fastest * fastest)
        s_m = max(v * p, GRAZING)
        over_p, slope = sweep(s_m, p, d, k, first, last, turn_up, turn_down)
        misfit = p * over_p - distance
        if (misfit > 0.0) == rising:
            high = v
        else:
            low = v
        step = misfit / (slope * s_m * p * p)
        done = settled(misfit, distance, p * abs(slope))
        if low < v + step < high:
            v += step
        elif not done:
            v = 0.5 * (low + high)
        if done or high - low <= 4e-16 * high:
            break
    p = 1.0 / math.sqrt(v * v + fastest * fastest)
    return max(v * p, GRAZING), p


@compiled(borrows=True)
def flattest(d: Floats, k: Floats, first: int, last: int) -> float:
    """Range of the flattest ray through a chain: horizontal at its fastest depth."""
    return float(bounds(GRAZING, GRAZING, d, k, first, last, 0.0, 0.0)[0])


@compiled(borrows=True)
def straight(
    distance: float, fastest: float, d: Floats, k: Floats, first: int, last: int, reached: bool
) -> tuple[bool, float, float]:
    """The ray through a chain without a turning point: whether there is one, its sine s_m, its p.

    reached: the flattest ray is known to come so far.
    """
    total = reach = 0.0
    for i in range(first, last):
        total += k[i]
        reach += k[i] * (d[i] + d[i + 1])
    least = 2.0 * distance / total  # X(q) <= q total/2
    half_least = distance / total
    margin = 1.0 - half_least * half_least * reach / total  # one layer: q = least/margin; no ray where it is negative
    q, s_m, p = least, 0.0, 0.0
    if margin > 0.05:
        q = least / margin
        for _ in range(40):
            s_m = 1.0 / math.sqrt(1.0 + (q * fastest) ** 2)
            p = q * s_m
            over_p, slope = sweep(s_m, p, d, k, first, last, 0.0, 0.0)
            misfit = p * over_p - distance
            q = max(least, q - misfit / (slope * s_m * s_m * s_m))
            if s_m < 0.01 or settled(misfit, distance, p * slope):
                break
    if s_m < 0.01:  # near the limit, where the largest range of all decides whether there is a ray
        if not reached and flattest(d, k, first, last) < distance:
            return False, 0.0, 0.0
        s_m, p = refine(GRAZING, 2.0 / least, 1.0 / q, False, fastest, distance, d, k, first, last, 0.0, 0.0)
        return True, s_m, p
    s_m = 1.0 / math.sqrt(1.0 + (q * fastest) ** 2)
    return True, s_m, q * s_m


@compiled(borrows=True)
def first_guess(
    low: float, high: float, x_low: float, x_high: float, distance: float,
    d: Floats, first: int, last: int, turn_up: float, turn_down: float,
) -> float:  # fmt: skip
    """Where X(v) comes to the distance, on the chord; exactly where both ends lie in the layer of one turning point."""
    if last - first <= 1 and (turn_up == 0.0) != (turn_down == 0.0):
        near, far = (last, first) if turn_up == 0.0 else (first, last)
        total = distance / (turn_up + turn_down)
        guess = 0.5 * (total - (d[far] - d[near]) / total)
        if low < guess < high:
            return float(guess)
    return float(low + (high - low) * (distance - x_low) / (x_high - x_low))


@compiled(borrows=True)
def turns(
    below_start: bool,
    fastest: float,
    extent: float,
    distance: float,
    d: Floats,
    k: Floats,
    first: int,
    last: int,
    turn_up: float,
    turn_down: float,
    stack: Floats,
    roots: Floats,
) -> int:
    """Roots v in (0, extent] of X(v) = distance of a weighted chain, as roots[:, 0:2] = (s_m, p): their number.

    below_start: whether X(0) counts as smaller than the distance (carried over from the interval before, so that a
    root on the edge belongs to one side only).
    """
    if distance == 0.0:
        return 0  # a ray that turns goes somewhere
    stack[0] = extent
    pending = 1
    low, below, count = GRAZING, below_start, 0
    while pending > 0:
        high = stack[pending - 1]
        x_low, x_high, least, largest, slope_least, slope_largest = bounds(
            low, high, d, k, first, last, turn_up, turn_down
        )
        below_high = x_high < distance
        done = slope_least > 0.0 or slope_largest < 0.0
        if below == below_high:
            done = done or least > distance or largest < distance
        if done or pending == len(stack) or high - low <= 1e-14 * high:
            if below != below_high and count < len(roots):
                guess = first_guess(low, high, x_low, x_high, distance, d, first, last, turn_up, turn_down)
                roots[count, 0], roots[count, 1] = refine(
                    low, high, guess, below, fastest, distance, d, k, first, last, turn_up, turn_down
                )
                count += 1
            low, below = high, below_high
            pending -= 1
        else:
            stack[pending] = 0.5 * (low + high)
            pending += 1
    return count
