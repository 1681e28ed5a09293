"""A first recipe as text: what a few answers make of it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

SHAPES = {
    "remus100": "{{kind: remus100, edge: 18 mm}}",
    "sphere": "{{kind: sphere, radius: {size:.3g} m}}",
    "cylinder": "{{kind: cylinder, radius: {size:.3g} m, length: {length:.3g} m}}",
    "box": "{{kind: box, size: [{length:.3g} m, {size:.3g} m, {size:.3g} m]}}",
}
"""Shapes that are asked for by name; anything else is a mesh file."""
INTERVAL, SPEED = 0.1, 1.4
"""s from frame to frame, and m/s of the target, at most."""


@dataclass(frozen=True)
class Answers:
    """What a first recipe is made of."""

    title: str = "A REMUS-100 crossing ahead"
    depth: float = 10.0
    """m, of the water."""
    water: float | str = 1540.0
    """Sound speed (m/s), or the file of a cast, relative to the recipe."""
    target: str = "remus100"
    """One of SHAPES, or a mesh file, relative to the recipe."""
    range: float = 20.0
    """m, from the array to the middle of the target's track."""
    array: tuple[int, int] | None = (20, 16)
    """Columns and rows, 5 cm apart; None: the 508 hydrophones of ROMANIS."""
    frames: int = 8
    seed: int = 1


DEFAULTS = Answers()


def recipe_text(answers: Answers, file: Path) -> str:
    """The recipe of some answers, as YAML with comments; `file` is where it will be."""
    a = answers
    size = min(0.3, 0.1 * a.depth)
    cast = isinstance(a.water, str)
    water = f"{{kind: cast, path: {json.dumps(a.water)}}}" if cast else f"{{kind: isovelocity, speed: {a.water:g} m/s}}"
    shape = SHAPES.get(a.target, f"{{{{kind: mesh_file, path: {json.dumps(a.target)}}}}}")
    shape = shape.format(size=size, length=4.0 * size) if a.target in SHAPES else shape[1:-1]
    array = "{kind: romanis}"
    if a.array is not None:
        array = f"{{kind: planar_lattice, columns: {a.array[0]}, rows: {a.array[1]}, pitch: 5 cm}}"
    duration = a.frames * INTERVAL
    half = min(0.5 * SPEED * duration, 0.3 * a.range)  # the track stays in the field of view
    return TEMPLATE.format(
        command=file.name,
        stem=file.stem,
        title=json.dumps(a.title, ensure_ascii=False),
        seed=a.seed,
        depth=f"{a.depth:g}",
        water=water,
        shape=shape,
        start=f"[{a.range:g}, {half:.4g}, {-0.45 * a.depth:.4g}]",
        stop=f"[{a.range:g}, {-half:.4g}, {-0.45 * a.depth:.4g}]",
        duration=f"{duration:g}",
        snap=f"[{0.7 * a.range:.4g}, {-0.25 * a.range:.4g}]",
        array=array,
        assumed="" if cast else f"\n    assumed_sound_speed: {a.water:g} m/s",
        frames=a.frames,
        interval=f"{INTERVAL:g}",
        sonar=f"{-0.5 * a.depth:.4g}",
        refraction=", refraction: true" if cast else "",
        focus=f"{a.range:g}",
    )


def array_of(text: str) -> tuple[int, int] | None:
    """An array as Answers has it, of "romanis" or "20x16". Raises ValueError."""
    if text.strip().lower() == "romanis":
        return None
    columns, rows = (int(number) for number in text.lower().split("x"))
    if not (1 <= columns <= 256 and 1 <= rows <= 256):
        raise ValueError("from 1x1 to 256x256")
    return columns, rows


def positive(text: str) -> float:
    """A number of metres or metres per second over 0. Raises ValueError."""
    value = float(text.strip().removesuffix("m/s").removesuffix("m"))
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError("over 0")
    return value


TEMPLATE = """\
# Look at it, ask what it will take, build it:
#   sonarsynth preview {command}
#   sonarsynth plan {command}
#   sonarsynth build {command} {stem}.zarr
title: {title}
seed: {seed}                         # of everything that is drawn at random

scene:
  world:
    environment:
      depth: {depth} m
      sound_speed: {water}
      noise: {{kind: flat, level: 30 dB}}   # dB re 1 uPa2/Hz
    targets:
      - name: target
        shape: {shape}
        motion:                   # x is east, y north, z up from the surface; the sonar looks east
          kind: line
          start: {start}
          stop: {stop}
          duration: {duration} s
    sources:
      - {{kind: snapping_shrimp, name: shrimp, position: {snap}}}  # on the bottom
  sonar:
    array: {array}
    beams: {{azimuth_span: 50 deg, azimuths: 101, elevation_span: 50 deg, elevations: 101}}{assumed}
  trajectory:
    frames: {frames}
    interval: {interval} s
    sonar: {{kind: still, position: [0, 0, {sonar}], heading: 90 deg}}
  processing:
    locating: {{kind: sensor_delays{refraction}}}
    beamforming: {{kind: focused, focus: {focus} m}}

# More than one sequence: take the marks away.
# variations:
#   - {{name: shrimp_y, path: scene.world.sources.0.position.1, kind: uniform, low: -8 m, high: 8 m}}
# repeats: 10
# splits: {{train: 0.8, validation: 0.1, test: 0.1}}
"""
