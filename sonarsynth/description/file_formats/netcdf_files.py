"""netCDF files that a recipe names, 3 and 4."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from sonarsynth.description.file_formats.hdf5_files import refuse_other_files
from sonarsynth.description.named_files import FileError

if TYPE_CHECKING:
    import xarray as xr

MISSING: Final = "is netCDF 4, which needs h5netcdf: pip install 'sonarsynth[netcdf]'"


@contextmanager
def netcdf(data: bytes, refusal: type[Exception]) -> Iterator[xr.Dataset]:
    """A netCDF file, whose numbers are read where they are asked for; times stay numbers.

    refusal: what the block itself raises. Else FileError, whatever is wrong with the file.
    """
    import xarray as xr

    engine = "scipy" if data[:3] == b"CDF" else "h5netcdf"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if engine == "h5netcdf":
                refuse_other_files(data)
            yield xr.open_dataset(io.BytesIO(data), engine=engine, decode_times=False)
    except (FileError, refusal):
        raise
    except ImportError:
        raise FileError(MISSING) from None
    except Exception as error:  # whatever a damaged file may bring
        text = " ".join(str(error).split())[:120]
        absent = engine == "h5netcdf" and "h5netcdf" in text
        raise FileError(MISSING if absent else f"cannot be read as netCDF ({type(error).__name__}: {text})") from None
