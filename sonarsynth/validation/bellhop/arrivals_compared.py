"""Eigenrays of ours beside Bellhop's arrivals: delay, angles, loss and bounces, and by how much they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.conventions import aligned
from sonarsynth.conventions import depth as depth_of
from sonarsynth.pictures.ray_lines import RayLine, eigenray_lines
from sonarsynth.planning import Plan
from sonarsynth.propagation.ray_request import EigenrayRequest
from sonarsynth.recipe.scene import Frame
from sonarsynth.validation.bellhop.arrivals_file import ArrivalsError, BellhopArrivals, read_arrivals

OFF: Final = 0.01
"""Part of the distance, and of the larger depth, by which ends may be elsewhere; of one metre at least. A snap on the
bottom is a little above it in Bellhop's run (`bellhop_files.LIFT`), which is less."""
SAME_LAUNCH, SAME_DELAY = np.deg2rad(2.0), 0.01
"""Launch angles, and part of the delay, by which our ray and an arrival may differ and be a pair."""
SAME_RAY: Final = np.deg2rad(1.0)
"""Launch angles of two arrivals of one ray: beams on either side of it."""
SAME_TIME: Final = 1e-3
"""Part of their delay, likewise."""
HEADINGS: Final = (
    "family", "bounces (S, B)", "time (ms)", "- Bellhop (us)", "launch (deg)", "- Bellhop", "arrival (deg)",
    "- Bellhop", "TL (dB)", "- Bellhop",
)  # fmt: skip


@dataclass(frozen=True)
class RayComparison:
    """A ray of ours and Bellhop's: NaN where there is none."""

    family: str
    surface: int
    bottom: int
    delay: tuple[float, float]  # s: ours, Bellhop's
    launch: tuple[float, float]  # rad, up positive
    arrival: tuple[float, float]  # rad, up positive
    loss: tuple[float, float]  # dB


def compare_arrivals(plan: Plan, index: int, file: Path) -> list[RayComparison]:
    """The rays of frame `index` from a snap to the array, as `rays:` asks for, beside the arrivals of a file.

    Of several snaps the one is taken that the file's ends are of. Rays are paired within the same number of bounces at
    the surface and at the bottom, the nearest launch angles first, where these and the delays are about the same;
    arrivals of one ray (Bellhop has one from the beams on either side of it) are added up. Raises ArrivalsError where
    the file cannot be read, or is of other ends.
    """
    plan = plan.at(index)
    frame = plan.recipe.frame(index)[1]
    snap, arrivals = _nearest(frame, file)
    wanted = None if plan.recipe.rays is None else plan.recipe.rays.eigenrays
    request = replace(EigenrayRequest() if wanted is None else wanted, targets="none")
    return paired(
        [line for line in eigenray_lines(plan, frame, request) if line.name == f"snap {snap} to array"], arrivals
    )


def paired(ours: Sequence[RayLine], arrivals: BellhopArrivals) -> list[RayComparison]:
    """Rays of both, in the order of their delays."""
    theirs, none = _merged(arrivals), np.full(4, np.nan)
    rows = [
        (
            (line.event.count("surface"), line.event.count("bottom")),
            np.array([line.time[-1], line.elevation[0], line.elevation[-1], line.transmission_loss]),
        )
        for line in ours
    ]
    near = [
        (abs(their[1] - own[1]), i, j)
        for i, (own_bounces, own) in enumerate(rows)
        for j, (bounces, their) in enumerate(theirs)
        if bounces == own_bounces
        and abs(their[1] - own[1]) < SAME_LAUNCH
        and abs(their[0] - own[0]) < SAME_DELAY * own[0]
    ]
    pair: dict[int, int] = {}
    for _, i, j in sorted(near):
        if i not in pair and j not in pair.values():
            pair[i] = j
    compared = [_row(line.family, *rows[i], theirs[pair[i]][1] if i in pair else none) for i, line in enumerate(ours)]
    alone = [their for j, their in enumerate(theirs) if j not in pair.values()]
    compared += [_row("Bellhop alone", bounces, none, their) for bounces, their in alone]
    return sorted(compared, key=lambda ray: float(np.nanmin(ray.delay)))


