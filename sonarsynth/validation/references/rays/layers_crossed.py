"""What a ray crosses between two levels of layered water: horizontal distance, travel time and their change with the
ray, in the closed forms of `layered_rays`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Bools, Floats

EQUAL = 1e-13
"""Relative: speeds closer than this are one level's."""


@dataclass(frozen=True, eq=False)
class Crossed:
    """Pieces of layers that rays cross; sigma (ray,): sine at the fastest level, below 0 of rays that turn beyond."""

    speed: tuple[Floats, Floats]  # (ray, piece) m/s at the upper and the lower side of each piece
    thick: Floats  # (ray, piece) m
    ends: tuple[Floats, Floats]  # (ray,) m/s at start and end
    fastest: Floats  # (ray,) m/s
    narrow: Bools  # (ray,) whether the fastest level is an end
    beyond: Floats  # (ray,) 1/s: how fast the speed grows on beyond that end; 0 where no ray turns there
    node: Floats  # (ray,) m/s up to which it does
    of_start: Bools  # (ray,) whether that end is the start
    down: Floats  # (ray,) 1 where the end is below the start, in the unfolded water, else -1
    rise: Floats  # (ray,) m between the ends

    def lowest(self) -> Floats:
        """The least sigma (ray,)."""
        return np.where(self.beyond > 0.0, -np.sqrt(np.maximum(1.0 - (self.fastest / self.node) ** 2, 0.0)), 0.0)

    def cosine(self, sigma: Floats) -> Floats:
        """p (ray,) in s/m."""
        return np.sqrt((1.0 - sigma) * (1.0 + sigma)) / self.fastest

    def _sine(self, sigma: Floats, speed: Floats) -> Floats:
        """Sine where the speed is `speed` (ray, ...)."""
        shape = (-1,) + (1,) * (speed.ndim - 1)
        a, c = sigma.reshape(shape), self.fastest.reshape(shape)
        return np.sqrt(np.maximum(a * a + (1.0 - a * a) * (c - speed) * (c + speed) / (c * c), 0.0))

    def sines(self, sigma: Floats) -> tuple[Floats, Floats]:
        """Sines (ray,) at start and end, positive."""
        first, last = (self._sine(sigma, c) for c in self.ends)
        return first, last

    def signed(self, sigma: Floats, first: Floats, last: Floats) -> tuple[Floats, Floats]:
        """Sines (ray,) at start and end, down positive in the unfolded water."""
        turns = sigma < 0.0
        start = np.where(turns & self.of_start, -first, first)
        return self.down * start, self.down * np.where(turns & ~self.of_start, -last, last)

    def _across(self, sigma: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance (ray, piece) over each piece, and both sines there."""
        upper, lower = (self._sine(sigma, c) for c in self.speed)
        both = upper + lower
        x = self.cosine(sigma)[:, None] * sum(self.speed) * self.thick / np.where(both > 0.0, both, 1.0)
        return x, upper, lower

    def distance(self, sigma: Floats) -> tuple[Floats, Floats]:
        """Horizontal distance X (ray,) and dX/dsigma (ray,)."""
        a, p = np.abs(sigma), np.maximum(self.cosine(sigma), 1e-300)
        x, upper, lower = self._across(sigma)
        change = -a / (p * self.fastest**2)  # dp/da
        tilt = np.zeros_like(x)
        for c, s in zip(self.speed, (upper, lower), strict=True):
            square = (c / self.fastest[:, None]) ** 2
            tilt += np.where(s > 0.0, square * a[:, None] / np.where(s > 0.0, s, 1.0), 1.0)  # ds/da
        both = upper + lower
        slope = (x * ((change / p)[:, None] - tilt / np.where(both > 0.0, both, 1.0))).sum(axis=1)
        turn = (sigma < 0.0) & (self.beyond > 0.0)
        g = np.where(turn, self.beyond, 1.0)
        back = np.where(turn, 2.0 * a / (p * g), 0.0)
        more = np.where(turn, 2.0 / (p * g) - back * change / p, 0.0)
        return x.sum(axis=1) + back, np.where(sigma < 0.0, -(slope + more), slope)

    def time(self, sigma: Floats) -> Floats:
        """Travel time (ray,) in s."""
        x, _, _ = self._across(sigma)
        chord, middle = np.hypot(x, self.thick), np.sqrt(self.speed[0] * self.speed[1])
        safe = np.where(self.thick > 0.0, self.thick, 1.0)
        bend = np.where(self.thick > 0.0, (self.speed[1] - self.speed[0]) / safe, 0.0) * chord / (2.0 * middle)
        small = np.abs(bend) < 1e-3
        ratio = np.where(small, 1.0 - bend**2 / 6.0 + 3.0 * bend**4 / 40.0, 1.0)
        ratio = np.where(small, ratio, np.arcsinh(bend) / np.where(small, 1.0, bend))
        turn = (sigma < 0.0) & (self.beyond > 0.0)
        back = np.arcsinh(np.abs(sigma) / np.maximum(self.cosine(sigma) * self.fastest, 1e-300))
        beyond = np.where(turn, 2.0 * back / np.where(turn, self.beyond, 1.0), 0.0)
        return np.asarray((chord / middle * ratio).sum(axis=1) + beyond)

    def length(self, sigma: Floats) -> Floats:
        """Length (ray,) in m, of chords."""
        x, _, _ = self._across(sigma)
        a, p = np.abs(sigma), np.maximum(self.cosine(sigma), 1e-300)
        turn = (sigma < 0.0) & (self.beyond > 0.0)
        back = np.where(turn, 2.0 * a / (p * np.where(turn, self.beyond, 1.0)), 0)
        return np.asarray(np.hypot(x, self.thick).sum(axis=1) + back)


def crossed(water: Water, first: Floats, last: Floats) -> Crossed:
    """Pieces between unfolded depths (ray,)."""
    low, high = np.minimum(first, last), np.maximum(first, last)
    copies = range(int(np.floor(low.min() / water.bottom)) - 1, int(np.floor(high.max() / water.bottom)) + 2)
    level, speed = water.unfolded(copies)
    thick = np.diff(level)
    slope = np.where(thick > 0.0, np.diff(speed) / np.where(thick > 0.0, thick, 1.0), 0.0)
    layers = np.flatnonzero((thick > 0.0) & (level[1:] > low.min()) & (level[:-1] < high.max()))
    top, under = (np.clip(level[None, layers + n], low[:, None], high[:, None]) for n in (0, 1))
    c_top, c_under = (speed[layers] + slope[layers] * (z - level[layers]) for z in (top, under))
    in_it = under > top
    c_low, c_high = (np.interp(z, level, speed) for z in (low, high))
    inner = np.where(in_it, np.maximum(c_top, c_under), 0.0).max(axis=1, initial=0.0)
    fastest = np.maximum(inner, np.maximum(c_low, c_high))
    # what lies just beyond either end
    above = np.clip(np.searchsorted(level, low, side="left") - 1, 0, len(slope) - 1)
    below = np.clip(np.searchsorted(level, high, side="right") - 1, 0, len(slope) - 1)
    up = np.where(c_low >= fastest * (1.0 - EQUAL), np.maximum(-slope[above], 0.0), 0.0)
    on = np.where(c_high >= fastest * (1.0 - EQUAL), np.maximum(slope[below], 0.0), 0.0)
    at_low = up >= on
    down = np.where(last >= first, 1.0, -1.0)
    return Crossed(
        speed=(np.where(in_it, c_top, fastest[:, None]), np.where(in_it, c_under, fastest[:, None])),
        thick=under - top,
        ends=(np.where(down > 0, c_low, c_high), np.where(down > 0, c_high, c_low)),
        fastest=fastest,
        narrow=np.maximum(c_low, c_high) >= fastest * (1.0 - EQUAL),
        beyond=np.maximum(up, on),
        node=np.where(at_low, speed[above], speed[below + 1]),
        of_start=at_low == (down > 0),
        down=down,
        rise=high - low,
    )


@dataclass(frozen=True, eq=False)
class Water:
    """Speed (m/s) at node depths (m), linear between, constant beyond, from the surface to the bottom (m)."""

    depth: Floats
    speed: Floats
    bottom: float

    def at(self, depth: Floats) -> Floats:
        """Sound speed at depths."""
        return np.interp(depth, self.depth, self.speed)

    def unfolded(self, copies: range) -> tuple[Floats, Floats]:
        """Levels and speeds of the water and of so many of its images; copy 0 is the water, -1 is above it."""
        inside = (self.depth > 0.0) & (self.depth < self.bottom)
        z = np.concatenate([[0.0], self.depth[inside], [self.bottom]])
        c = np.interp(z, self.depth, self.speed)
        level = [k * self.bottom + (z if k % 2 == 0 else (self.bottom - z)[::-1]) for k in copies]
        return np.concatenate(level), np.concatenate([c if k % 2 == 0 else c[::-1] for k in copies])
