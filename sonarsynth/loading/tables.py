"""Groups of a store as tables of pandas."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from math import prod
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import xarray as xr

from sonarsynth.store import some_frames

if TYPE_CHECKING:
    import pandas as pd

COMPONENTS = ("xyz", "xyz_other", "wxyz", "bound", "side", "corner")
"""Axes that become columns: components of one quantity, not several quantities."""
MOST_ROWS = 20_000_000


def points_table(tree: xr.DataTree, frames: int | Iterable[int] | None) -> pd.DataFrame:
    """The points of some frames, a row each; see `SonarAccessor.points`."""
    if "cloud" not in tree.children:
        raise ValueError("the store has no cloud: it was built without that product")
    cloud = tree.children["cloud"].to_dataset(inherit=True).isel(frame=some_frames(tree, frames))
    own = [name for name, values in cloud.data_vars.items() if values.dims == ("frame", "point")]
    counts = cloud["count"].values
    cloud = cloud[own].isel(point=slice(0, int(counts.max(initial=0)))).load()
    filled = np.arange(cloud.sizes["point"]) < counts[:, None]
    table = cloud.assign_coords(point=np.arange(cloud.sizes["point"])).to_dataframe(dim_order=["frame", "point"])
    table = _described(table[filled.ravel()], cloud)
    names = [str(name) for name in tree["truth/targets"].coords["target"].values]
    return table.assign(target=_named(table["target"], range(len(names)), names))


def as_table(
    tree: xr.DataTree, group: str, rows: str | Iterable[str] | None, frames: int | Iterable[int] | None
) -> pd.DataFrame:
    """A group as a table; see `SonarAccessor.table`."""
    if (path := f"/{group.strip('/')}") not in tree.groups:
        raise KeyError(f"{group} is no group of the store, which has {', '.join(tree.groups)}")
    node, rows = cast(xr.DataTree, tree[path]), (rows,) if isinstance(rows, str) else rows
    dataset = node.to_dataset(inherit=True)
    if "frame" in node.to_dataset(inherit=False).dims:
        dataset = dataset.isel(frame=some_frames(tree, frames))
    axes = {name: _axes(values) for name, values in dataset.data_vars.items()}
    wanted = Counter(axes.values()).most_common(1)[0][0] if rows is None and axes else tuple(rows or ())
    if unknown := [name for name in wanted if name not in dataset.dims]:
        raise ValueError(f"{group} has no axis {unknown[0]}: {', '.join(map(str, dataset.dims))}")
    if not wanted:
        raise ValueError(f"{group} has no axis: there is nothing to make a row of")
    count = prod(dataset.sizes[name] for name in wanted)
    if count > MOST_ROWS:
        raise ValueError(f"{group}: {count} rows are more than {MOST_ROWS}; choose frames, or use xarray")
    included = [name for name, own in axes.items() if set(own) <= set(wanted)]
    read, columns = dataset[included].load(), dict[str, xr.DataArray]()  # each file once, not for each component
    for name in included:
        columns |= _columns(str(name), read[name])
    chosen = xr.Dataset(columns, attrs=dataset.attrs).drop_vars(COMPONENTS, errors="ignore")
    chosen = chosen.expand_dims({name: dataset[name] for name in wanted if name not in chosen.dims})
    chosen = chosen.assign_coords({name: _labels(dataset[name]) for name in wanted})
    table = _described(chosen.to_dataframe(dim_order=list(wanted)), chosen)
    table.attrs["left_out"] = sorted(str(name) for name in axes if name not in included)
    return table


def _labels(values: xr.DataArray) -> np.ndarray:
    """A coordinate as pandas has it: texts as Python's."""
    labels = np.asarray(values.values)
    return labels.astype(object) if labels.dtype.kind in "TU" else labels


def _axes(values: xr.DataArray) -> tuple[str, ...]:
    return tuple(str(name) for name in values.dims if name not in COMPONENTS)


def _columns(name: str, values: xr.DataArray) -> dict[str, xr.DataArray]:
    """A variable as columns, one for each of its components."""
    axis = next((str(axis) for axis in values.dims if axis in COMPONENTS), None)
    if axis is None:
        return {name: values.reset_coords(drop=True)}
    columns: dict[str, xr.DataArray] = {}
    for i, word in enumerate(values[axis].values):
        columns |= _columns(f"{name}_{word}", values.isel({axis: i}, drop=True))
    return columns


def _described(table: pd.DataFrame, dataset: xr.Dataset) -> pd.DataFrame:
    """Flags by their names; the units of what has one are in `.attrs`."""
    units, words = {str(name): str(values.attrs.get("units", "1")) for name, values in dataset.variables.items()}, {}
    for name, values in dataset.data_vars.items():
        flags, meanings = np.atleast_1d(values.attrs.get("flag_values", ())), values.attrs.get("flag_meanings", "")
        if len(flags) > 1:  # a single one says which number is none
            words[str(name)] = _named(table[name], flags.tolist(), str(meanings).split())
    table = table.assign(**words)
    table.attrs["units"] = {name: unit for name, unit in units.items() if unit != "1"}
    return table


def _named(numbers: pd.Series, values: Iterable[int], names: list[str]) -> Any:
    """Numbers as categories by name; missing where they have none."""
    import pandas as pd

    return pd.Categorical.from_codes(pd.Index(list(values)).get_indexer(pd.Index(numbers)), pd.Index(names))
