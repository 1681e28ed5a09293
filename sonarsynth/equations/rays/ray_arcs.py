"""A ray followed arc by arc through layered water: circular arcs, exact within a layer, one layer a step.

Angles phi are positive downwards, depths too. A ray keeps p = cos(phi)/c from one reflection to the next; in a layer
of gradient g it bends by -p g a metre, so that an arc of length s is a chord s sinc(p g s/2) at the mean angle:
nothing divides by g.
"""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import node_above
from sonarsynth.equations.rays.ray_in_layer import atanc, chord_time

ON, TURN, SURFACE, BOTTOM, OVER = range(5)
"""Why a step ended: step length or layer boundary, turning point, surface, bottom, time over."""


@compiled(borrows=True)
def arc(phi: float, bend: float, s: float) -> tuple[float, float, float]:
    """Horizontal and downward displacement (m) along an arc of length s, and the angle at its end; bend: p g (1/m)."""
    half = 0.5 * bend * s
    chord = s * (math.sin(half) / half if abs(half) > 1e-8 else 1.0)
    return chord * math.cos(phi - half), chord * math.sin(phi - half), phi - 2.0 * half


@compiled(borrows=True)
def heading(depth: Floats, speed: Floats, layer: int, z: float, phi: float) -> tuple[int, float]:
    """Layer and sense (1 down, -1 up, 0 level for good) of a ray about to leave z; a level ray goes where it bends."""
    if phi != 0.0:
        return layer, math.copysign(1.0, phi)
    rise = speed[layer + 1] - speed[layer]
    if rise > 0.0 and z <= depth[layer]:
        if layer > 0 and speed[layer] > speed[layer - 1]:
            return layer - 1, -1.0
        return layer, 0.0
    if rise < 0.0 and z >= depth[layer + 1]:
        if layer < len(depth) - 2 and speed[layer + 2] < speed[layer + 1]:
            return layer + 1, 1.0
        return layer, 0.0
    return layer, -1.0 if rise > 0.0 else (1.0 if rise < 0.0 else 0.0)


@compiled(borrows=True)
def across(depth: Floats, layer: int, sense: float) -> tuple[int, int]:
    """Next layer beyond the boundary reached, and what the boundary is."""
    if sense < 0.0:
        return (layer - 1, ON) if layer > 0 else (0, SURFACE)
    return (layer + 1, ON) if layer < len(depth) - 2 else (layer, BOTTOM)


@compiled(borrows=True)
def length_to_edge(sine: float, p: float, c: float, c_edge: float, dz: float) -> tuple[float, float]:
    """Arc length to the edge of the layer `dz` (m) away, and the sine there; NaN where the ray turns before it."""
    square = sine * sine - p * p * (c_edge - c) * (c_edge + c)
    if square < 0.0:
        return math.nan, math.nan
    total = sine + math.sqrt(square)
    return 2.0 * dz / total * atanc(p * (c_edge - c) / total) if dz > 0.0 else 0.0, math.sqrt(square)


@compiled(borrows=True)
def along_arc(phi: float, bend: float, s: float, c: float, gradient: float) -> tuple[float, float, float, float]:
    """Time (s), displacements and angle at the end of an arc that begins where the speed is c."""
    dx, dz, turned = arc(phi, bend, s)
    c_after = max(c + gradient * dz, 1e-3 * c)
    return chord_time(math.hypot(dx, dz), c, c_after, gradient), dx, dz, turned


