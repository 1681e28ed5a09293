"""Metadata of the arrays of a store, as the specification of Zarr 3 has them (zarr-specs, core and sharding codec)."""

from __future__ import annotations

from typing import Any

import numpy as np
from zarr.core.metadata.v3 import ArrayV3Metadata

from sonarsynth.store.encoding import PLAIN, compression
from sonarsynth.store.layout import ArrayLayout


def framed_array(array: ArrayLayout) -> ArrayV3Metadata:
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
    fill = "NaN" if variable.fill != variable.fill else variable.fill
    return _document(array.shape, array.dtype.name, chunk, codecs, fill, variable.dims, attrs)


def fixed_array(dims: tuple[str, ...], values: np.ndarray, attrs: dict[str, Any]) -> ArrayV3Metadata:
    """An array that no frame changes, in one chunk."""
    text = values.dtype.kind == "U"
    words: list[dict[str, Any]] = [{"name": "vlen-utf8", "configuration": {}}, {"name": "crc32c"}]
    codecs = words if text else _codecs(values.dtype, PLAIN)
    name, fill = ("string", "") if text else (values.dtype.name, 0)
    return _document(values.shape, name, tuple(max(1, n) for n in values.shape), codecs, fill, dims, attrs)


def _document(
    shape: tuple[int, ...],
    dtype: str,
    chunk: tuple[int, ...],
    codecs: list[dict[str, Any]],
    fill: Any,
    dims: tuple[str, ...],
    attrs: dict[str, Any],
) -> ArrayV3Metadata:
    """The metadata of an array, as the specification of Zarr 3 has it.

    Shards lie in the folder of their array: with the usual "/", each has as many folders of its own as axes.
    """
    return ArrayV3Metadata.from_dict(
        {
            "zarr_format": 3,
            "node_type": "array",
            "shape": shape,
            "data_type": dtype,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "."}},
            "fill_value": fill,
            "codecs": codecs,
            "attributes": attrs,
            "dimension_names": dims,
        }
    )


def _codecs(dtype: np.dtype[Any], compressed: dict[str, Any]) -> list[dict[str, Any]]:
    """Blosc, and a checksum."""
    blosc = {**compressed, "typesize": dtype.itemsize, "blocksize": 0}
    return [
        {"name": "bytes", "configuration": {"endian": "little"}},
        {"name": "blosc", "configuration": blosc},
        {"name": "crc32c"},
    ]
