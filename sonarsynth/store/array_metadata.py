"""Metadata of a store, as the specification of Zarr 3 has them (zarr-specs, core and sharding codec): what zarr itself
writes, to the byte.

zarr takes 0.3 s to import, and as long again to make sixty arrays.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from sonarsynth.store.encoding import PLAIN, compression
from sonarsynth.store.layout import ArrayLayout

Document = dict[str, Any]
"""Metadata of an array or a group: what its zarr.json says."""


def documents(attrs_of_groups: Mapping[str, dict[str, Any]], arrays: Mapping[str, Document]) -> dict[str, bytes]:
    """Files of metadata by their names, from attributes of groups by path ("" for the root) and metadata of arrays.

    The root has all of them once more ("consolidated"), so that a reader opens one file. Readers that do not know that
    use those of each array; xarray warns without it.
    """
    groups = {path: {"attributes": attrs, "zarr_format": 3} for path, attrs in attrs_of_groups.items()}
    members = {path: {**group, **_consolidated({}), "node_type": "group"} for path, group in groups.items() if path}
    members |= arrays
    by_depth = {path: members[path] for path in sorted(members, key=lambda path: (path.count("/"), path))}
    nodes = {path: {**group, "node_type": "group"} for path, group in groups.items()} | dict(arrays)
    nodes[""] = {**groups[""], **_consolidated(by_depth), "node_type": "group"}
    return {f"{path}/zarr.json".strip("/"): json.dumps(node, indent=2).encode() for path, node in nodes.items()}


def _consolidated(metadata: dict[str, Any]) -> Document:
    return {"consolidated_metadata": {"kind": "inline", "must_understand": False, "metadata": metadata}}


def framed_array(array: ArrayLayout) -> Document:
    """An array that frames are written to."""
    variable, inner = array.variable, tuple(max(1, n) for n in array.shape[1:])
    attrs: dict[str, Any] = {"units": variable.units, "long_name": variable.long_name, **dict(variable.attributes)}
    if "scale_factor" in attrs:  # packed: readers must know the fill value to give NaN
        attrs["_FillValue"] = int(variable.fill)
    chunk, codecs = (array.chunk, *inner), _codecs(array.dtype, compression(array))
    if array.chunk != array.shard:
        index = [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]
        sharding = {"chunk_shape": chunk, "codecs": codecs, "index_codecs": index, "index_location": "end"}
        chunk, codecs = (array.shard, *inner), [{"name": "sharding_indexed", "configuration": sharding}]
    fill = "NaN" if variable.fill != variable.fill else array.dtype.type(variable.fill).item()
    return _document(array.shape, array.dtype.name, chunk, codecs, fill, variable.dims, attrs)


def fixed_array(dims: tuple[str, ...], values: np.ndarray, attrs: dict[str, Any]) -> Document:
    """An array that no frame changes, in one chunk."""
    text = values.dtype.kind == "U"
    words: list[dict[str, Any]] = [{"name": "vlen-utf8", "configuration": {}}, {"name": "crc32c"}]
    codecs = words if text else _codecs(values.dtype, PLAIN)
    name, fill = ("string", "") if text else (values.dtype.name, values.dtype.type(0).item())
    return _document(values.shape, name, tuple(max(1, n) for n in values.shape), codecs, fill, dims, attrs)


def _document(
    shape: tuple[int, ...],
    dtype: str,
    chunk: tuple[int, ...],
    codecs: list[dict[str, Any]],
    fill: Any,
    dims: tuple[str, ...],
    attrs: dict[str, Any],
) -> Document:
    """The metadata of an array.

    Shards lie in the folder of their array: with the usual "/", each has as many folders of its own as axes.
    """
    return {
        "shape": shape,
        "data_type": dtype,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
        "fill_value": fill,
        "codecs": codecs,
        "attributes": attrs,
        "dimension_names": dims,
        "zarr_format": 3,
        "node_type": "array",
        "storage_transformers": [],
    }


def _codecs(dtype: np.dtype[Any], compressed: dict[str, Any]) -> list[dict[str, Any]]:
    """Blosc, and a checksum."""
    order: dict[str, Any] = {"configuration": {"endian": "little"}} if dtype.itemsize > 1 else {}
    blosc = {"typesize": dtype.itemsize, **compressed}
    return [{"name": "bytes", **order}, {"name": "blosc", "configuration": blosc}, {"name": "crc32c"}]
