"""Odd scenes through the whole chain: truth by geometry, and no number that is none without its reason."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.environment.sea import Environment, Isovelocity, Tabulated
from sonarsynth.equations.arrays.bistatic_range import bistatic_range
from sonarsynth.geometry.motion import Still
from sonarsynth.imaging import DenseDelayAndSum
from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.products import LINK_BUDGET, View
from sonarsynth.receiver import BeamGrid, PlanarLattice, PositionTable, Sonar
from sonarsynth.receiver.sensor_errors import Electronics
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import EchoWindow, Processing, Scene, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Box, Shape, Sphere
from sonarsynth.targets.target import Target
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, together

if TYPE_CHECKING:
    import xarray as xr

SPAN = float(np.deg2rad(50.0))
BEAMS = BeamGrid(azimuths=21, elevations=11, azimuth_span=SPAN, elevation_span=0.5 * SPAN)
UNIFORM = Isovelocity(speed=1540.0)
LATTICE = PlanarLattice(columns=8, rows=8, pitch=0.05)


def recipe(
    targets: tuple[tuple[Shape, tuple[float, float, float]], ...] = (),
    snap: tuple[float, float] | tuple[float, float, float] = (14.0, -4.0),
    speed: Isovelocity | Tabulated = UNIFORM,
    depth: float = 40.0,
    **more: Any,
) -> Recipe:
    """Targets at places (xyz) seen from 5 m under the surface, and a snap."""
    placed = tuple(
        Target(name=f"t{n}", shape=shape, motion=Still(position=(x, y, z - 5.0), heading=0.5 * np.pi))
        for n, (shape, (x, y, z)) in enumerate(targets)
    )
    shrimp = (SnappingShrimp(position=snap),)
    processing = more.pop("processing", Processing())
    settings: dict[str, Any] = {"array": LATTICE, "beams": BEAMS}
    sonar = Sonar(**(settings | more))
    world = World(environment=Environment(depth=depth, sound_speed=speed), targets=placed, sources=shrimp)
    return Recipe(scene=Scene(world=world, sonar=sonar, processing=processing))


def frame(of: Recipe, products: tuple[str, ...] = ("signals", "image", "cloud", "paths")) -> xr.DataTree:
    """The first frame."""
    return render(plan(of, products), 0)


REASONS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "/truth/beams/range": ("target", lambda target: target < 0),
    **{
        f"/truth/targets/{box}": ("view", lambda view: view > View.PARTLY_IN_VIEW)
        for box in ("image_box", "true_image_box", "full_box", "pixel_box")
    },
    "/truth/targets/truncation": ("view", lambda view: view == View.HIDDEN),
    "/truth/targets/lit_fraction": ("view", lambda view: (view == View.HIDDEN)[None]),
    "/link_budget/error_bound": ("paths", lambda paths: paths == 0),
    "/link_budget/measured_level": ("paths", lambda paths: paths == 0),
    "/link_budget/isolated_level": ("paths", lambda paths: paths == 0),
    **{f"/link_budget/{term}": ("paths", lambda paths: paths == 0) for term in LINK_BUDGET},
}
"""Where numbers may be none, what stands beside them, and what that says then."""
ELSEWHERE = (
    "/image",
    "/cloud",
    "/paths",
    "/source_estimates",
    "/truth/targets/echo_",
    "/truth/emissions/a",
    "/truth/emissions/elev",
    "/truth/emissions/position_at",
    "/link_budget/wavefront_error",
)
"""Where the reason is another: no snap was found, no point; echoes from no side, or several."""


def reasoned(tree: xr.DataTree) -> CaseResult:
    """No infinity; NaN only where something beside it says why."""
    wrong: list[str] = []
    for node in tree.subtree:
        for name, variable in node.to_dataset(inherit=False).data_vars.items():
            path = f"{node.path.rstrip('/')}/{name}"
            if variable.dtype.kind == "f":
                wrong += [path] if not _explained(path, variable.values, node) else []
    if "cloud" in tree.children:
        columns = {str(name): v.values for name, v in tree["cloud"].data_vars.items() if v.dims}
        of_targets = [np.isnan(columns.pop(name)) for name in ("true_range", "distance")]
        wrong += ["/cloud"] if not all((none == (columns["target"] < 0)).all() for none in of_targets) else []
        whose = np.isnan(columns["range"]) & np.any([columns[name] >= 0 for name in ("target", "origin")], axis=0)
        wrong += ["/cloud"] if whose.any() else []
        wrong += ["/cloud/count"] if int(tree["cloud"]["count"]) != np.isfinite(columns["range"]).sum() else []
        points = [np.isnan(column) for column in columns.values() if column.dtype.kind == "f"]
        clock = np.isfinite(float(tree["image"].start))
        removed = "remainder" in tree["image"]  # the direct pulse was: beams that may hold much of it still are none
        leftover = removed and float(tree["image"].remainder) > 0.0
        unheard = bool(np.isnan(tree["image"].energy.values).any())
        wrong += ["/cloud"] if not all((p == points[0]).all() for p in points) else []
        wrong += ["/image/energy"] if unheard == clock and not (unheard and leftover) else []
    if "paths" in tree.children:
        there = np.arange(tree["paths"].sizes["path"]) < int(tree["paths"]["count"])
        numbers = [v.values for v in tree["paths"].data_vars.values() if v.dims and v.dtype.kind == "f"]
        wrong += ["/paths"] if not all((np.isfinite(column) == there).all() for column in numbers) else []
    return holds(not wrong, "every NaN has its reason" if not wrong else f"NaN without one in {', '.join(wrong)}")


def _explained(path: str, values: Any, node: xr.DataTree) -> bool:
    none = np.isnan(values)
    if np.isinf(values).any():
        return False
    if path in REASONS and none.any():
        beside, reason = REASONS[path]
        why = reason(node[beside].values)
        return not (none & ~why.reshape(*why.shape, *[1] * (none.ndim - why.ndim))).any()
    return not none.any() or path in REASONS or path.startswith(ELSEWHERE)


def _wall() -> CaseResult:
    """A wall 1 m ahead, wider than the view: every beam meets it, at 1/cos of both angles."""
    tree = frame(recipe(((Box(size=(0.1, 8.0, 8.0)), (1.05, 0.0, 0.0)),), (-3.0, 3.0, -5.0)))
    truth = tree["truth/beams"]
    exact = 1.0 / np.cos(BEAMS.azimuth[None, :]) / np.cos(BEAMS.elevation[:, None])
    return together(
        holds(bool((truth.target.values == 0).all()), "every beam meets it"),
        off(truth.range.values / exact - 1.0, 1e-6, what="range"),
        off(float(tree["truth/targets"].visible_fraction[0]) - 1.0, 1e-12, what="visible share"),
        reasoned(tree),
    )


def _beside_view() -> CaseResult:
    """Its edge at the last beam, a millionth of its distance inside or outside of it."""
    near, far, results = 10.0, 10.1, []
    for step in (1e-6, -1e-6):
        edge = (near if step < 0 else far) * np.tan(0.5 * SPAN) * (1.0 + step)
        half = 0.5
        tree = frame(recipe(((Box(size=(far - near, 2 * half, 1.0)), (0.5 * (near + far), edge + half, 0.0)),)))
        hit = tree["truth/beams"].target.values == 0
        columns = sorted(set(np.nonzero(hit)[1].tolist()))
        results.append(holds(columns == ([] if step > 0 else [20]), f"columns {columns} meet it"))
        results.append(reasoned(tree))
    return together(*results)


def _behind() -> CaseResult:
    """The body stands before the snap: nothing direct is heard, so no bearing, an empty image and no cloud."""
    tree = frame(recipe(((Sphere(radius=0.6, edge=0.1), (7.0, 0.0, 0.0)),), (14.0, 0.0, -5.0)))
    silent = not tree["signals"].pressure.values.any()
    none = all(np.isnan(np.asarray(tree[name])).all() for name in ("source_estimates/position", "cloud/range"))
    none &= not np.asarray(tree["image/energy"]).any()
    direct = tree["link_budget"].paths.values[0, -1].sum()
    return together(
        holds(direct == 0 and silent, "no direct path, silence"),
        holds(none, "no bearing, energy, cloud"),
        reasoned(tree),
    )


def _beyond() -> CaseResult:
    """The snap stands before the target, on its line: heard, imaged, and its echo ranged as x/2 beyond the snap."""
    tree = frame(recipe(((Sphere(radius=0.6, edge=0.1), (17.0, 0.0, 0.0)),), (9.0, 0.0, -5.0)))
    return together(
        holds(bool(np.isfinite(tree["image"].energy.values).all()), "an image"),
        off(np.nanmin(tree["truth/beams"].range.values) - 16.4, 1e-3, "m", "nearest range"),
        reasoned(tree),
    )


def _on_line() -> CaseResult:
    """A small target half way to the snap, off the line by a tenth of a metre: its range is ill-conditioned."""
    ahead = np.array([1.0, 0.0, 0.0])
    on = bistatic_range(0.0, ahead, 20.0 * ahead)
    tree = frame(recipe(((Sphere(radius=0.05), (7.0, 0.1, 0.0)),), (14.0, 0.0, -5.0)))
    flagged = bool(np.isnan(on.range)) and bool(on.ill_conditioned)
    points = np.isfinite(tree["cloud"].range.values)
    return together(
        holds(flagged, "exactly on it: NaN, ill-conditioned"),
        holds(not points.any(), f"{points.sum()} points"),
        reasoned(tree),
    )


def _shadow_zone() -> CaseResult:
    """Speed falls by 0.5 /s: nothing reaches 5 m from 2 km away; paths are 0, levels NaN, and the sonar hears none."""
    water = Tabulated(depth=(0.0, 40.0), speed=(1540.0, 1520.0))
    tree = frame(recipe((), (2000.0, 0.0, -10.0), water))
    limit = sum(np.sqrt(z * (2.0 * 1540.0 / 0.5 - z)) for z in (5.0, 10.0))
    return together(
        holds(limit < 2000.0, f"the last ray comes {limit:.0f} m"),
        holds(not tree["link_budget"].paths.values.any(), "no path"),
        holds(not tree["signals"].pressure.values.any(), "silence"),
        reasoned(tree),
    )


def _link_budget() -> CaseResult:
    """Two targets 100 dB apart and one that is hidden: levels add up to rounding, NaN where there is no path."""
    far = (Sphere(radius=0.5, edge=0.1), (9.0, 1.0, 0.0)), (Sphere(radius=2e-5), (30.0, -2.0, 0.0))
    hidden = ((Sphere(radius=0.05), (12.0, 1.3, 0.0)),)
    tree = frame(recipe(far + hidden, (14.0, -4.0), depth=60.0), ("signals",))
    budget: dict[str, Any] = {str(name): np.asarray(v) for name, v in tree["link_budget"].data_vars.items()}
    source, out, scattering, back, absorption, boundary, received = (budget[term] for term in LINK_BUDGET)
    paths = budget["paths"]
    residual = source - out + scattering - back - absorption - boundary - received
    has_path = paths > 0
    apart = float(received[0, 0, 0] - received[0, 1, 0])
    return together(
        off(residual[has_path], 1e-9, "dB", "sum"),
        holds(bool((np.isnan(received) == ~has_path).all()), "NaN where there is no path, only there"),
        holds(bool(paths[0, 1].sum() > 0) and apart > 95.0, f"the faint one, {apart:.0f} dB below, is in it"),
        holds(not paths[0, 2].any(), "the hidden one is not"),
        reasoned(tree),
    )


def _arrays() -> CaseResult:
    results = []
    for positions in (((0.0, 0.0, 0.0),), ((0.0, 0.1, 0.0),) * 2):
        dense = Processing(beamforming=DenseDelayAndSum())
        tree = frame(recipe(array=PositionTable(positions=positions), processing=dense))
        located = np.isfinite(tree["source_estimates"].time.values).any()
        results.append(holds(not located and int(tree["cloud"]["count"]) == 0, "no clock, no point"))
        results.append(reasoned(tree))
    return together(*results)


def _snr() -> CaseResult:
    """White noise of S Pa2/Hz in M sensors brings S/M B T in each beam of a band of B Hz in T s."""
    ball, beside = ((Sphere(radius=0.6, edge=0.1), place) for place in ((9.0, 1.0, 0.0), (2.0, 9.0, 0.0)))
    silent = frame(recipe((ball,)), ("image",))["truth/targets"]
    parts = [holds(not {"snr", "echo_energy"} & {*silent.data_vars}, "a silent sea: no such variable")]
    huge = 20.0 * np.log10(1e9 / 1e-6) - 10.0 * np.log10(0.5 * Sonar().sampling_frequency)  # dB of 1e9 Pa in all
    band = Sonar().band.high - Sonar().band.low
    late = EchoWindow(start=0.02, stop=0.03)
    for level, window, what in ((30.0, EchoWindow(), "30 dB"), (huge, EchoWindow(), "1e9 Pa"), (30.0, late, "late")):
        chosen = Processing(echo_window=window)
        tree = frame(recipe((ball, beside), electronics=Electronics(level=level), processing=chosen), ("image",))
        truth, image = tree["truth/targets"], tree["image"]
        (snr, hidden), echo, noise = (np.asarray(truth[name]) for name in ("snr", "echo_energy", "electronics_energy"))
        beams = np.count_nonzero(tree["truth/beams"].target.values == 0)
        expected_gain = beams / (LATTICE.columns * LATTICE.rows) * band * float(image.stop - image.start)
        parts += [
            off(noise[0] - level - 10.0 * np.log10(expected_gain), 1.0, "dB", f"{what}: noise"),
            off(snr - echo[0] + noise[0], 1e-6, "dB", "snr"),
            holds(np.isnan([hidden, echo[1], noise[1]]).all(), "NaN out of view"),
            holds((echo[0] == -200.0) == (window is late), f"echo {echo[0]:.0f} dB"),
        ]
    return together(*parts)


CASES = (
    Case("a target that covers the field of view", "every beam meets it, at 1/cos of its angles", _wall),
    Case("just inside and just outside the view", "the last column of beams meets it; none does", _beside_view),
    Case("source behind the target", "no direct path, silence; NaN for what is not heard", _behind),
    Case("target behind the source", "an image; the range of the nearest point", _beyond),
    Case("a target on the source-array baseline", "no point, ill-conditioned", _on_line),
    Case("a whole frame in a shadow zone", "no path, silence, and NaN with its reason", _shadow_zone),
    Case(
        "the link budget of loud, faint and hidden targets", "levels add up; NaN where there is no path", _link_budget
    ),
    Case(
        "frames of one sensor and of two at one place",
        "no bearing, so no clock and no point; NaN with its reason",
        _arrays,
    ),
    Case(
        "snr: a silent sea, no echo in the window, out of view, 1e9 Pa",
        "no variable; -200 dB over the noise; NaN; S/M B T of noise in a beam",
        _snr,
    ),
)
