"""HDF5 files that a recipe names: numbers of their own, of bounded size, and nothing that lies in other files."""

from __future__ import annotations

import io
from typing import Any, Final

import numpy as np

from sonarsynth.description.named_files import FileError

SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
MOST_ITEMS: Final = 100_000
"""Of a file: names of groups and datasets, of which one may have many."""
MISSING: Final = "is HDF5, which needs h5py: pip install 'sonarsynth[netcdf]'"


def refuse_other_files(data: bytes) -> None:
    """Refuses an HDF5 file some of whose numbers lie in other files. Raises FileError, or what h5py finds wrong."""
    h5py = _h5py()
    count = 0

    def check(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise FileError(f"'{name}' lies in another file, which is not read")
        if isinstance(item, h5py.Group):
            links(item)

    def links(group: Any) -> None:
        nonlocal count
        for name in group:
            count += 1
            if count > MOST_ITEMS:
                raise FileError(f"has more than {MOST_ITEMS} groups and datasets")
            if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
                raise FileError(f"'{name}' lies in another file, which is not read")

    with h5py.File(io.BytesIO(data), "r") as file:
        links(file)
        file.visititems(check)  # follows no link to another file


def read_dataset(data: bytes, name: str | None, limit: int) -> tuple[np.ndarray, dict[str, float]]:
    """The numbers of a dataset, at most `limit`, and its attributes that are numbers: its own before those of the
    groups that hold it.

    name: of the dataset, `/group/dataset`; left out: the only one of numbers that there is. Raises FileError, whatever
    is wrong with the file.
    """
    h5py = _h5py()
    try:
        refuse_other_files(data)
        with h5py.File(io.BytesIO(data), "r") as file:
            dataset = _dataset(h5py, file, name)
            _check_size(dataset, limit)
            values = np.asarray(dataset[()])
            holders = [dataset]
            while holders[-1].name != "/":
                holders.append(holders[-1].parent)
            attributes: dict[str, float] = {}
            for holder in holders:
                attributes = _numbers(holder.attrs) | attributes
            return values, attributes
    except (FileError, MemoryError):
        raise
    except Exception as error:  # whatever a damaged file may bring
        text = " ".join(str(error).split())[:120]
        raise FileError(f"cannot be read as HDF5 ({type(error).__name__}: {text})") from None


def _dataset(h5py: Any, file: Any, name: str | None) -> Any:
    """The dataset of that name, or the only one of numbers. Raises FileError."""
    datasets: list[str] = []
    file.visititems(lambda path, item: datasets.append(path) if _numeric(h5py, item) else None)
    shown = ", ".join(f"'{path[:60]}'" for path in datasets[:8]) + (", ..." if len(datasets) > 8 else "")
    if name is None:
        if len(datasets) != 1:
            raise FileError(
                f"has {len(datasets)} datasets of numbers: name the `dataset`" + (f" ({shown})" if datasets else "")
            )
        return file[datasets[0]]
    if name.strip("/") not in datasets:
        raise FileError(f"has no dataset of numbers '{name[:60]}'" + (f", only {shown}" if datasets else ""))
    return file[name.strip("/")]


def _numeric(h5py: Any, item: Any) -> bool:
    return isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and item.shape is not None


def _check_size(dataset: Any, limit: int) -> None:
    """Refuses a shape, or pieces of it, that no file of numbers needs. Raises FileError."""
    for noun, shape in (("numbers", dataset.shape), ("numbers in a piece", dataset.chunks or ())):
        count = 1
        for size in shape:
            count *= int(size)
        if count > limit:
            raise FileError(f"'{dataset.name}' has {count} {noun}, more than {limit}")


def _numbers(attributes: Any) -> dict[str, float]:
    numbers = {}
    for name in list(attributes)[:1000]:
        value = attributes[name]
        if np.size(value) == 1 and np.asarray(value).dtype.kind in "iuf":
            numbers[str(name).lower()] = float(np.ravel(value)[0])
    return numbers


def _h5py() -> Any:
    try:
        import h5py
    except ImportError:
        raise FileError(MISSING) from None
    return h5py