@compiled(borrows=True)
def step(
    depth: Floats,
    speed: Floats,
    layer: int,
    z: float,
    phi: float,
    p: float,
    limit: float,
    sagitta: float,
    time_left: float,
) -> tuple[int, int, float, float, float, float, float]:
    """One arc within one layer: (why it ended, layer, dx, z, phi, length, time) after it.

    It ends at the layer's boundary, at a turning point, after `limit` (m), where its chord would leave it by more than
    `sagitta` (m), or when time (s) is over. Surface and bottom are reached, not reflected from. A jump is crossed, or
    turned back from, in a step of no length.
    """
    layer, sense = heading(depth, speed, layer, z, phi)
    edge = layer + 1 if sense > 0.0 else layer
    thickness, difference = depth[layer + 1] - depth[layer], speed[layer + 1] - speed[layer]
    if thickness == 0.0:
        square = 1.0 - (p * speed[edge]) ** 2
        if square <= 0.0:
            return TURN, layer - int(sense), 0.0, z, -phi, 0.0, 0.0
        layer, why = across(depth, layer, sense)
        return why, layer, 0.0, z, sense * math.atan2(math.sqrt(square), p * speed[edge]), 0.0, 0.0
    gradient = difference / thickness
    c = speed[layer] + difference * ((z - depth[layer]) / thickness)
    bend = p * gradient if sense != 0.0 else 0.0
    s = min(limit, math.sqrt(8.0 * sagitta / abs(bend))) if bend != 0.0 else limit
    why, after, z_after, phi_after = ON, layer, math.nan, math.nan
    if sense != 0.0:
        to_depth = abs(depth[edge] - z)
        to_edge, sine = length_to_edge(abs(math.sin(phi)), p, c, speed[edge], to_depth)
        if to_edge <= s:
            s, z_after, phi_after = to_edge, depth[edge], sense * math.atan2(sine, p * speed[edge])
            after, why = across(depth, layer, sense)
        elif math.isnan(to_edge) and abs(phi / bend) <= s:
            s, why, phi_after = abs(phi / bend), TURN, 0.0
            z_after = z + sense * math.sin(phi) ** 2 / (p * (1.0 + p * c)) / abs(gradient)
    time, dx, dz, turned = along_arc(phi, bend, s, c, gradient)
    if time > time_left:
        s *= time_left / time
        for _ in range(6):  # Newton: dt = ds/c
            time, dx, dz, turned = along_arc(phi, bend, s, c, gradient)
            s += (time_left - time) * (c + gradient * dz)
        time, dx, dz, turned = along_arc(phi, bend, s, c, gradient)
        return OVER, layer, dx, z + dz, turned, s, time_left
    if math.isnan(z_after):
        z_after, phi_after = z + dz, turned
    return why, after, dx, z_after, phi_after, s, time


@compiled(borrows=True)
def steps(
    depth: Floats,
    speed: Floats,
    layer: Ints,
    z: Floats,
    phi: Floats,
    p: Floats,
    limit: Floats,
    sagitta: float,
    time_left: Floats,
    why: Ints,
    dx: Floats,
    length: Floats,
    time: Floats,
) -> None:
    """One step of each ray; layer, z and phi are moved on, the rest is written."""
    for i in range(len(z)):
        why[i], layer[i], dx[i], z[i], phi[i], length[i], time[i] = step(
            depth, speed, layer[i], z[i], phi[i], p[i], limit[i], sagitta, time_left[i]
        )


@compiled(borrows=True)
def chords(
    depth: Floats, speed: Floats, z: Floats, phi: Floats, p: Floats, length: Floats, sagitta: float, nodes: Floats
) -> int:
    """Nodes (node, 3) of polylines that keep within `sagitta` (m) of rays of some lengths: ray, distance and depth.

    Rays leave depths z at angles phi and are reflected from surface and bottom, where they have a node. Layers are
    passed without one where the bend is small: a curve of length s whose direction varies by b keeps within s b/4 of
    its chord. Returns the number of nodes, or -1 where there is no room for them.
    """
    count = 0
    for i in range(len(z)):
        layer, x, at, angle, ahead = min(node_above(depth, z[i]), len(depth) - 2), 0.0, z[i], phi[i], length[i]
        run, low, high = 0.0, angle, angle
        if count == len(nodes):
            return -1
        nodes[count, 0], nodes[count, 1], nodes[count, 2] = i, x, at
        count += 1
        for _ in range(1_000_000):
            if not ahead > 0.0:
                break
            was_x, was_z, was_angle, was_run = x, at, angle, run
            why, layer, dx, at, angle, done, _ = step(depth, speed, layer, at, angle, p[i], ahead, sagitta, math.inf)
            x, ahead, run = x + dx, ahead - done, run + done
            low, high = min(low, angle), max(high, angle)
            bounced = why in (SURFACE, BOTTOM)
            add_node = run * (high - low) > 4.0 * sagitta and was_run > 0.0
            if count + 2 > len(nodes):
                return -1
            if add_node:  # the chord would be too long: a node before this arc
                nodes[count, 0], nodes[count, 1], nodes[count, 2] = i, was_x, was_z
                count += 1
                run, low, high = done, min(was_angle, angle), max(was_angle, angle)
            if bounced:
                nodes[count, 0], nodes[count, 1], nodes[count, 2] = i, x, at
                count += 1
                angle = -angle
                run, low, high = 0.0, angle, angle
        if count == len(nodes):
            return -1
        nodes[count, 0], nodes[count, 1], nodes[count, 2] = i, x, at
        count += 1
    return count
