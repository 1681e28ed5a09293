"""REMUS-100: a Myring hull with four fins, from published dimensions.

Prestero (2001), "Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater vehicle",
MIT: hull, table 2.1; fins, section 2.3, figure 2-3, tables 2.2 and A.2. What is taken, and why:

- Fin height above the centreline: 13.1 cm, as drawn in figure 2-3. Table 2.2 prints 5.14 "m": 13.1 cm in inches.
- Planform: area 66.5 cm2, span 8.57 cm and taper 0.654 of table 2.2 give chords of 9.38 cm at the root and 6.14 cm at
  the tip, mean 7.76 cm. (The table's mean chord of 7.47 cm does not fit its own area and span, by 4 %.)
- Place: mid-chord at 0.648 m aft of the centre of buoyancy, the middle of the fin section of table A.2 (-0.685 to
  -0.611 m); that centre is 0.611 m aft of the nose (table 2.4). Both edges are swept alike (not published).
- Section NACA 0012 (Abbott and von Doenhoff 1959, section 6.4), with the last coefficient that closes its end.
- Each fin is a closed body of its own that goes on into the hull with the root's chord. What lies inside the hull is
  neither lit nor seen, but counts in the area and volume of the mesh. Sonar transducer and propeller are left out.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry.surfaces import Surface, join, longest_edge, require_possible, weld
from sonarsynth.targets.generated.myring import hull_length, hull_meridian
from sonarsynth.targets.generated.revolution import Arc, revolve, rings
from sonarsynth.targets.shapes import Myring, Remus100

HULL: Final = Myring(
    nose=0.191,
    middle=0.654,
    tail=0.541,
    diameter=0.191,
    exponent=2.0,
    tail_angle=0.436,
    nose_offset=0.0165,
    tail_offset=0.0368,
)
FIN_AREA: Final = 6.65e-3  # m2, one fin outside the hull
FIN_SPAN: Final = 8.57e-2  # m
FIN_TAPER: Final = 0.654  # tip chord over root chord
FIN_HEIGHT: Final = 0.131  # m, of the tip above the centreline
FIN_FOOT: Final = 0.015  # m above the centreline: inside the hull (its radius is 2.7 cm at the root's trailing edge)
FIN_STATION: Final = 0.611 + 0.648  # m aft of the nose, mid-chord
ROOT_CHORD: Final = 2.0 * FIN_AREA / (FIN_SPAN * (1.0 + FIN_TAPER))
THICKNESS: Final = 0.12  # of the chord
ROLLS: Final = (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi)  # up, starboard, down, port


def remus100(shape: Remus100, edge: float, sagitta: float) -> tuple[Surface, tuple[Surface, ...]]:
    """The hull from nose to tail, and the fins up, starboard, down, port (none where the shape has none).

    edge, sagitta (m) as in `generation.generate`; a coarse shape is always the same.
    """
    finest = min(shape.edge, edge)
    hull = _coarse_hull() if shape.coarse else revolve(hull_meridian(HULL), finest, sagitta)
    fin = _coarse_fin() if shape.coarse else _fin(finest, sagitta)
    return hull, tuple(_rolled(fin, roll) for roll in ROLLS) if shape.fins else ()


def naca0012(chordwise: Floats) -> Floats:
    """Half thickness over chord at distances from the leading edge over chord; 0 at both ends."""
    x = chordwise
    half = 0.2969 * np.sqrt(x) + x * (-0.1260 + x * (-0.3516 + x * (0.2843 - 0.1036 * x)))
    return np.asarray(5.0 * THICKNESS * half)


def _chord(height: Floats) -> Floats:
    """Chord (m) at a height above the centreline: tapered outside the root, constant inside."""
    out = np.clip((height - (FIN_HEIGHT - FIN_SPAN)) / FIN_SPAN, 0.0, 1.0)
    return np.asarray(ROOT_CHORD * (1.0 - (1.0 - FIN_TAPER) * out))


def _fin(edge: float, sagitta: float) -> Surface:
    """The upper fin, with vertices on the true section and no edge longer than edge."""
    target = min(edge, 0.3 * ROOT_CHORD)
    require_possible(2.0 * FIN_AREA, edge)
    for _ in range(40):
        surface = _loft(*_fin_grid(target, sagitta))
        longest = longest_edge(surface)
        if longest <= edge:
            return surface
        target *= max(0.7, 0.999 * edge / longest)
    raise AssertionError("a finer grid has shorter edges")


def _fin_grid(step: float, sagitta: float) -> tuple[Floats, Floats, int]:
    """Chordwise places (0 to 1), heights (m), and facets across the thickness of the flat ends."""
    fine = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 2049))
    half = naca0012(fine)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(fine), np.diff(half)))])  # in chords
    number, steps = length[-1] * ROOT_CHORD / (0.8 * step), length
    if np.isfinite(sagitta):  # two facets on a chord w are at the mean distance w^2/(12 R) from the section
        turn = np.abs(np.diff(np.arctan2(np.diff(half), np.diff(fine))))
        bent = np.interp(length, length[1:-1], turn / (0.5 * (length[2:] - length[:-2])))  # 1/R, per chord
        pace = np.maximum(ROOT_CHORD / (0.8 * step), np.sqrt(ROOT_CHORD * bent / (12.0 * sagitta)))
        steps = np.concatenate([[0.0], np.cumsum(np.diff(length) * 0.5 * (pace[1:] + pace[:-1]))])
        number = steps[-1]
    chordwise = np.interp(np.linspace(0, steps[-1], 1 + int(np.ceil(number))), steps, fine)
    root = FIN_HEIGHT - FIN_SPAN
    inside = np.linspace(FIN_FOOT, root, 1 + int(np.ceil((root - FIN_FOOT) / (0.6 * step))))
    outside = np.linspace(root, FIN_HEIGHT, 1 + int(np.ceil(FIN_SPAN / (0.6 * step))))
    return chordwise, np.concatenate([inside, outside[1:]]), int(np.ceil(THICKNESS * ROOT_CHORD / (0.6 * step)))


def _loft(chordwise: Floats, height: Floats, across: int) -> Surface:
    """A closed surface through the fin's sections at heights, with flat ends `across` facets wide."""
    middle = 0.5 * hull_length(HULL) - FIN_STATION
    half = naca0012(chordwise)
    half[[0, -1]] = 0.0
    share_across = np.linspace(1.0, -1.0, across + 1)

    def point(i: np.ndarray, level: Floats, share: Floats) -> Floats:
        """Vertices at a chordwise index, a height, and a share of the half thickness."""
        chord = _chord(level)
        x = middle + chord * (0.5 - chordwise[i])
        return np.stack(np.broadcast_arrays(x, share * chord * half[i], level), axis=-1)

    i, unit = np.arange(len(chordwise)), np.ones(1)
    port = point(i[None], height[:, None], unit[0])
    starboard = point(i[None], height[:, None], -unit[0])
    foot = point(i[:, None], height[:1], share_across[None])
    tip = point(i[:, None], height[-1:], share_across[None])
    grids = [_grid(port), _grid(starboard[::-1]), _grid(foot), _grid(tip[::-1])]
    vertices, faces = weld(join(*grids))
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return vertices, faces[distinct]  # grids end in points at the leading and trailing edges


