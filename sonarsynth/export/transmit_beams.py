"""What SONAR-netCDF4 asks of transmit beams, by the attribute `transmitters` of a store."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import FieldError
from sonarsynth.export.platform_angles import beam_rotation

if TYPE_CHECKING:
    import xarray as xr

KINDS: Final = {"CW": 0, "LFM": 1, "HFM": 2}
"""`transmit_t` of the convention."""
RMS: Final = 10.0 * np.log10(2.0)
"""dB: the root mean square of a tone under its peak, which the source level of a store is."""
_NUMBERS: Final = (
    "start", "stop", "duration", "source_level", "azimuth", "elevation", "azimuth_width", "elevation_width",
)  # fmt: skip


class TransmitBeams(NamedTuple):
    """Beams of transmitters, one that says nothing where there is none: masked and NaN."""

    position: Floats  # (transmitter, xyz) m, sonar frame; of none where there is none
    kind: np.ma.MaskedArray[Any, Any]  # (tx_beam,) numbers of `KINDS`; masked where the pulse is of none of them
    numbers: dict[str, tuple[Floats, str]]  # (tx_beam,) of each variable, and its units

    @property
    def beams(self) -> int:
        """How many."""
        return len(self.kind)


def transmit_beams(tree: xr.DataTree) -> TransmitBeams:
    """The beams of the transmitters of a store. Raises FieldError for an attribute that no build writes."""
    listed = tree.attrs.get("transmitters", [])
    rows = [_row(entry, n) for n, entry in enumerate(listed if isinstance(listed, list | tuple) else [None])]
    told = [row for row, _ in rows] or [{}]
    column = {name: np.array([row.get(name, np.nan) for row in told]) for name in _NUMBERS}
    phi, theta = beam_rotation(np.deg2rad(column["azimuth"]), np.deg2rad(column["elevation"]))
    numbers = {
        "transmit_duration_nominal": (column["duration"], "s"),
        "transmit_frequency_start": (column["start"], "Hz"),
        "transmit_frequency_stop": (column["stop"], "Hz"),
        "transmit_source_level": (column["source_level"] - RMS, "dB"),
        "beamwidth_transmit_major": (column["azimuth_width"], "arc_degree"),
        "beamwidth_transmit_minor": (column["elevation_width"], "arc_degree"),
        "tx_beam_rotation_phi": (phi, "arc_degree"),
        "tx_beam_rotation_theta": (theta, "arc_degree"),
        "tx_beam_rotation_psi": (0.0 * phi, "arc_degree"),
    }
    position = np.array([[row[axis] for axis in "xyz"] for row, _ in rows]).reshape(-1, 3)
    kinds = [kind for _, kind in rows] or [None]
    masked = np.ma.array([kind or 0 for kind in kinds], np.int8, mask=[kind is None for kind in kinds])
    return TransmitBeams(position, masked, numbers)


def _row(entry: Any, number: int) -> tuple[dict[str, float], int | None]:
    """The numbers of a transmitter, and that of the kind of its pulse, if it is a sweep or a tone."""
    said = entry if isinstance(entry, dict) else {}
    row = {name: said[name] for name in (*_NUMBERS, *"xyz") if name in said}
    numbers = all(isinstance(value, int | float) and np.isfinite(value) for value in row.values())
    kind = said.get("type")
    if not numbers or not {*"xyz"} <= row.keys() or kind not in (None, *KINDS):
        raise FieldError(("transmitters", str(number)), "must have x, y and z, numbers, and a type of CW, LFM or HFM")
    if kind is None:
        row.pop("source_level", None)  # it is of a peak
        return row, None
    return row, KINDS[kind]