def comparison_table(rays: Sequence[RayComparison], file: Path) -> str:
    """The comparison, a line a ray; arrivals of more reflections than any ray of ours has are only counted."""
    max_reflections = max((ray.surface + ray.bottom for ray in rays if np.isfinite(ray.delay[0])), default=0)
    shown = [ray for ray in rays if ray.surface + ray.bottom <= max_reflections]
    rows: list[tuple[str, ...]] = [HEADINGS]
    for ray in shown:
        cells = [f"{1e3 * _either(ray.delay):.4f}", f"{1e6 * (ray.delay[0] - ray.delay[1]):.3f}"]
        for angle in (ray.launch, ray.arrival):
            cells += [f"{np.rad2deg(_either(angle)):.3f}", f"{np.rad2deg(angle[0] - angle[1]):.3f}"]
        cells += [f"{_either(ray.loss):.2f}", f"{ray.loss[0] - ray.loss[1]:.2f}"]
        rows.append((ray.family, f"{ray.surface}, {ray.bottom}", *(c.replace("nan", "-") for c in cells)))
    return "\n".join([f"{file.name}, ours less Bellhop's:", *aligned(rows), _summary(rays, len(shown))])


def _summary(rays: Sequence[RayComparison], shown: int) -> str:
    both = [ray for ray in rays if np.isfinite(ray.delay).all()]
    words = f"{len(both)} rays of both, {shown - len(both)} of one alone"
    if both:
        late = max(abs(ray.delay[0] - ray.delay[1]) for ray in both)
        loud = max(abs(ray.loss[0] - ray.loss[1]) for ray in both)
        words += f"; delays differ by {1e6 * late:.3g} us at most, levels by {loud:.2g} dB"
    omitted = len(rays) - shown
    return words + (f"; {omitted} arrivals of more reflections not looked for" if omitted else "")


def _either(pair: tuple[float, float]) -> float:
    """What of a pair is there, ours first."""
    return pair[1] if np.isnan(pair[0]) else pair[0]


def _nearest(frame: Frame, file: Path) -> tuple[int, BellhopArrivals]:
    """The snap that a file is of, and its arrivals. Raises ArrivalsError."""
    array, arrivals = frame.sonar_pose.position, read_arrivals(file)
    best: tuple[float, int, tuple[float, float, float]] | None = None
    for number, snap in enumerate(frame.moment.snaps):
        ends = (float(depth_of(snap.position)), float(depth_of(array)), float(np.hypot(*(array - snap.position)[:2])))
        off = np.abs(np.subtract(ends, arrivals.nearest(*ends)))
        within = OFF * np.maximum(1.0, [max(ends[:2]), max(ends[:2]), ends[2]])
        if (off <= within).all() and (best is None or off.max() < best[0]):
            best = (float(off.max()), number, ends)
    if best is None:
        raise ArrivalsError(f"{file}: has no source and receiver where a snap and the array are in frame {frame.index}")
    return best[1], arrivals.at(*best[2])


def _merged(arrivals: BellhopArrivals) -> list[tuple[tuple[int, int], np.ndarray]]:
    """Bounces, and delay, angles and loss of each ray: what is of the same ray added up, weighted by amplitude."""
    amplitude = 10.0 ** (-arrivals.loss / 20.0)
    rows = np.column_stack([arrivals.delay, arrivals.launch, arrivals.arrival, amplitude])
    groups: list[tuple[tuple[int, int], list[np.ndarray]]] = []
    for i in np.lexsort((arrivals.launch, arrivals.bottom, arrivals.surface)):
        bounces, row = (int(arrivals.surface[i]), int(arrivals.bottom[i])), rows[i]
        if groups and groups[-1][0] == bounces:
            last = groups[-1][1][-1]
            if row[1] - last[1] < SAME_RAY and abs(row[0] - last[0]) < SAME_TIME * last[0]:
                groups[-1][1].append(row)
                continue
        groups.append((bounces, [row]))
    merged = []
    for bounces, group in groups:
        table = np.array(group)
        total = table[:, 3].sum()
        mean = table[:, :3].T @ table[:, 3] / total if total > 0.0 else table[0, :3]
        with np.errstate(divide="ignore"):
            merged.append((bounces, np.append(mean, -20.0 * np.log10(total))))
    return merged


def _row(family: str, bounces: tuple[int, int], ours: np.ndarray, theirs: np.ndarray) -> RayComparison:
    delay, launch, arrival, loss = ((float(a), float(b)) for a, b in zip(ours, theirs, strict=True))
    return RayComparison(family, *bounces, delay, launch, arrival, loss)
