"""Local maxima of beams over elevation, azimuth and delay, and what an array hears beside its beams: compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled


@compiled
def medians(power: Any, first: int, stop: int, step: int) -> Any:
    """Medians (beam,) of every step-th delay of power (beam, delay), 0 or more, from the `first` on to before `stop`.

    The bits of such numbers are in their order: those of the median are found one by one, by how many are below it.
    """
    count = (stop - first + step - 1) // step
    half, line, middle = count // 2, np.empty(count, np.int32), np.empty(len(power), np.float32)
    both = np.empty(2, np.int32)
    for b in range(len(power)):
        bits = power[b, first:stop].view(np.int32)
        for i in range(count):
            line[i] = bits[i * step]
        value = np.int32(0)
        for bit in range(30, -1, -1):
            more, below = np.int32(value | (1 << bit)), np.int32(0)
            for i in range(count):
                below += np.int32(line[i] < more)
            value = more if below <= half else value
        below, before = np.int32(0), np.int32(0)  # before it, of an even number
        for i in range(count):
            below += np.int32(line[i] < value)
            before = max(before, line[i] if line[i] < value else np.int32(0))
        both[0], both[1] = value, before if count % 2 == 0 and below == half else value
        numbers = both.view(np.float32)
        middle[b] = np.float32(0.5) * (numbers[0] + numbers[1])
    return middle


@compiled
def exceeded(power: Any, index: Any, i: int, j: int, t: int, about: int) -> Any:
    """Whether the value of the beam at (i, j) and delay t has a neighbour that exceeds it, or equals it and comes
    before; neighbours: within one beam and `about` delays. Arrays as for `local_maxima`."""
    rows, columns = index.shape
    own = index[i, j]
    value = power[own, t]
    for k in range(max(i - 1, 0), min(i + 2, rows)):
        for m in range(max(j - 1, 0), min(j + 2, columns)):
            neighbour = index[k, m]
            if neighbour >= 0:
                for s in range(t - about, t + about + 1):
                    x = power[neighbour, s]
                    before = neighbour < own or (neighbour == own and s < t)
                    if x > value or (x == value and before):
                        return True
    return False


@compiled
def local_maxima(
    power: Any, index: Any, row: Any, column: Any, floor: Any, least: Any, edge: Any, about: int, runs: Any
) -> Any:
    """Beams and delays (peak,) of values over `floor` (beam,), of `least` (delay,) at least, that no neighbour exceeds.

    power (beam, delay); index (elevation, azimuth) the beam there, -1 for none; row, column (beam,) of each beam. None
    outside runs (run, 2) of delays, first and end, which are more than `about` from either end, none in a beam that
    lacks a neighbour, where a slope would pass for a peak, and none at the edge of an axis of which edge (2,) says that
    peaks are resolved: theirs may be outside.
    """
    (rows, columns), top = index.shape, np.zeros(power.shape[1] + 8 & -8, np.bool_)
    eights, most = top.view(np.uint64), power.shape[1] // (about + 1) + len(runs)  # more than `about` apart
    peaks, count = np.empty((2, len(power) * most), np.int32), 0
    for b in range(len(power)):
        i, j = row[b], column[b]
        if (edge[0] and (i == 0 or i == rows - 1)) or (edge[1] and (j == 0 or j == columns - 1)):
            continue
        if index[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2].min() < 0:
            continue
        port, starboard = power[index[i, max(j - 1, 0)]], power[index[i, min(j + 1, columns - 1)]]
        for first, last in runs:
            before, own, after = power[b, first - 1 : last - 1], power[b, first:last], power[b, first + 1 : last + 1]
            left, right, audible = port[first:last], starboard[first:last], least[first:last]
            for t in range(last - first):  # many at once: slices, and no branch
                loud = (own[t] > floor[b]) & (own[t] >= audible[t])
                top[t] = loud & (own[t] > before[t]) & (own[t] >= max(after[t], left[t], right[t]))
            top[last - first : last - first + 8] = False
            for eight in range((last - first + 7) // 8):
                for t in range(first + 8 * eight, first + 8 * eight + 8 if eights[eight] > 0 else 0):
                    if top[t - first] and not exceeded(power, index, i, j, t, about):
                        peaks[0, count], peaks[1, count] = b, t
                        count += 1
    return peaks[0, :count].astype(np.int64), peaks[1, :count].astype(np.int64)


@compiled
def beside(power: Any, index: Any, row: Any, column: Any, b: Any, t: Any) -> Any:
    """Power (axis, before or after, peak) next to peaks, whose own stands where there is no beam; arrays as for
    `power_centres`."""
    rows, columns = index.shape
    around = np.empty((3, 2, len(b)), power.dtype)
    for p in range(len(b)):
        own, i, j = b[p], row[b[p]], column[b[p]]
        for side in range(2):
            step = 2 * side - 1
            above, aside = index[min(max(i + step, 0), rows - 1), j], index[i, min(max(j + step, 0), columns - 1)]
            around[0, side, p] = power[above if above >= 0 else own, t[p]]
            around[1, side, p] = power[aside if aside >= 0 else own, t[p]]
            around[2, side, p] = power[own, t[p] + step]
    return around


@compiled
def farthest(position: Any) -> Any:
    """Largest distance (m) of positions (sensor, xyz) from the origin."""
    reach = 0.0
    for q in range(len(position)):
        reach = max(reach, np.sqrt(np.sum(position[q] ** 2)))
    return reach


@compiled(fastmath=True, forceinline=True)
def _lobe(x: Any, y: Any, z: Any, at: Any, across: Any, weight: Any, real: Any, imaginary: Any) -> Any:
    """Modulus of the sum over sensors of what a table (delay,) has at `at` and what positions (xyz, sensor) add, all
    float32."""
    a = b = np.float32(0.0)
    for q in range(weight.size):
        delay = across[0, q] * x + across[1, q] * y + across[2, q] * z + at
        n = np.int32(delay)
        fraction = delay - np.float32(n)
        a += weight[q] * (real[n] + fraction * (real[n + 1] - real[n]))
        b += weight[q] * (imaginary[n] + fraction * (imaginary[n + 1] - imaginary[n]))
    return np.sqrt(a * a + b * b)


@compiled
def over_lobes(
    direction: Any, delay: Any, power: Any, position: Any, weight: Any, near: float, lasting: float, least: Any,
    table: Any, rate: float,
) -> Any:  # fmt: skip
    """Whether `least` (peak,) is more than what louder peaks bring by the side lobes and grating lobes of the array.

    direction (peak, xyz) over the speed of sound, s/m; delay (peak,) s; power (peak,), descending; position (sensor,
    xyz) m; weight (sensor,) of sum one; near: two peaks within that (s/m) of each other are in one beam; lasting (s): a
    pulse brings nothing so much earlier or later. A wave from v is heard by a beam to u at the delay t as
    |sum_f T(f) sum_q w_q exp(i 2 pi f (x_q.(u - v) + t))|^2/(sum_f T)^2, of which table (2, delay) has real and
    imaginary part of sum_f T(f) exp(i 2 pi f t)/sum_f T at delays in steps of 1/rate, the middle at 0, linear between.
    """
    own, reach = np.zeros(len(power), np.bool_), farthest(position)
    across, sensor_weight = np.ascontiguousarray(position.T).astype(np.float32), weight.astype(np.float32)
    real, imaginary = table[0].astype(np.float32), table[1].astype(np.float32)
    middle = 0.5 * (table.shape[1] - 1)
    for i in range(len(power)):
        brought = 0.0
        for j in range(i if least[i] < np.inf else 0):
            x, y = direction[i, 0] - direction[j, 0], direction[i, 1] - direction[j, 1]
            z, late = direction[i, 2] - direction[j, 2], delay[i] - delay[j]
            far = np.sqrt(x * x + y * y + z * z)
            if far <= near or abs(late) > reach * far + lasting:
                continue
            x, y, z = np.float32(x * rate), np.float32(y * rate), np.float32(z * rate)
            size = _lobe(x, y, z, np.float32(late * rate + middle), across, sensor_weight, real, imaginary)
            brought += power[j] * size**2
            if brought >= least[i]:
                break
        own[i] = brought < least[i]
    return own


@compiled
def loudest_lines(spectra: Any, b: Any, turn: Any, width: int) -> Any:
    """Bins (peak,) about which the means over `width` bins of spectra (beam, bin) are largest, and these, squared.

    b (peak,): the beam of each; turn (peak,): turns that its spectrum is turned by from bin to bin, to its own delay.
    Beyond the ends there is nothing.
    """
    bins, line, power = spectra.shape[1], np.zeros(len(b), np.int64), np.full(len(b), -1.0)
    turned, before = np.zeros(bins + width, np.complex128), width // 2
    for p in range(len(b)):
        phasor, step, total = 1.0 + 0j, np.exp(2j * np.pi * turn[p]), 0j
        for k in range(bins + width - 1 - before):
            if k < bins:
                turned[k] = spectra[b[p], k] * phasor
                phasor *= step
            total += turned[k]
            if k >= width:
                total -= turned[k - width]
            loud = total.real**2 + total.imag**2
            centre = k + 1 - width + before  # of the bins that are summed
            if centre >= 0 and loud > power[p]:
                line[p], power[p] = centre, loud
    return line, power / width**2


@compiled
def loudest_between(power: Any, first: Any, last: Any) -> Any:
    """Where power (beam, delay) of each beam is largest from its `first` (beam,) delay to before `last`, and that."""
    late, loudest = np.empty(len(power), np.int64), np.empty(len(power))
    for b in range(len(power)):
        late[b] = first[b] + np.argmax(power[b, first[b] : last[b]])
        loudest[b] = power[b, late[b]]
    return late, loudest


@compiled(fastmath={"contract"}, forceinline=True)
def _add(power: Any, least: Any, share: Any, moment: Any, sums: Any, moments: Any) -> None:
    """Add power (delay,) where it is `least` or more, times share to sums (delay,) and times moment to moments."""
    for s in range(len(power)):
        loud = power[s] if power[s] >= least else np.float32(0.0)
        sums[s] += share * loud
        moments[s] += moment * loud


@compiled(fastmath={"contract"})
def power_centres(
    power: Any, index: Any, row: Any, column: Any, b: Any, t: Any, offset: Any, width: Any, about: float, least: Any
) -> Any:
    """Centre of the power about peaks, from their tops (peak, 3) in widths of an echo, under a Gaussian window.

    power, index, row, column: as for `local_maxima`; b, t (peak,) the cells of peaks, offset (peak, 3) their tops
    beside these in cells; width (3,): a cell in widths; about: standard deviation of the window in widths, cut at twice
    that; least (beam,): power below that is noise. Fast where peaks come by their delays: what is next is in the cache.
    """
    rows, columns = index.shape
    centre, share = np.zeros((len(b), 3)), np.empty((2, columns), np.float32)
    reach = [int(min(np.ceil(2.0 * about / max(width[x], 1e-9)), power.size)) for x in range(3)]
    steps = min(2 * reach[2] + 1, power.shape[1])
    line, sums = np.empty((2, steps), np.float32), np.empty((3, steps))
    for p in range(len(b)):
        (i0, j0), sums[:], total = (row[b[p]], column[b[p]]), 0.0, 0.0
        first, last = max(t[p] - reach[2], 0), min(t[p] + reach[2] + 1, power.shape[1])
        left, right = max(j0 - reach[1], 0), min(j0 + reach[1] + 1, columns)
        for j in range(left, right):
            aside = (j - j0 - offset[p, 1]) * width[1]
            share[0, j] = np.exp(-0.5 * (aside / about) ** 2)
            share[1, j] = share[0, j] * aside
        for i in range(max(i0 - reach[0], 0), min(i0 + reach[0] + 1, rows)):
            line[:] = 0.0
            for j in range(left, right):
                beam = index[i, j]
                if beam >= 0:
                    heard = power[beam, first:last]
                    _add(heard, np.float32(least[beam]), share[0, j], share[1, j], line[0], line[1])
            up = (i - i0 - offset[p, 0]) * width[0]
            fade = np.exp(-0.5 * (up / about) ** 2)
            for s in range(last - first):
                sums[0, s] += fade * line[0, s]
                sums[1, s] += fade * up * line[0, s]
                sums[2, s] += fade * line[1, s]
        for s in range(last - first):
            late = (first + s - t[p] - offset[p, 2]) * width[2]
            fade = np.exp(-0.5 * (late / about) ** 2)
            total += fade * sums[0, s]
            centre[p, 0] += fade * sums[1, s]
            centre[p, 1] += fade * sums[2, s]
            centre[p, 2] += fade * late * sums[0, s]
        centre[p] /= total
    return centre
