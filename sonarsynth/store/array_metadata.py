"""Metadata of a store, as the specification of Zarr 3 has them (zarr-specs, core and sharding codec): what zarr itself
writes, to the byte.

zarr takes 0.3 s to import, and as long again to make sixty arrays.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.store.encoding import PLAIN, compression

if TYPE_CHECKING:
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
    variable = array.variable
    attrs: dict[str, Any] = {"units": variable.units, "long_name": variable.long_name, **dict(variable.attributes)}
    if "scale_factor" in attrs:  # packed: readers must know the fill value to give NaN
        attrs["_FillValue"] = int(variable.fill)
    where = lies(array.shape, array.dtype, array.shard, array.chunk, compression(array))
    fill = "NaN" if variable.fill != variable.fill else array.dtype.type(variable.fill).item()
    return _document(array.shape, array.dtype.name, where, fill, variable.dims, attrs)


def lies(shape: tuple[int, ...], dtype: np.dtype[Any], shard: int, chunk: int, how: dict[str, Any]) -> Document:
    """Where the numbers of an array lie, so many frames in a shard and in a chunk, and `how` blosc compresses them."""
    inner, codecs = [max(1, n) for n in shape[1:]], _codecs(dtype, how)
    if chunk != shard:
        index = [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]
        sharding = {"chunk_shape": [chunk, *inner], "codecs": codecs, "index_codecs": index, "index_location": "end"}
        codecs = [{"name": "sharding_indexed", "configuration": sharding}]
    return _where([shard, *inner], codecs)


def _where(chunk: list[int], codecs: list[dict[str, Any]]) -> Document:
    """Shards lie in the folder of their array: with the usual "/", each has as many folders of its own as axes."""
    return {
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
        "codecs": codecs,
        "storage_transformers": [],
    }


def fixed_array(dims: tuple[str, ...], values: np.ndarray, attrs: dict[str, Any]) -> Document:
    """An array that no frame changes, in one chunk."""
    text = values.dtype.kind == "U"
    words: list[dict[str, Any]] = [{"name": "vlen-utf8", "configuration": {}}, {"name": "crc32c"}]
    codecs = words if text else _codecs(values.dtype, PLAIN)
    name, fill = ("string", "") if text else (values.dtype.name, values.dtype.type(0).item())
    where = _where([max(1, n) for n in values.shape], codecs)
    return _document(values.shape, name, where, fill, dims, attrs)


def _document(
    shape: tuple[int, ...], dtype: str, where: Document, fill: Any, dims: tuple[str, ...], attrs: dict[str, Any]
) -> Document:
    """The metadata of an array."""
    return {
        "shape": shape,
        "data_type": dtype,
        "chunk_grid": where["chunk_grid"],
        "chunk_key_encoding": where["chunk_key_encoding"],
        "fill_value": fill,
        "codecs": where["codecs"],
        "attributes": attrs,
        "dimension_names": dims,
        "zarr_format": 3,
        "node_type": "array",
        "storage_transformers": where["storage_transformers"],
    }


def _codecs(dtype: np.dtype[Any], compressed: dict[str, Any]) -> list[dict[str, Any]]:
    """Blosc, and a checksum."""
    order: dict[str, Any] = {"configuration": {"endian": "little"}} if dtype.itemsize > 1 else {}
    blosc = {"typesize": dtype.itemsize, **compressed}
    return [{"name": "bytes", **order}, {"name": "blosc", "configuration": blosc}, {"name": "crc32c"}]
