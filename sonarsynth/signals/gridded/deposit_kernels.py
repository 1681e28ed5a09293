"""Compiled loops of the kernel deposit. One thread, fixed order: the same bits on any number of workers.

Arrays are flat with constant offsets and loop bodies are straight lines, because the compiler vectorises only those.
Functions that others call are inlined always: of a function that is not, each caller has a copy, which fast mathematics
gives other bits, and which of them runs depends on what was compiled in this process and what was loaded.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.vectors import add_scaled, cubics

BLOCK = 128
"""Paths in a block of the packed table."""

ROWS = 7
"""Rows of the packed table: direction x, y, z; curvature; position (samples); amplitude; absorption (scaled
deviation). Weights of the modes may follow, then those of what they change by."""


@compiled(fastmath=True, forceinline=True, borrows=True)
def _wavefront(
    block: Any, node: Any, middle: Any, scale: Any, absorbed: Any, rate: float, steer: float, level: float, late: Any,
    position: Any, value: Any,
) -> None:  # fmt: skip
    """Positions (samples) of a block of paths at a node, and rows of value: deviations in y, z and absorption, -,
    amplitude."""
    qx, qy, qz = node[0], node[1], node[2]
    qq = qx * qx + qy * qy + qz * qz
    uy, uz, sy, sz = middle[0], middle[1], scale[0], scale[1]
    nepers, scaled, louder = absorbed[0], absorbed[1], 1.0 / level
    for i in range(BLOCK):
        dx, dy, dz, k = block[i], block[BLOCK + i], block[2 * BLOCK + i], block[3 * BLOCK + i]
        vx, vy, vz = dx - k * qx, dy - k * qy, dz - k * qz
        n = np.sqrt(vx * vx + vy * vy + vz * vz)
        near = 1.0 / n
        away = (k * qq - 2.0 * (qx * dx + qy * dy + qz * dz)) / (n + 1.0) * rate + (late[i] - steer)
        lost = nepers * away
        position[i] = block[4 * BLOCK + i] + away
        value[i] = (vy * near - uy) * sy
        value[BLOCK + i] = (vz * near - uz) * sz
        value[2 * BLOCK + i] = block[6 * BLOCK + i] + scaled * away
        gain = louder - louder * lost * (1.0 - lost * (0.5 - lost * (1.0 / 6.0)))
        value[4 * BLOCK + i] = block[5 * BLOCK + i] * near * gain


@compiled(fastmath=True, forceinline=True, borrows=True)
def _multiply(a: Any, b: Any, out: Any) -> None:
    for i in range(BLOCK):
        out[i] = a[i] * b[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _copy(row: Any, out: Any) -> None:
    for i in range(row.size):
        out[i] = row[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _amplify(out: Any, more: Any) -> None:
    for i in range(more.size):
        out[i] *= 1.0 + more[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _lean(out: Any, more: Any, scale: float) -> None:
    for i in range(more.size):
        out[i] += scale * more[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _recur(out: Any, earlier: Any) -> None:
    for i in range(BLOCK):
        out[i] = 2.0 * out[i] - earlier[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _mix(weight: Any, share: Any, node: int, first: int, size: int, modes: int, out: Any) -> None:
    """Weights of modes (mode * BLOCK,) at a node: of the pulses, and of what they change by, (change * mode * BLOCK,),
    in shares (change, node, path)."""
    for s in range(share.shape[0]):
        factor = share[s, node, first : first + size]
        for k in range(modes):
            row = weight[(s * modes + k) * BLOCK : (s * modes + k) * BLOCK + size]
            mixed = out[k * BLOCK : k * BLOCK + size]
            if s == 0:
                for i in range(size):
                    mixed[i] = factor[i] * row[i]
            else:
                for i in range(size):
                    mixed[i] += factor[i] * row[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _expand(value: Any, weight: Any, term_products: Any, modes: bool) -> None:
    """Terms of a block of paths, from row 4 of value on; there is the amplitude, which with modes moves to row 3."""
    if modes:
        _copy(value[4 * BLOCK : 5 * BLOCK], value[3 * BLOCK : 4 * BLOCK])
    for t in range(0 if modes else 1, term_products.shape[0]):
        a, b, c = (4 + term_products[t, 0]) * BLOCK, term_products[t, 1] * BLOCK, (4 + t) * BLOCK
        if term_products[t, 1] < 3:
            _multiply(value[a : a + BLOCK], value[b : b + BLOCK], value[c : c + BLOCK])
        else:
            _multiply(value[a : a + BLOCK], weight[b - 3 * BLOCK :], value[c : c + BLOCK])
        if term_products[t, 2] >= 0:
            d = (4 + term_products[t, 2]) * BLOCK
            _recur(value[c : c + BLOCK], value[d : d + BLOCK])


@compiled(fastmath=True, forceinline=True, borrows=True)
def _split(position: Any, half: float, rows: int, length: int, begin: Any, row: Any, fraction: Any) -> None:
    """First sample of the kernel on the circle, row of its table, and place in the row, from -1/2 to 1/2."""
    for i in range(BLOCK):
        before = np.floor(position[i] - half)
        x = (before + 1.0 - (position[i] - half)) * rows
        r = min(np.floor(x), rows - 1.0)
        first = before + 1.0
        begin[i] = int(first - np.floor(first / length) * length)
        row[i] = int(r)
        fraction[i] = x - r - 0.5


@compiled(fastmath=True, borrows=True)
def deposit(
    table: Any,
    rows: int,
    count: int,
    nodes: Any,
    steer: Any,
    level: Any,
    middle: Any,
    scale: Any,
    absorbed: Any,
    late: Any,
    louder: Any,
    lean: Any,
    share: Any,
    term_products: Any,
    taps: Any,
    half: float,
    lanes: int,
    rate: float,
    length: int,
    grid: Any,
    place: Any,
    index: Any,
    work: Any,
) -> None:
    """Add the kernel of every path at every node, times every term, to grid (node * term * (length + lanes),).

    table: `count` paths in blocks (block * rows * BLOCK,), float64. nodes (node, xyz) in m. Of the tile's middle at the
    nodes, taken off: steer (node,) its delay in samples, level (node,) its gain, middle (node, 2) its direction y, z.
    scale (2,) is one over the deviation of y and z; absorbed (2,) what a sample more of the way takes, in Np and in
    deviations of absorption. late (samples) and louder (node, path) and lean (node, y or z, path) are the wavefront's
    terms, or empty; share (change, node, path) is how much the modes are of each change, or empty. term_products (term,
    3) makes terms. taps (row * 4 * lane,) is the kernel, a cubic a row, and half its half width in samples. rate is in
    samples/m; the grid is a circle of `length` samples. place and index (2, BLOCK) and work ((5 + terms
    + rows) * BLOCK,), of the type of the grid, are zeros to work in.
    """
    terms, stride = term_products.shape[0], length + lanes
    cubes = taps.size // (4 * lanes)
    position, more, begin, row = place[0], place[1], index[0], index[1]
    fraction, value, mixed = work[:BLOCK], work[BLOCK : (5 + terms) * BLOCK], work[(5 + terms) * BLOCK :]
    modes = (rows - ROWS) // max(share.shape[0], 1)
    for m in range(nodes.shape[0]):
        for first in range(0, count, BLOCK):
            size = min(BLOCK, count - first)
            block = table[first * rows : (first + BLOCK) * rows]
            if late.size:
                _copy(late[m, first : first + size], more)
            _wavefront(block, nodes[m], middle[m], scale, absorbed, rate, steer[m], level[m], more, position, value)
            if lean.size:
                _lean(value, lean[m, 0, first : first + size], scale[0])
                _lean(value[BLOCK:], lean[m, 1, first : first + size], scale[1])
            if louder.size:
                _amplify(value[4 * BLOCK :], louder[m, first : first + size])
            if share.size:
                _mix(block[ROWS * BLOCK :], share, m, first, size, modes, mixed)
                _expand(value, mixed, term_products, True)
            else:
                _expand(value, block[ROWS * BLOCK :], term_products, rows > ROWS)
            _split(position, half, cubes, length, begin, row, fraction)
            for i in range(size):
                for lane in range(0, lanes, 8):
                    w: Any = cubics(taps, row[i] * 4 * lanes + lane, lanes, fraction[i])  # type: ignore[call-arg]
                    to, number = m * terms * stride + begin[i] + lane, np.uint64(4 * BLOCK + i)
                    for _ in range(terms):
                        add_scaled(grid, to, value[number], w)
                        to, number = to + stride, number + np.uint64(BLOCK)
    for line in range(nodes.shape[0] * terms):  # close the circle
        for i in range(lanes):
            grid[line * stride + i] += grid[line * stride + length + i]


@compiled(fastmath=True)
def combine(spectra: Any, first: int, factors: Any, pair: Any, power: Any, response: Any, mode: Any, out: Any) -> None:
    """Sum over terms of spectra (node, term, bin) times real factors (node, pair of term, bin) and power (term, bin).

    Times response (mode, bin) of the mode of each term (term,), added to out (node, bin). Bins of spectra and out count
    from `first`.
    """
    bins = response.shape[1]
    re, im = np.empty(bins, factors.dtype), np.empty(bins, factors.dtype)
    for m in range(out.shape[0]):
        for k in range(response.shape[0]):
            re[:], im[:] = 0.0, 0.0
            for t in range(power.shape[0]):
                if mode[t] == k:
                    for b in range(bins):
                        factor = factors[m, pair[t], b] * power[t, b]
                        re[b] += spectra[m, t, first + b].real * factor
                        im[b] += spectra[m, t, first + b].imag * factor
            for b in range(bins):
                out[m, first + b] += complex(re[b], im[b]) * response[k, b]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _sum_five(weight: Any, nodes: Any, first: int, parity: int, out: Any) -> None:
    """Put weight (node,), of zeros beyond the last, times five nodes (node, parity, sample) in out, or add it there
    from the second five on."""
    last = nodes.shape[0] - 1
    a, b, c = nodes[first, parity], nodes[min(first + 1, last), parity], nodes[min(first + 2, last), parity]
    d, e = nodes[min(first + 3, last), parity], nodes[min(first + 4, last), parity]
    s, t, u, v, w = weight[first], weight[first + 1], weight[first + 2], weight[first + 3], weight[first + 4]
    if first == 0:
        for i in range(out.size):
            out[i] = s * a[i] + t * b[i] + u * c[i] + v * d[i] + w * e[i]
    else:
        for i in range(out.size):
            out[i] += s * a[i] + t * b[i] + u * c[i] + v * d[i] + w * e[i]


@compiled(fastmath=True, forceinline=True, borrows=True)
def _add_filtered(one: Any, two: Any, taps: Any, factor: Any, out: Any) -> None:
    """Add to out waves that take turns to be its samples, filtered by eight taps."""
    a, b, c, d = factor * taps[0], factor * taps[2], factor * taps[4], factor * taps[6]
    e, f, g, h = factor * taps[1], factor * taps[3], factor * taps[5], factor * taps[7]
    for i in range(out.size):
        earlier = a * one[i] + b * one[i + 1] + c * one[i + 2] + d * one[i + 3]
        out[i] += earlier + (e * two[i] + f * two[i + 1] + g * two[i + 2] + h * two[i + 3])


@compiled(fastmath=True)
def hear(
    field: Any, column: Any, weight: Any, late: Any, gain: Any, taps: Any, lanes: int, begin: int, out: Any
) -> None:
    """Add the field at each hydrophone, delayed and amplified, to out (sensor, sample); it begins at sample `begin`,
    which may be negative, and is silent at its ends.

    The field at sensor s is sum_n weight[s, n] field[column[s], n]; field (column, node, parity, sample) has twice the
    sampling rate, even samples and odd ones. late (sensor,) is in samples of it, which are interpolated with the kernel
    of `deposit`, taps (row * 4 * lane,), as wide as it has lanes.
    """
    samples, cubes, number = field.shape[3], taps.size // (4 * lanes), taps.dtype.type
    wave = np.zeros((2, samples + 2 * lanes), field.dtype)  # between zeros
    share = np.zeros(weight.shape[1] + 4, weight.dtype)
    for q in range(out.shape[0]):
        if gain[q] == 0.0:
            continue
        share[: weight.shape[1]] = weight[q]
        for parity in range(2):
            for n in range(0, weight.shape[1], 5):
                _sum_five(share, field[column[q]], n, parity, wave[parity, lanes : lanes + samples])
        whole = np.floor(0.5 * late[q])
        low = 2.0 * whole - late[q] - 0.5 * lanes
        first = np.floor(low) + 1.0
        cube, factor = min(np.floor((first - low) * cubes), cubes - 1.0), number(gain[q])
        x = (first - low) * cubes - cube - 0.5
        start = begin + int(whole)
        row = out[q, max(start, 0) : max(start + samples, 0)]
        for lane in range(0, lanes, 8):
            t: Any = cubics(taps, int(cube) * 4 * lanes + lane, lanes, number(x))  # type: ignore[call-arg]
            sample, skipped = int(first) + lane, lanes + max(-start, 0)
            one = wave[sample & 1, skipped + (sample >> 1) :]
            two = wave[(sample + 1) & 1, skipped + ((sample + 1) >> 1) :]
            _add_filtered(one, two, t, factor, row)
