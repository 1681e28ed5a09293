"""The stored schema: each variable with dimensions, type, units and meaning. The store is laid out from it alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import FORMAT_VERSION
from sonarsynth.pipeline.variables.static_variables import coordinates
from sonarsynth.pipeline.variables.variable import Variable, flags
from sonarsynth.pipeline.variables.variable_groups import VARIABLES
from sonarsynth.planning import OF_BEAMS, Plan
from sonarsynth.ranging.range_profiles import aperture_moments

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "VARIABLES",
    "Variable",
    "attributes",
    "coordinates",
    "frame_tree",
    "variables",
]


@lru_cache(maxsize=8)
def variables(plan: Plan) -> tuple[Variable, ...]:
    """The variables of a build: of the products asked for, and int16 pressure where a converter is described."""
    wanted = {"truth", *plan.products}
    if plan.products:
        wanted.add("levels")
    if plan.products & OF_BEAMS:
        wanted.add("source_estimates")
    if plan.scene.sonar.sensor_errors is not None:
        wanted.add("sensors")
    if plan.scene.world.chorus is not None:
        wanted |= {"chorus"} | ({"chorus and levels"} if plan.products else set())
    if plan.makes_sound and (parts := plan.scene.sound_parts):
        wanted |= {"snr", *(f"snr {name}" for name in parts)}
    chosen = [v for v in VARIABLES if v.product in wanted]
    if not plan.windows.direct_removed:
        chosen = [v for v in chosen if (v.group, v.name) != ("/image", "remainder")]
    categories = flags(plan.recipe.categories)
    chosen = [replace(v, attributes=categories) if v.name == "category" else v for v in chosen]
    converter = plan.scene.sonar.converter
    if converter is not None and converter.bits <= 16:
        counts: dict[str, Any] = {
            "dtype": "int16",
            "fill": -(2**15),
            "attributes": (("scale_factor", converter.quantum),),
        }
        chosen = [replace(v, **counts) if (v.group, v.name) == ("/signals", "pressure") else v for v in chosen]
    return tuple(chosen)


def attributes(plan: Plan) -> dict[str, Any]:
    """Root attributes of a store that any builder of this plan writes the same."""
    recipe, world = plan.recipe, plan.scene.world
    chorus = world.chorus is not None and world.chorus.rate > 0.0
    besides = {"chorus": chorus, "noise_sources": world.noise_sources, "scatterers": world.scatterers}
    besides["reverberation"] = world.reverberation is not None
    others = [name for name, value in besides.items() if value]
    also: dict[str, Any] = {"other_sounds": others} if others else {}
    if world.sources:
        also["lit_by"] = sorted({source.light for source in world.sources})
    if sent := [said for source in world.sources if (said := source.as_transmitter) is not None]:
        also["transmitters"] = sent
    return also | {
        "title": recipe.title,
        "Conventions": "CF-1.11",
        "sonarsynth_format": FORMAT_VERSION,
        "licence": recipe.licence,
        "seed": recipe.seed,
        "recipe_digest": plan.digest,
        "band_low": plan.scene.sonar.band.low,
        "band_high": plan.scene.sonar.band.high,
        "assumed_sound_speed": plan.scene.sonar.assumed_sound_speed,
        "accuracy_signal": recipe.accuracy.signal,
        "aperture_radius": plan.elements.aperture,
        "aperture_rms": np.sqrt(np.diag(aperture_moments(plan.elements))[1:]).tolist(),  # m, across and up
        "choices": plan.choices.as_json(),
        "validity": list(plan.validity),
        "frames_conventions": (
            "World: x east, y north, z up, z = 0 mean surface. Sonar and target frames: x forward, y port, z up. "
            "Quaternions (w, x, y, z) from body to world. Levels re 1 uPa, source levels at 1 m."
        ),
    }


def frame_tree(plan: Plan, index: int, values: Mapping[tuple[str, str], npt.NDArray[Any]]) -> xr.DataTree:
    """A frame as a labelled tree: groups, names, types and units (attributes) as in a store, without the frame axis.

    values: every stored value of frame number `index`, by group and name.
    """
    import xarray as xr

    static: dict[str, dict[str, Any]] = {}
    varying: dict[str, dict[str, Any]] = {}
    for (group, name), (dims, array, attrs) in coordinates(plan).items():
        entry = (dims[1:], array[index], attrs) if "frame" in dims else (dims, array, attrs)
        static.setdefault(group, {})[name] = entry
    for v in variables(plan):
        attrs = {"units": v.units, "long_name": v.long_name, **dict(v.attributes)}
        data = np.asarray(values[v.group, v.name], v.dtype)
        data = v.stacked([data], (plan.sizes[v.dims[1]],))[0] if v.listed else data
        if "scale_factor" in attrs:
            packed = data * attrs.pop("scale_factor")
            data = np.where(data == v.fill, np.nan, packed).astype(np.float32)
        varying.setdefault(v.group, {})[v.name] = (v.dims[1:], data, attrs)
    groups = {  # each at once: xarray aligns all that a dataset has with every variable that is added
        group: xr.Dataset(varying.get(group), static.get(group), attributes(plan) if group == "/" else None)
        for group in dict.fromkeys(["/", *static, *varying])
    }
    return xr.DataTree.from_dict(groups)
