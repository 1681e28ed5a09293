"""Environments for Bellhop: the water of a frame, from each snap to the centre of the array.

Porter (2011), "The BELLHOP manual and user's guide". Depths are in m, down, ranges in km, absorption of the bottom in
dB per wavelength. Surface and bottom are flat and the water is alike at all ranges, so that no `.ssp`, `.bty` or `.ati`
is needed; a table of reflection goes into a `.trc` (surface) or a `.brc` (bottom).
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.conventions import depth as depth_of
from sonarsynth.description import FieldError
from sonarsynth.environment.boundaries import (
    FluidHalfSpace,
    PressureRelease,
    ReflectionTable,
    Rigid,
    SeaBottom,
    SeaSurface,
    Sediment,
)
from sonarsynth.environment.boundary_numbers import coefficient, rms_height
from sonarsynth.environment.sea import Absorption
from sonarsynth.equations.rays.ray_solutions import Water, water
from sonarsynth.equations.water.boundary_reflection import SEDIMENTS
from sonarsynth.planning import Plan
from sonarsynth.store.files.place import write_atomically

DECIBELS_A_WAVELENGTH: Final = 40.0 * np.pi / np.log(10.0)
"""Of a loss tangent of 1: 54.58."""
JUMP: Final = 1e-3
"""m: Bellhop wants depths that rise, so that a jump of the sound speed becomes a layer of this thickness."""
MOST_NODES: Final = 20_001
"""That Bellhop has room for."""
DELAY_ERROR: Final = 1e-8
"""s: what a plane wave over half the gap between neighbouring beams may be off a spherical one."""
MOST_BEAMS: Final = 50_000
STEEPEST: Final = 89.0
"""deg: beams go from as far up to as far down."""
STEPS: Final = 200
"""Of a ray over the depth or the range, whichever is less."""
LIFT: Final = 1e-3
"""m, or a millionth of the depth: Bellhop traces no ray from a boundary, so that a snap on the bottom is put so far
above it."""
NEAREST: Final = 0.01
"""m: Bellhop's spreading is not for sound that goes straight up or down."""


def write_bellhop(plan: Plan, index: int, folder: Path, name: str) -> tuple[list[Path], tuple[str, ...]]:
    """Write an environment for each place of a snap of frame `index`: `<name>_frame<index>_snap<number>.env`.

    Its run is 'A': Bellhop writes delays, angles and amplitudes of the eigenrays to a `.arr`, which `sonarsynth rays
    --compare` reads. Returns the files written, and what Bellhop cannot express, a line each. Raises FieldError for
    a frame without a snap, OSError where a file cannot be written.
    """
    plan = plan.at(index)
    frame = plan.recipe.frame(index)[1]
    environment, array = plan.scene.world.environment, frame.sonar_pose.position
    layers = water(plan.profile.depth, plan.profile.speed, environment.depth)
    nodes = _rising(layers)
    if len(nodes) > MOST_NODES:
        raise FieldError(("scene", "world", "environment", "sound_speed"), f"has more than {MOST_NODES} nodes")
    first = {snap.position.tobytes(): n for n, snap in reversed(list(enumerate(frame.moment.snaps)))}
    if not first:
        raise FieldError(("scene", "world", "sources"), "is empty: Bellhop needs a source")
    frequency = plan.scene.sonar.band.centre
    folder.mkdir(parents=True, exist_ok=True)
    files: list[Path] = []
    for n in sorted(first.values()):
        snap = frame.moment.snaps[n].position
        depths = _off_boundaries([float(depth_of(position)) for position in (snap, array)], environment.depth)
        away = float(np.hypot(*(array - snap)[:2]))
        if away < NEAREST:
            raise FieldError(("scene", "world", "sources"), f"snap {n} is straight above or below the array")
        stem = folder / f"{name}_frame{index}_snap{n}"
        title = f"{plan.recipe.title}, frame {index}, snap {n} to array"
        top, top_lines = _boundary(environment.surface, 0.0, layers.speed[0], stem.with_suffix(".trc"), files)
        low, low_lines = _boundary(
            environment.bottom, environment.depth, layers.speed[-1], stem.with_suffix(".brc"), files
        )
        absorbed, absorbed_lines = _absorption(environment.absorption, float(np.mean(depths)))
        lines = [
            f"'{_plain(title)}'",
            f"{frequency!r}  ! Hz",
            "1  ! media",
            f"'C{top}W{absorbed}'  ! straight lines between the nodes; the surface; dB per wavelength; absorption",
            *absorbed_lines,
            *top_lines,
            f"{len(nodes)} 0.0 {environment.depth!r}  ! nodes, roughness, m",
            *(f"{z!r} {c!r} /" for z, c in nodes.tolist()),
            f"'{low}' 0.0  ! the bottom",
            *low_lines,
            *(f"1\n{depth!r} /  ! m, {end}" for depth, end in zip(depths, ("snap", "array"), strict=True)),
            f"1\n{1e-3 * away!r} /  ! km",
            "'A'  ! arrivals",
            f"{_beams(depths, away, float(layers.speed.min()))}  ! beams",
            f"{-STEEPEST} {STEEPEST} /  ! deg",
            f"{min(environment.depth, away) / STEPS:.6g} {1.01 * environment.depth:.6g} {1.01e-3 * away:.6g}"
            "  ! step (m), box (m, km)",
        ]
        files.append(stem.with_suffix(".env"))
        write_atomically(files[-1], ("\n".join(lines) + "\n").encode("ascii"))
    return files, _unsaid(plan)


