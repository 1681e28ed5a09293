"""Signals and beams in the convention SONAR-netCDF4 of ICES, version 2.0.

Source: Macaulay and Pena (2018), The SONAR-netCDF4 convention for sonar data, ICES Cooperative Research Report 341, and
its version 2.0 (github.com/ices-publications/SONAR-netCDF4).
"""

from __future__ import annotations

import errno
import os
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import PINGS, Floats, Progress, format_bytes
from sonarsynth.description import FieldError
from sonarsynth.export.platform_angles import beam_rotation, heading_pitch_roll, latitude_longitude
from sonarsynth.export.receive_beams import ReceiveBeams, receive_beams
from sonarsynth.export.transmit_beams import KINDS, TransmitBeams, transmit_beams

if TYPE_CHECKING:
    import xarray as xr

LOST: Final = (
    "what the convention asks of a transmitter is missing (NaN) for snaps, what it asks of a sweep for other pulses, "
    "and the absorption for all; no equation converts to target strength",
    "positions are metres east and north of 0 N 0 E (WGS 84); times are counted from the start of the motions, or the "
    "first frame where that is earlier, as 1970-01-01",
    "the truth, points, source estimates, meshes and the link budget are left out",
)
"""What an export lacks, a line each."""
BEAM_BYTES: Final = 110
"""That a file has of a beam of a ping beside its samples."""
FILE_BYTES: Final = 300_000
"""That a file has beside its beams."""
_TIME: Final = {
    "axis": "T",
    "calendar": "gregorian",
    "long_name": "Time-stamp of each ping",
    "standard_name": "time",
    "units": "nanoseconds since 1970-01-01 00:00:00Z",
}
_ENUMS: Final = {
    "beam_stabilisation_t": {"not_stabilised": 0, "stabilised": 1},
    "beam_t": {"single": 0, "split_aperture_angles": 1, "split_aperture_4_subbeams": 2},
    "conversion_equation_t": {f"type_{n}": n for n in range(1, 7)},
    "transmit_t": KINDS,
}


def write_sonar_netcdf(
    tree: xr.DataTree, folder: Path, frames: np.ndarray, progress: Progress | None = None
) -> tuple[Path, ...]:
    """Write some frames of a store, `sequence_<number>.nc` for each sequence of frames.

    `/Sonar/Beam_group1` has the pressure (Pa) at each hydrophone, a beam without direction each; where they are is in
    `/Platform`. The next group has the level (dB) of each steered beam against delay, where the store has the product
    beams, else the energy (Pa2 s) of each as one sample. Returns the files. Raises FieldError for a store with neither
    signals nor beams nor images, ImportError without h5netcdf, OSError.
    """
    groups, sent = list(receive_beams(tree)), transmit_beams(tree)
    if not groups:
        raise FieldError(("signals",), "the store has neither signals nor beams nor images")
    folder.mkdir(parents=True, exist_ok=True)
    sequence = np.asarray(tree["trajectory"].values)[frames]
    frame_bytes = sum(len(beams.names) * (4 * beams.length + BEAM_BYTES) for beams in groups)
    _must_have_room(folder, len(frames) * frame_bytes + len(np.unique(sequence)) * FILE_BYTES)
    files = []
    for number in np.unique(sequence).tolist():
        files.append(folder / f"sequence_{number}.nc")
        own = frames[sequence == number]
        with files[-1].open("wb") as file:  # raises where a quota or a limit of files is met
            os.posix_fallocate(file.fileno(), 0, len(own) * frame_bytes + FILE_BYTES)
        _write(tree, files[-1], own, groups, sent)
        if progress is not None:
            progress(int((sequence <= number).sum()), len(frames), 0)
    return tuple(files)


def _must_have_room(folder: Path, needed: int) -> None:
    """Raise OSError where the disk is too small: HDF5 ends the process when it is full."""
    free = shutil.disk_usage(folder).free
    if needed > free:
        said = f"takes {format_bytes(needed)}, and {format_bytes(free)} are free"
        raise OSError(errno.ENOSPC, said, str(folder))


