"""Bodies of a frame in their places along the target axis of the store, and its emissions first along theirs: what is
not there reads as missing."""

from __future__ import annotations

import numpy as np

from sonarsynth.pipeline.stored_values import Values, table
from sonarsynth.pipeline.variables.variable import Variable
from sonarsynth.planning import Plan

INDICES = (("/truth/beams", "target"), ("/cloud", "target"))
"""Variables that are numbers of targets."""


def which_values(plan: Plan) -> Values:
    """What the bodies and emissions of a frame are, each along its own axis; `plan` is that of its sequence."""
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


def in_slots(plan: Plan, values: Values, variables: tuple[Variable, ...]) -> Values:
    """The values of a frame, axes of targets and emissions as long as in the store; `plan` is that of its sequence."""
    values = _with_room(values, plan.sizes["emission"], variables)
    slots = {name: n for n, name in enumerate(plan.recipe.target_names)}
    own_slots = np.array([slots[target.name] for target in plan.scene.world.targets], np.int64)
    if len(own_slots) == len(slots):
        return values
    padded = dict(values)
    for v in variables:
        if "target" in v.dims and (v.group, v.name) in values:
            padded[v.group, v.name] = _spread(values[v.group, v.name], v, own_slots, len(slots))
    padded["/truth/targets", "present"] = np.isin(np.arange(len(slots)), own_slots).astype(np.int8)
    for key in INDICES:
        if key in values:
            numbers = values[key]
            renumbered = np.append(own_slots, -1)[np.where(numbers < 0, len(own_slots), numbers)]
            padded[key] = renumbered.astype(numbers.dtype)
    return padded


def _with_room(values: Values, emissions: int, variables: tuple[Variable, ...]) -> Values:
    """The values with room for so many emissions: those that a frame does not have are the last."""
    missing = emissions - len(values["/truth/emissions", "source"])
    if not missing:
        return values
    padded = dict(values)
    for v in variables:
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
