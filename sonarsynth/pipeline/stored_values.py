"""Products as they are stored: (group, name) to the array of one frame."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import NO_TARGET, Floats, azimuth_elevation
from sonarsynth.equations.kernels.rounding import multiples
from sonarsynth.imaging.beam_envelopes import envelope_levels
from sonarsynth.labels.views.range_cells_met import met_at_ranges
from sonarsynth.pipeline.variables import variables
from sonarsynth.pipeline.variables.variable import Variable
from sonarsynth.pipeline.variables.variable_groups import LEVEL_STEP, NO_LEVEL, VARIABLES
from sonarsynth.planning import Plan
from sonarsynth.products import (
    LINK_BUDGET,
    Arrivals,
    BeamSpectra,
    Echoes,
    EnergyImage,
    LinkBudget,
    PointCloud,
    PointLabels,
    Signals,
    SourceEstimates,
    Truth,
)
from sonarsynth.receiver.sensor_errors import DrawnErrors

Values = dict[tuple[str, str], np.ndarray]
"""(group, name) to the array of one frame, without the frame axis; of points and paths as many as there are."""


def table(group: str, **columns: object) -> Values:
    """Arrays of one group."""
    return {(group, name): np.asarray(value) for name, value in columns.items()}


def truth_values(truth: Truth) -> Values:
    """Truth."""
    groups = {"beam": "/truth/beams", "snap": "/truth/emissions", "sonar": "/truth"}
    values: Values = {}
    for name, value in vars(truth).items():
        whose, _, own_name = name.partition("_")
        short = own_name if whose in ("beam", "snap", "target") else name
        values[groups.get(whose, "/truth/targets"), short] = np.asarray(value)
    angles = {name: np.rad2deg(getattr(truth, name)) for name in ("image_box", "true_image_box", "full_box", "yaw")}
    return values | table("/truth/targets", **angles)


def echo_values(echoes: Echoes, arrivals: Arrivals) -> Values:
    """Echoes of targets, and the errors of the expansions of arrivals: NaN, not infinite, where a sensor has no ray."""
    stored: dict[str, object] = {f"echo_{name}": np.rad2deg(getattr(echoes, name)) for name in ("azimuth", "elevation")}
    stored["echo_level"] = echoes.level
    errors = {name: float(getattr(arrivals, name)) for name in ("wavefront_error", "amplitude_error")}
    bounds = {name: error if np.isfinite(error) else float("nan") for name, error in errors.items()}
    return table("/truth/targets", **stored) | table("/link_budget", **bounds)


def link_budget_values(budget: LinkBudget, measured: Floats | None) -> Values:
    """Levels; measured (snap, target + 1, family) in dB, or None where signals are not stored.

    A path so faint that single precision holds nothing of it (hundreds of dB down a lobe) has no measured level: NaN.
    """
    measures = {} if measured is None else {"measured_level": np.where(np.isneginf(measured), np.nan, measured)}
    return table(
        "/link_budget",
        **{name: budget.level[..., n] for n, name in enumerate(LINK_BUDGET)},
        paths=budget.paths,
        error_bound=budget.error_bound,
        isolated_facet=of_isolated(budget, budget.isolated.facet, NO_TARGET),
        isolated_level=budget.isolated_level,
        **measures,
    )


def of_isolated(budget: LinkBudget, values: np.ndarray, fill: float = np.nan) -> np.ndarray:
    """Values of the isolated paths of a link budget (path,) as a table (snap, target + 1, family)."""
    rows = np.full(budget.isolated_level.shape, fill, values.dtype)
    rows[np.isfinite(budget.isolated_level)] = values
    return rows


def sensor_values(drawn: DrawnErrors) -> Values:
    """What is wrong with the sensors."""
    return table(
        "/truth/sensors",
        gain=20.0 * np.log10(drawn.gain),
        phase=np.rad2deg(drawn.phase),
        delay=drawn.delay,
        position_error=drawn.position,
        state=drawn.state.astype(np.int8),
        clock_rate=1e6 * drawn.clock_rate,
    )


def signal_values(plan: Plan, signals: Signals) -> Values:
    """Signals, as counts of the converter or in Pa."""
    counts = any(v.name == "pressure" and v.dtype == "int16" for v in variables(plan))
    pressure = multiples(signals.pressure, signals.quantum) if counts else signals.pressure
    return table("/signals", pressure=pressure, start=signals.start, clipped=signals.clipped, outside=signals.outside)


NOT_STORED = ("position_by_speed", "pressure", "as_snap_time", "as_snap_position", "as_snap_covariance")
"""What ranging knows of source estimates beside what the store has."""


def source_estimate_values(estimates: SourceEstimates) -> Values:
    """Source estimates, in degrees."""
    columns = {name: values for name, values in vars(estimates).items() if name not in NOT_STORED}
    for name in ("azimuth", "azimuth_error", "elevation", "elevation_error"):
        columns[name] = np.rad2deg(columns[name])
    return table("/source_estimates", **columns)


def image_values(image: EnergyImage, direct_removed: bool) -> Values:
    """The image and its window; what may be left in it of the direct pulse, where that is taken out."""
    values = table("/image", energy=image.energy, start=image.start, stop=image.stop)
    return values | table("/image", remainder=np.float32(image.remainder)) if direct_removed else values


def beam_values(plan: Plan, beams: BeamSpectra | None, image: EnergyImage) -> Values:
    """Levels of beams against delay, rounded to `LEVEL_STEP`; nothing of beams that the image has nothing of."""
    shape = *image.energy.shape, len(plan.beam_delays)
    stored = np.full(shape, NO_LEVEL, np.int16)
    if beams is not None:
        level = envelope_levels(beams, plan.scene.sonar, shape[2]) / LEVEL_STEP
        finite = np.isfinite(level) & np.isfinite(image.energy)[..., None]
        stored[finite] = np.rint(np.clip(level[finite], NO_LEVEL + 1, -NO_LEVEL - 1))
    return table("/beams", level=stored, start=np.nan if beams is None else beams.snapshots.start)


def range_image_values(plan: Plan, energy: npt.NDArray[np.float32] | None, truth: Truth) -> Values:
    """The range image, NaN where there is none, and whose cells are whose."""
    grid, beams = plan.scene.sonar.ranges, plan.scene.sonar.beams
    assert grid is not None, "asked when the plan was made"
    if energy is None:
        energy = np.full((grid.count, beams.azimuths), np.nan, np.float32)
    target = met_at_ranges(truth.beam_target, truth.beam_range, beams.elevation, grid.range)
    return table("/range_image", energy=energy, target=target)


def cloud_values(cloud: PointCloud, labels: PointLabels, targets: int) -> Values:
    """The cloud, each coordinate apart, and whose echo each point is; how many points each of so many targets has."""
    x, y, z = cloud.position.T
    columns = {name: value for name, value in vars(cloud).items() if name not in ("position", "overflow")}
    columns["estimate"] = np.broadcast_to(cloud.estimate, len(cloud)).astype(np.int8)
    angles = ("azimuth", "azimuth_error", "elevation", "elevation_error")
    columns |= {name: np.rad2deg(columns[name]).astype(np.float32) for name in angles}
    columns |= {"x": x, "y": y, "z": z, **vars(labels)}
    of_targets = np.bincount(labels.target[labels.target >= 0], minlength=targets).astype(np.int32)
    values = table("/cloud", count=np.int32(len(cloud)), overflow=np.int32(cloud.overflow), **columns)
    return values | table("/truth/targets", points=of_targets)


def path_values(arrivals: Arrivals, size: int, sensors: int) -> Values:
    """Paths as they reach the middle of the array, at most `size` of them: the loudest, in the order of arrivals."""
    order = np.argsort(-np.abs(arrivals.amplitude), kind="stable")
    kept = arrivals.select(np.sort(order[:size]))
    azimuth, elevation = azimuth_elevation(kept.direction)
    hidden = kept.hidden(sensors)
    numbers = {
        "azimuth": np.rad2deg(azimuth),
        "elevation": np.rad2deg(elevation),
        "hidden": hidden.mean(axis=1) if hidden.shape[1] else np.zeros(len(kept.delay)),
        **{name: getattr(kept, name) for name in ("radius", "length", "amplitude", "phase", "delay_std", "doppler")},
        "absorption": kept.absorption,
    }
    columns: dict[str, np.ndarray] = {name: value.astype(np.float32) for name, value in numbers.items()}
    whose = {"target": np.int16, "emission": np.int16, "facet": np.int32, "kind": np.int8}
    how = dict.fromkeys(("family", "lit_by", "surface", "bottom"), np.int8)
    own_names = {"emission": "snap", "family": "arrives_by"}
    columns |= {n: getattr(kept, own_names.get(n, n)).astype(dtype) for n, dtype in {**whose, **how}.items()}
    count, overflow = len(kept.delay), len(arrivals.delay) - len(kept.delay)
    return table("/paths", count=count, overflow=overflow, delay=kept.delay, **columns)


INDICES = (("/truth/beams", "target"), ("/cloud", "target"), ("/paths", "target"), ("/range_image", "target"))
"""Variables that are numbers of targets."""


@lru_cache(maxsize=2)
def which_values(plan: Plan) -> Values:
    """What the bodies and emissions of a frame are, each along its own axis; `plan` is that of its sequence, all frames
    of which have these."""
    scene, recipe = plan.scene, plan.recipe
    targets, categories = scene.world.targets, recipe.categories
    sources = scene.world.sources
    whose = np.repeat(np.arange(len(sources)), [len(source.times) for source in sources])
    return table("/truth/emissions", source=whose.astype(np.int16)) | table(
        "/truth/targets",
        present=np.ones(len(targets), np.int8),
        category=np.array([categories.index(target.category) for target in targets], np.int16),
        clutter=np.array([target.clutter for target in targets], np.int8),
        scale=np.array([target.scale for target in targets], float),
        mesh=np.array([recipe.mesh_number(scene, n) for n in range(len(targets))], np.int32),
    )


def in_slots(plan: Plan, values: Values) -> Values:
    """Values of a frame and of its sequence, whose `plan` it is, axes of targets and emissions as long as in stores."""
    values = _with_room(values | which_values(plan), plan.sizes["emission"])
    slots = {name: n for n, name in enumerate(plan.recipe.target_names)}
    own_slots = np.array([slots[target.name] for target in plan.scene.world.targets], np.int64)
    if len(own_slots) == len(slots):
        return values
    padded = dict(values)
    for v in VARIABLES:
        if "target" in v.dims and (v.group, v.name) in values:
            padded[v.group, v.name] = _spread(values[v.group, v.name], v, own_slots, len(slots))
    padded["/truth/targets", "present"] = np.isin(np.arange(len(slots)), own_slots).astype(np.int8)
    for key in INDICES:
        if key in values:
            numbers = values[key]
            renumbered = np.append(own_slots, -1)[np.where(numbers < 0, len(own_slots), numbers)]
            padded[key] = renumbered.astype(numbers.dtype)
    return padded


def _with_room(values: Values, emissions: int) -> Values:
    """The values with room for so many emissions: those that a frame does not have are the last."""
    missing = emissions - len(values["/truth/emissions", "source"])
    if not missing:
        return values
    padded = dict(values)
    for v in VARIABLES:
        if "emission" in v.dims and (v.group, v.name) in values:
            widths = [(0, missing if dim == "emission" else 0) for dim in v.dims[1:]]
            padded[v.group, v.name] = np.pad(values[v.group, v.name], widths, constant_values=v.fill)
    return padded


def _spread(values: np.ndarray, variable: Variable, own_slots: np.ndarray, slots: int) -> np.ndarray:
    """Values along the axis of targets, in their slots; the direct path of the link budget stays the last."""
    axis = variable.dims.index("target") - 1  # without frames
    also = values.shape[axis] - len(own_slots)
    shape = (*values.shape[:axis], slots + also, *values.shape[axis + 1 :])
    spread = np.full(shape, variable.fill, values.dtype)
    places = np.concatenate([own_slots, slots + np.arange(also)])
    np.moveaxis(spread, axis, 0)[places] = np.moveaxis(values, axis, 0)
    return spread