def _write(tree: xr.DataTree, path: Path, frames: np.ndarray, groups: list[ReceiveBeams], sent: TransmitBeams) -> None:
    import h5netcdf

    with h5netcdf.File(path, "w") as file:
        now = datetime.now(UTC).replace(microsecond=0).isoformat().replace("+00:00", "Z")
        file.attrs.update(
            {
                "Conventions": "CF-1.7, SONAR-netCDF4-2.0, ACDD-1.3",
                "date_created": now,
                "keywords": ("active" if PINGS in tree.attrs.get("lit_by", ()) else "passive") + " sonar, simulation",
                "license": str(tree.attrs.get("licence", "None")),
                "sonar_convention_authority": "ICES",
                "sonar_convention_name": "SONAR-netCDF4",
                "sonar_convention_version": "2.0",
                "summary": " ".join(LOST),
                "title": str(tree.attrs.get("title", "")),
            }
        )
        _environment(tree, file)
        _platform(tree, file, sent)
        provenance = {"conversion_software_name": "sonarsynth", "conversion_time": now}
        provenance["conversion_software_version"] = str(tree.attrs.get("sonarsynth_version", ""))
        file.create_group("Provenance").attrs.update(provenance)
        sonar = file.create_group("Sonar")
        sonar.attrs.update({"sonar_manufacturer": "none", "sonar_model": "sonarsynth", "sonar_type": "omni-sonar"})
        kinds = {name: sonar.create_enumtype(np.int8, name, words) for name, words in _ENUMS.items()}
        for number, group in enumerate(groups, 1):
            _beam_group(tree, sonar.create_group(f"Beam_group{number}"), frames, group, sent, kinds)


def _environment(tree: xr.DataTree, file: Any) -> None:
    group = file.create_group("Environment")
    group.dimensions = {"frequency": 1}
    middle = 0.5 * (tree.attrs["band_low"] + tree.attrs["band_high"])
    _put(group, "frequency", ("frequency",), np.array([middle], np.float32), "Hz", "Acoustic frequency")
    none = np.array([np.nan], np.float32)
    _put(group, "absorption_indicative", ("frequency",), none, "dB/m", "Indicative acoustic absorption")
    speed = np.float32(tree.attrs["assumed_sound_speed"])
    _put(group, "sound_speed_indicative", (), speed, "m/s", "Indicative sound speed")


def _hydrophones(tree: xr.DataTree) -> Floats:
    """Positions (sensor, xyz) m, sonar frame; without signals the array is one."""
    return np.asarray(tree["signals/position"].values) if "signals" in tree.children else np.zeros((1, 3))


def _platform(tree: xr.DataTree, file: Any, sent: TransmitBeams) -> None:
    """The hydrophones, transducers that receive alone, and after them the transmitters."""
    group = file.create_group("Platform")
    hydrophones = _hydrophones(tree)
    position = np.concatenate([hydrophones, sent.position])
    group.dimensions = {"transducer": len(position), "position": 1, "MRU": 1, "gyro": 1}
    kind = group.create_enumtype(np.int8, "transducer_type_t", {"Receive_only": 0, "Transmit_only": 1, "Monostatic": 3})
    function = group.create_variable("transducer_function", ("transducer",), kind, fillvalue=np.int8(3))
    function[:] = (np.arange(len(position)) >= len(hydrophones)).astype(np.int8)
    for n, (axis, sign) in enumerate((("x", 1.0), ("y", -1.0), ("z", -1.0))):  # ours are port and up
        values = (sign * position[:, n]).astype(np.float32)
        _put(group, f"transducer_offset_{axis}", ("transducer",), values, "m", f"{axis}-offset of the transducer")
    for name in ("Position", "Attitude", "Gyro"):
        group.create_group(name)


def _beam_group(
    tree: xr.DataTree, group: Any, frames: np.ndarray, beams: ReceiveBeams, sent: TransmitBeams, kinds: dict[str, Any]
) -> None:
    import h5py

    count, rows = len(beams.names), len(frames)
    group.attrs.update({"beam_mode": "inspection", "conversion_equation_type": np.int8(2)})
    group.dimensions = {"ping_time": rows, "beam": count, "subbeam": 1, "tx_beam": sent.beams}
    names = group.create_variable("beam", ("beam",), h5py.string_dtype())
    names.attrs["long_name"] = "Beam name"
    names[:] = np.array(beams.names, object)
    seconds = np.asarray(tree["time"].values)
    time = np.rint(1e9 * (seconds[frames] - min(float(np.nanmin(seconds)), 0.0))).astype(np.uint64)  # has no sign
    group.create_variable("ping_time", ("ping_time",), np.uint64, data=time).attrs.update(_TIME)
    ragged = group.create_vltype(np.float32, "sample_t")
    samples = group.create_variable("backscatter_r", ("ping_time", "beam", "subbeam"), ragged)
    samples.attrs.update({"long_name": beams.long_name, "units": beams.units})
    start = np.zeros((rows, 1), np.float32)
    for row, frame in enumerate(frames.tolist()):
        values, start[row] = beams.samples(frame)
        cells = np.empty((count, 1), object)
        cells[:, 0] = list(values)
        samples[row] = cells
    _enumerated(group, "beam_stabilisation", kinds, "beam_stabilisation_t", ("ping_time",), 0)
    _enumerated(group, "beam_type", kinds, "beam_t", (), 0)
    _enumerated(group, "transmit_type", kinds, "transmit_t", ("ping_time", "tx_beam"), sent.kind)
    processing = group.create_variable(
        "non_quantitative_processing", ("ping_time",), np.int16, data=np.zeros(rows, np.int16)
    )
    processing.attrs.update({"flag_meanings": "no_non_quantitative_processing", "flag_values": np.array([0], np.int16)})
    _transducers(tree, group, beams, sent)
    for name, (dims, values, units) in _numbers(tree, frames, beams, start, sent).items():
        shape = tuple(group.dimensions[dim].size for dim in dims)
        data = np.broadcast_to(np.asarray(values), shape)
        precise = np.float64 if name in ("platform_latitude", "platform_longitude") else np.float32
        _put(group, name, dims, data.astype(precise), units, name.replace("_", " "))


