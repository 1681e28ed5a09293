"""Where sources are, whether noises can be read and are of the band, and where their formulas do not hold."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import FieldError
from sonarsynth.description.method import returned
from sonarsynth.environment.noise import Noise
from sonarsynth.geometry.motion import pose, velocity
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.sources.noise_source import NoiseRecording

INSTANT = 1e-9
"""s: between samples of a recording, to read it alone."""


def check_noises(scene: Scene) -> None:
    """Each noise must have a density in the middle of the band: its file may be broken, or of other frequencies.

    Raises FieldError.
    """
    centre = scene.sonar.band.centre
    for path, noise in _noises(scene):
        try:
            if isinstance(noise, NoiseRecording):
                noise.segment(0.0, INSTANT, 1)
                continue
            band = np.linspace(scene.sonar.band.low, scene.sonar.band.high, 17)
            returned(noise, "density", noise.density(band), band.shape)
            if not noise.correlated and not noise.density(np.array([centre]))[0] > 0.0:
                said = "; ".join(noise.validity(scene.sonar.band.low, scene.sonar.band.high))
                raise ValueError(
                    f"holds nothing of the middle of the band, {centre:g} Hz" + (f": {said}" if said else "")
                )
        except ValueError as error:
            raise FieldError(path, str(error)) from None


def source_places(scene: Scene, frame: Frame) -> Iterator[tuple[tuple[str | int, ...], Floats, Floats]]:
    """The field that says where a source of snaps or of noise is in a frame, its place (xyz) m and velocity m/s."""
    owners = [i for i, source in enumerate(scene.world.sources) for _ in source.times]
    for i, snap in zip(owners, frame.moment.snaps, strict=True):
        yield ("scene", "world", "sources", i, "position"), snap.position, snap.velocity
    for i, source in enumerate(scene.world.noise_sources):
        place = pose(source.motion, frame.time).position
        yield ("scene", "world", "noise_sources", i, "motion"), place, velocity(source.motion, frame.time)


def noise_notes(scene: Scene) -> Iterator[str]:
    """Where the formulas of noises do not hold in the band, one line each with its field."""
    band = scene.sonar.band
    for path, noise in _noises(scene):
        if not isinstance(noise, NoiseRecording):
            yield from (f"{'.'.join(map(str, path))}: {note}" for note in noise.validity(band.low, band.high))


def _noises(scene: Scene) -> Iterator[tuple[tuple[str | int, ...], Noise | NoiseRecording]]:
    """Each noise of a scene, and where it is in the recipe."""
    environment = scene.world.environment
    for i, noise in enumerate(environment.noises):
        several = (i,) if isinstance(environment.noise, tuple) else ()
        yield ("scene", "world", "environment", "noise", *several), noise
    for i, source in enumerate(scene.world.noise_sources):
        yield ("scene", "world", "noise_sources", i, "sound"), source.sound
