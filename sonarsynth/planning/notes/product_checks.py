"""Whether a scene has what the products asked for need: sources that can be located, windows, ranges, and memory."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import format_bytes
from sonarsynth.description import FieldError
from sonarsynth.description.memory import frame_bytes, free_bytes
from sonarsynth.planning.choices import OF_BEAMS
from sonarsynth.planning.plans import Windows
from sonarsynth.receiver import elements
from sonarsynth.recipe.scene import Frame, Scene


def check_located(scene: Scene, frame: Frame, products: frozenset[str]) -> None:
    """No source is so near that it cannot be located, where image or cloud need that."""
    least = scene.processing.locating.nearest(elements(scene.sonar.array))
    owners = [i for i, source in enumerate(scene.world.sources) for _ in source.times]
    for owner, snap in zip(owners, frame.moment.snaps, strict=True):
        away = float(np.linalg.norm(snap.position - frame.sonar_pose.position))
        if away < least and products & OF_BEAMS:
            raise FieldError(
                ("scene", "world", "sources", owner, "position"),
                f"is {away:.3g} m from the centre of the array at frame {frame.index}, among its hydrophones, which "
                f"reach {least:.3g} m: no image without its position; where the "
                "sonar knows it, set scene.processing.locating: {kind: trigger}",
            )


def check_methods(scene: Scene, products: frozenset[str]) -> None:
    """The beamformer must be able to use the array, and a range image needs ranges."""
    if "range_image" in products and scene.sonar.ranges is None:
        raise FieldError(("scene", "sonar", "ranges"), "is left out: a range image needs near, far and step")
    line = scene.processing.beamforming.refusal(elements(scene.sonar.array))
    if line and products & OF_BEAMS:
        raise FieldError(("scene", "processing", "beamforming", "kind"), line)


def check_windows(scene: Scene, windows: Windows) -> None:
    """The echo window must hold a period of the band, and a frame must fit in the memory that is free here."""
    path = ("scene", "processing", "echo_window")
    length, period = windows.echo_duration, 1.0 / scene.sonar.band.high
    if length < period:
        raise FieldError(path, f"is {length:.3g} s long, less than a period of the highest frequency, {period:.3g} s")
    sensors, facets = elements(scene.sonar.array).count, sum(len(mesh.faces) for mesh in scene.meshes)
    needed, free = frame_bytes(facets, sensors * windows.samples, scene.parts_kept), free_bytes()
    if needed > max(free, frame_bytes(facets, 0)):  # meshes are checked by themselves
        seconds = windows.samples / scene.sonar.sampling_frequency
        raise FieldError(
            path,
            f"a frame would take {format_bytes(needed)} of memory, and {format_bytes(free)} are free here "
            f"({sensors} hydrophones for "
            f"{seconds:.3g} s): the arrivals are too far apart in time",
        )