def _enumerated(group: Any, name: str, kinds: dict[str, Any], kind: str, dims: tuple[str, ...], number: Any) -> None:
    """A variable of words of the convention, by numbers that broadcast to its shape; a number that stands for nothing
    where these are masked, which readers mask too."""
    shape, values = tuple(group.dimensions[dim].size for dim in dims), np.ma.array(number, np.int8)
    nothing = np.int8(max(set(_ENUMS[kind].values()) - set(values.compressed().tolist()), default=0))
    variable = group.create_variable(name, dims, kinds[kind], fillvalue=nothing)
    variable[...] = np.broadcast_to(values.filled(nothing), shape)


def _transducers(tree: xr.DataTree, group: Any, beams: ReceiveBeams, sent: TransmitBeams) -> None:
    """Which transducers of `/Platform` hear each hydrophone's beam, and send the transmit beams."""
    hydrophones, pings = len(_hydrophones(tree)), len(group["ping_time"])
    if beams.units == "Pa":
        index = np.arange(hydrophones, dtype=np.int32)
        group.create_variable("receive_transducer_index", ("beam",), np.int32, data=index)
    if len(sent.position):
        index = np.tile(np.arange(hydrophones, hydrophones + sent.beams, dtype=np.int32), (pings, 1))
        group.create_variable("transmit_transducer_index", ("ping_time", "tx_beam"), np.int32, data=index)


def _numbers(
    tree: xr.DataTree, frames: np.ndarray, beams: ReceiveBeams, start: np.ndarray, sent: TransmitBeams
) -> dict[str, tuple[tuple[str, ...], Any, str]]:
    """Numeric variables of a group of beams: dimensions, values, units."""
    truth = tree["truth"].dataset.isel(frame=frames)
    position = np.asarray(truth["sonar_position"].values)
    heading, pitch, roll = heading_pitch_roll(np.asarray(truth["sonar_orientation"].values))
    latitude, longitude = latitude_longitude(position)
    phi, theta = beam_rotation(beams.azimuth, beams.elevation)
    ping, beam, sending = ("ping_time",), ("ping_time", "beam"), ("ping_time", "tx_beam")
    wide, high = beams.azimuth_width, beams.elevation_width
    disc = (2.0 / 1.03) ** 2 * np.deg2rad(wide) * np.deg2rad(high) / np.pi  # 1.03 lambda/D across: lambda^2/area
    return {
        "beamwidth_receive_major": (beam, wide, "arc_degree"),
        "beamwidth_receive_minor": (beam, high, "arc_degree"),
        "blanking_interval": (beam, 0.0, "s"),
        "equivalent_beam_angle": (beam, np.minimum(disc, 4.0 * np.pi), "sr"),  # received alone
        "platform_heading": (ping, heading, "degrees_north"),
        "platform_latitude": (ping, latitude, "degrees_north"),
        "platform_longitude": (ping, longitude, "degrees_east"),
        "platform_pitch": (ping, pitch, "arc_degree"),
        "platform_roll": (ping, roll, "arc_degree"),
        "platform_vertical_offset": (ping, -position[:, 2], "m"),
        "rx_beam_rotation_phi": (beam, phi, "arc_degree"),
        "rx_beam_rotation_theta": (beam, theta, "arc_degree"),
        "rx_beam_rotation_psi": (beam, 0.0, "arc_degree"),
        "sample_interval": (ping, beams.interval, "s"),
        "sample_time_offset": (sending, -start, "s"),  # subtracted from the time of each sample
        **{name: (sending, values, units) for name, (values, units) in sent.numbers.items()},
    }


def _put(group: Any, name: str, dims: tuple[str, ...], values: Any, units: str, long_name: str) -> None:
    """A variable with its attributes."""
    variable = group.create_variable(name, dims, values.dtype, data=values)
    variable.attrs.update({"units": units, "long_name": long_name})