def _rising(layers: Water) -> Floats:
    """Depths and speeds (node, 2), a jump as a thin layer."""
    depth = layers.depth.copy()
    for i in range(1, len(depth)):
        depth[i] = max(depth[i], depth[i - 1] + JUMP * (layers.depth[i] == layers.depth[i - 1]))
    upper = np.append(depth[:-1] < depth[-1] - JUMP, True)
    rises = np.append(True, np.diff(depth[upper]) > 0)
    return np.asarray(np.column_stack([depth, layers.speed])[upper][rises])


def _off_boundaries(depths: list[float], bottom: float) -> tuple[float, float]:
    lift = max(LIFT, 1e-6 * bottom)
    first, second = (min(max(depth, lift), bottom - lift) for depth in depths)
    return first, second


def _boundary(
    boundary: SeaSurface | SeaBottom, depth: float, speed: float, table: Path, files: list[Path]
) -> tuple[str, list[str]]:
    """The letter of a boundary and the lines after it; a table is written beside, and added to the files."""
    match boundary.reflection:
        case PressureRelease():
            return "V", []
        case Rigid():
            return "R", []
        case ReflectionTable():
            files.append(table)
            write_atomically(table, _table(boundary).encode("ascii"))
            return "F", []
        case Sediment(name=name):
            density, ratio, loss = SEDIMENTS[name]
        case FluidHalfSpace(density_ratio=density, speed_ratio=ratio, loss_tangent=loss):
            pass
    return "A", [
        f"{depth!r} {float(ratio * speed)!r} 0.0 {density!r} {float(loss * DECIBELS_A_WAVELENGTH)!r} 0.0 /"
        "  ! m, m/s, m/s, g/cm3, dB per wavelength"
    ]


def _table(boundary: SeaSurface | SeaBottom) -> str:
    """Grazing angle (deg), modulus and phase (deg), a line each; finer than as written, where losses are in dB."""
    table = boundary.reflection
    assert isinstance(table, ReflectionTable)
    angle = np.asarray(table.grazing)
    if table.loss is not None:
        angle = np.union1d(angle, np.linspace(angle[0], angle[-1], 361))
    modulus = np.abs(coefficient(SeaBottom(reflection=table), angle))
    phase = np.rad2deg(np.interp(angle, table.grazing, table.phase))
    rows = zip(np.rad2deg(angle).tolist(), modulus.tolist(), phase.tolist(), strict=True)
    return f"{len(angle)}\n" + "".join(f"{a:.9g} {m:.9g} {p:.9g}\n" for a, m, p in rows)


def _absorption(absorption: Absorption, depth: float) -> tuple[str, list[str]]:
    if absorption.formula == "none":
        return " ", []
    water = f"{absorption.temperature!r} {absorption.salinity!r} {absorption.ph!r} {depth:.6g}"
    return "F", [f"{water}  ! degC, psu, pH, m"]


def _beams(depths: tuple[float, float], away: float, slowest: float) -> int:
    """How many beams: a wave from the snap is plane enough from one to the next."""
    farthest = float(np.hypot(away, depths[1] - depths[0]))
    apart = np.sqrt(8.0 * slowest * DELAY_ERROR / farthest)
    return int(np.clip(np.ceil(np.deg2rad(2.0 * STEEPEST) / apart), 300, MOST_BEAMS)) + 1


def _unsaid(plan: Plan) -> tuple[str, ...]:
    """What the scene has and Bellhop's environment has not."""
    environment, notes = plan.scene.world.environment, []
    for name, boundary in (("surface", environment.surface), ("bottom", environment.bottom)):
        if (height := rms_height(boundary)) > 0.0:
            notes.append(f"the {name} is smooth: a roughness of {height:.3g} m rms takes nothing from the amplitudes")
    if plan.recipe.scene.world.relief is not None:
        notes.append("the bottom is flat: the relief is left out")
    if environment.surface.bubbles:
        notes.append("there are no bubbles under the surface")
    if environment.absorption.formula == "ainslie_mccolm":
        notes.append("absorption is that of Francois and Garrison: Bellhop has no formula of Ainslie and McColm")
    elif environment.absorption.formula != "none":
        notes.append("absorption is that of the mean depth of snap and array, along the whole of each path")
    notes.append(f"a snap on the bottom or the surface is {1e3 * LIFT:g} mm off it, or a millionth of the depth")
    if (jumps := int(np.sum(np.diff(plan.profile.depth) == 0))) > 0:
        notes.append(f"{jumps} jumps of the sound speed are layers of {1e3 * JUMP:g} mm")
    return tuple(notes)


def _plain(title: str) -> str:
    """A title in ASCII that Fortran reads: quotes doubled, and no longer than it keeps."""
    text = " ".join(title.encode("ascii", "replace").decode().split())[:70].strip(" ,")
    return text.replace("'", "''")