def _grid(points: Floats) -> Surface:
    """Two facets a cell of a grid (row, column, xyz)."""
    rows, columns = points.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (number[:-1, :-1].ravel(), number[:-1, 1:].ravel(), number[1:, 1:].ravel(), number[1:, :-1].ravel())
    return points.reshape(-1, 3), np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1).reshape(-1, 3)


def _rolled(fin: Surface, roll: float) -> Surface:
    """The fin turned about x, up towards starboard."""
    x, y, z = fin[0].T
    c, s = np.round(np.cos(roll)), np.round(np.sin(roll))  # quarter turns, exactly
    return np.stack([x, c * y - s * z, s * y + c * z], axis=1), fin[1]


def _coarse_hull() -> Surface:
    """238 facets: ten rings of twelve, a fan on the nose, a twelve-sided end without a middle."""
    arcs = hull_meridian(HULL)
    nose, tail = _evenly(arcs[1], 5), _evenly(arcs[3], 5)
    x, r = np.concatenate([nose, tail], axis=1)
    x, r = np.concatenate([x[:1], x]), np.concatenate([[0.0], r])
    vertices, faces = rings(x, r, np.array([1, *[12] * 10]))
    last = len(vertices) - 12 + np.arange(12)
    end = np.stack([np.full(10, last[0]), last[2:], last[1:-1]], axis=1)
    return vertices, np.concatenate([faces, end])


def _evenly(arc: Arc, number: int) -> Floats:
    """(2, number) x and r evenly along an arc."""
    s = arc.along()[2]
    return np.stack(arc.point(np.interp(np.linspace(0.0, s[-1], number), s, arc.samples)))


def _coarse_fin() -> Surface:
    """12 facets: a wedge of four sides with its greatest thickness at 30 % of the chord."""
    return _loft(np.array([0.0, 0.3, 1.0]), np.array([FIN_FOOT, FIN_HEIGHT]), 1)
