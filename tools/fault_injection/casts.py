"""Random changes of the other files that recipes name: casts, Bellhop's environments, tracks, recordings."""

from __future__ import annotations

import gzip
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from fault_injection.fuzz import judged
from fault_injection.recipes import (
    Case,
    by_file,
    by_structure,
    cast_file,
    damaged,
    lines_changed,
    numbers,
    pick,
    snap_files,
)

RECIPE = """\
title: files
seed: 3
scene:
  world:
    environment: {{depth: 12 m, sound_speed: {speed}, noise: {noise}}}
    relief: {relief}
    noise_sources: {ships}
    targets:
      - name: body
        shape: {shape}
        motion: {motion}
    sources:
      - position: [12, 8]
        kind: snapping_shrimp
        {snap}
  sonar:
    array: {{kind: planar_lattice, columns: 5, rows: 4, pitch: 5 cm}}
    beams: {{azimuths: 11, elevations: 9, azimuth_span: 30 deg, elevation_span: 30 deg}}
  trajectory: {{frames: 2, interval: 0.5}}
  processing: {{beamforming: {{kind: focused, focus: 10 m}}}}
"""
USUAL = {
    "shape": "{kind: sphere, radius: 0.3 m}",
    "speed": "{kind: isovelocity, speed: 1540}",
    "motion": "{kind: line, start: [10, 0, -5], stop: [10, 1, -5], duration: 1}",
    "snap": "source_level: 190 dB",
    "noise": "{kind: flat, level: 40 dB}",
    "ships": "[]",
    "relief": "null",
}
ENVIRONMENT = """\
'A shelf'
50000.0
1
'CVWF'
27 35 8.1 5
3 0.0 12.0
0.0 1540.0 /
6.0 1541.0 /
12.0 1530.0 /
'A' 0.0
12.0 1800.0 0.0 1.8 0.5 0.0 /
"""
RANGES = "3\n0.0 0.5 1.0\n1540 1541 1542\n1541 1541 1541\n1530 1529 1528\n"
BOTTOMS = {
    "slope.bty": "'L'\n3\n0.015 12\n0.016 10.5\n0.018 12\n",
    "hill.bty": "'R'\n3\n0.015 0.018 /\n2\n-0.001 0.001\n12 10 12\n12 11 12\n",
}
ODD_LINES = (
    b"'", b'"', b"/", b"1e9 /", b"1 1e300 /", b"0 0 0", b"'QVW'", b"'CVWB'", b"1000000000", b"nan,nan,nan,nan", b",,,,",
    b"2024-05-01T10:00:00Z,1,2,3", b"time,lat,lon", b"t,x,y,z", b"Depth (m),Sound speed (m/s)", b"*END*", b"# name 0 =",
    b'<!DOCTYPE x [<!ENTITY a "b">]>', b"<trkpt>", b"</trkseg>", b'<trkpt lat="99" lon="1e9"/>', b"<a>" * 3000, b"\0",
    b"\xff", b"5*1.0", b"1.5D400", b"0.0 10.0", b"2", b"'R'", b"'C'",
)  # fmt: skip


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Judge so many changed files. Returns what came of them."""
    return judged(bases(), mutated, count, seed, folder)


CAST, NOISE, SNAP = (
    "{{kind: cast, path: {}}}",
    "{{kind: recording, path: {}}}",
    "{{kind: recorded_snap, path: {}, fade: 0.1}}",
)
RELIEF = "{{shape: {{path: {}, offset: [0, 0, 12], edge: 1 m}}}}"
SOURCE = "[{{name: ship, motion: {{kind: still, position: [9, 3, -4]}}, sound: {{kind: noise_recording, path: {}}}}}]"


def casts() -> dict[str, bytes]:
    """A cast as each family of readers has it: names in a head, columns by place, Sea-Bird, packed, netCDF."""
    depth = np.linspace(0.2, 24.0, 40)
    speed, warm = 1511.9 - 0.05 * depth, 16.5 - 0.02 * depth
    columns = "depSM: Depth [salt water, m]", "t090C: Temperature [ITS-90, deg C]", "sal00: Salinity, Practical"
    names = "\n".join(f"# name {n} = {column}" for n, column in enumerate(columns))
    rows = "".join(f"{z:11.3f}{t:11.4f}{35.6:11.4f}\n" for z, t in zip(depth, warm, strict=True))
    head = f"* Sea-Bird SBE 9\n# nquan = 3\n{names}\n# bad_flag = -9.990e-29\n# file_type = ascii"
    pairs = "".join(f"{z:.2f} {c:.2f}\n" for z, c in zip(depth, speed, strict=True))
    asvp = f"( SoundVelocity  1.0 0 201203212242 22.5 -156.5 -1 0 0 OMS P {len(depth)} )\n{pairs}"
    edf = f"// MK21 Export Data File\nDepth (m)  - Sound Velocity (m/s)\n// Data\n{pairs}"
    table = xr.Dataset({"TEMP": ("N_LEVELS", warm), "PSAL": ("N_LEVELS", 35.6 + 0 * warm), "PRES": ("N_LEVELS", depth)})
    return {
        "cast.cnv": f"{head}\n*END*\n{rows}".encode(),
        "cast.asvp": asvp.encode(),
        "cast.edf": edf.encode(),
        "cast.csv.gz": gzip.compress(cast_file(), mtime=0),
        "cast.nc": bytes(table.to_netcdf(engine="scipy")),
    }


def bases() -> list[Case]:
    """A recipe with one file of each kind."""
    rows = "".join(f"{t},{10 + 0.2 * t},{0.3 * t},{5 + 0.1 * t},{80 + t}\n" for t in range(6))
    point = '<trkpt lat="{}" lon="{}"><ele>-4</ele><time>2024-05-01T10:00:0{}Z</time></trkpt>\n'
    points = "".join(point.format(1.2 + 1e-6 * t, 103.8 + 2e-6 * t, t) for t in range(6))
    found = [
        ("cast.csv", "speed", CAST, cast_file()),
        ("shelf.env", "speed", CAST, ENVIRONMENT.encode()),
        *((name, "speed", CAST, data) for name, data in casts().items()),
        ("sea.wav", "noise", NOISE, snap_files()["snap.wav"]),
        ("sea.h5", "noise", NOISE, _hdf5()),
        ("ship.wav", "ships", SOURCE, snap_files()["snap.wav"]),
        ("way.csv", "motion", "{{kind: track, path: {}}}", f"time (s),x,y,depth (m),heading\n{rows}".encode()),
        (
            "way.gpx",
            "motion",
            "{{kind: track, path: {}, offset: [10, 0, 0]}}",
            f'<?xml version="1.0"?>\n<gpx><trk><trkseg>\n{points}</trkseg></trk></gpx>\n'.encode(),
        ),
        ("snap.h5", "snap", f"snap: {SNAP}", _hdf5()),
        *((name, "snap", f"snap: {SNAP}", data) for name, data in snap_files().items()),
    ]
    found += [(name, "relief", RELIEF, text.encode()) for name, text in BOTTOMS.items()]
    cases = [
        Case(name, RECIPE.format(**USUAL | {field: text.format(name)}).encode(), {name: data})
        for name, field, text, data in found
    ]
    ranges = {"gulf.env": ENVIRONMENT.replace("'CVWF'", "'QVWF'").encode(), "gulf.ssp": RANGES.encode()}
    return [*cases, Case("gulf", RECIPE.format(**USUAL | {"speed": CAST.format("gulf.env")}).encode(), ranges)]


def _hdf5() -> bytes:
    t = (np.arange(400) - 120) * 2e-6
    file = io.BytesIO()
    with h5py.File(file, "w") as made:
        made["snap"] = 2e3 * (1 - (t / 8e-6) ** 2) * np.exp(-0.5 * (t / 8e-6) ** 2)
        made["snap"].attrs["sampling_frequency"] = 5e5
    return file.getvalue()


odd_lines = lines_changed(ODD_LINES)


def mutated(case: Case, random: np.random.Generator) -> Case:
    """The case with its file changed once to three times; now and then its recipe too, or the path to it."""
    name = pick(sorted(case.files), random)
    ways = (
        [damaged] if name.endswith((".h5", ".wav", ".nc", ".gz")) else [numbers, numbers, odd_lines, odd_lines, damaged]
    )
    for _ in range(pick((1, 1, 2, 3), random)):
        changed = pick(ways, random)(case.files[name], random)
        case = replace(case, files=case.files | {name: changed}, done=(*case.done, "file"))
    if random.random() < 0.1:
        case = by_structure(case, random)
    return by_file(case, random) if random.random() < 0.1 else case
