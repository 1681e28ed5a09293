"""Other programs in the place of our imaging, on the same signals and against the same exact image: the thesis's loop,
and Acoular's BeamformerTime. Errors are whatever the scale of the image."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np
from scipy.fft import irfft

from sonarsynth.conventions import Floats, direction
from sonarsynth.frontiers.image_knobs import image_of, imaged
from sonarsynth.frontiers.rows import Point
from sonarsynth.imaging import DenseDelayAndSum
from sonarsynth.pipeline import BeamformedFrame
from sonarsynth.planning import Plan
from sonarsynth.products import Arrivals, Signals
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.filtered_pulse import pulse_spectrum, pulse_support
from sonarsynth.signals.segments import fast_length
from sonarsynth.state import Emission

THESIS_BEAMS = 24
"""Bright beams that the thesis's loop is timed on."""


def image_peers(plan: Plan, frame: Frame, arrivals: Arrivals, beamformed: BeamformedFrame) -> Iterator[Point]:
    """A row for each of the two; nothing where the frame has no image."""
    if not imaged(beamformed):
        return
    assert beamformed.image is not None and beamformed.imaged is not None
    sonar, focus = plan.scene.sonar, getattr(plan.choices.beamforming, "focus", None)
    slow = DenseDelayAndSum(focus=focus, shading="uniform")
    exact = np.asarray(image_of(plan, beamformed, slow).energy, float)
    bright = np.flatnonzero(exact.ravel() >= 0.01 * exact.max())
    beams = bright[np.linspace(0, len(bright) - 1, min(THESIS_BEAMS, len(bright))).astype(int)]
    if len(beams) > 1 and (~arrivals.direct).any():
        pulse = thesis_pulse(frame.moment.snaps[0], plan)
        energy, seconds = thesis_image(plan, arrivals, pulse, sonar.sampling_frequency, beams, sonar.band.centre)
        note = f"cost from {len(beams)} beams; whatever the scale"
        of_all = seconds * exact.size / len(beams)
        yield _row(plan, "the thesis's loop", "every ray, every beam", energy, exact.ravel()[beams], of_all, note)
    if find_spec("acoular") is None:
        nothing = float("nan")
        yield Point(
            "image", "Acoular", "not installed", nothing, "", nothing, nothing, role="peer", note="not installed"
        )
        return
    start, stop = beamformed.image.start, beamformed.image.stop
    energy, seconds = acoular_image(plan, beamformed.imaged, start, stop, focus or 1e6)
    yield _row(plan, "Acoular", "BeamformerTime", energy, exact, seconds, "whatever the scale")


def _row(plan: Plan, name: str, setting: str, image: np.ndarray, exact: np.ndarray, seconds: float, note: str) -> Point:
    """How far an image is from the exact one: over the beams within 20 dB of the peak."""
    bright = exact >= 0.01 * exact.max()
    decibels = 10 * np.log10(image[bright] / exact[bright])
    return Point(
        stage="image",
        knob=name,
        setting=setting,
        error=float(np.std(decibels)),
        unit="dB",
        allowed=plan.recipe.accuracy.image_db,
        seconds=seconds,
        role="peer",
        also={
            "largest_db": float(np.abs(decibels - np.mean(decibels)).max()),
            "correlation": float(np.corrcoef(image[bright], exact[bright])[0, 1]),
        },
        note=note,
    )


def thesis_pulse(snap: Emission, plan: Plan) -> Floats:
    """The snap (sample,) as the thesis's loop places it: through the filter, at the sonar's rate."""
    sonar = plan.scene.sonar
    before, after = pulse_support(snap.waveform, sonar.antialias)
    length = fast_length(int(2.0 * max(before, after) * sonar.sampling_frequency) + 2)
    _, spectrum = pulse_spectrum(snap.waveform, sonar.antialias, sonar.sampling_frequency, length, 0.0)
    return np.asarray(np.roll(irfft(spectrum, length) * sonar.sampling_frequency, length // 2))


def thesis_image(
    plan: Plan, arrivals: Arrivals, pulse: np.ndarray, rate: float, beams: np.ndarray, frequency: float
) -> tuple[np.ndarray, float]:
    """Energy (beam,) of the beams numbered `beams` by the thesis's loop, and its seconds.

    Each beam, each ray: the array factor at one frequency for (arrival direction, steered direction), times the snap
    scaled by the ray's amplitude and shifted by its delay to the nearest sample; summed; squared and summed. The matrix
    is as short as the spread of the delays allows, as the thesis has it.
    """
    sonar, sensors = plan.scene.sonar, plan.elements
    grid = sonar.beams
    look = direction(grid.azimuth[None, :], grid.elevation[:, None]).reshape(-1, 3)[beams]
    echoes = arrivals.select(~arrivals.direct)
    shift = np.rint((echoes.delay - echoes.delay.min()) * rate).astype(int)
    wavenumber = 2 * np.pi * frequency / sonar.assumed_sound_speed
    energy = np.empty(len(beams))
    began = time.process_time()
    for b, u in enumerate(look):
        total = np.zeros(shift.max() + len(pulse))
        for ray in range(len(shift)):
            phase = wavenumber * (sensors.position @ (echoes.direction[ray] - u))
            factor = abs(np.exp(1j * phase).sum()) / sensors.count
            total[shift[ray] : shift[ray] + len(pulse)] += factor * echoes.amplitude[ray] * pulse
        energy[b] = np.sum(total * total) / rate
    return energy, time.process_time() - began


def acoular_image(plan: Plan, signals: Signals, start: float, stop: float, focus: float) -> tuple[np.ndarray, float]:
    """Energy (elevation, azimuth) by Acoular's BeamformerTime on the echo window of the same signals, and its seconds.

    It delays by whole travel times from the grid, so as much silence goes before the window; linear interpolation.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return _acoular_image(plan, signals, start, stop, focus)


def _acoular_image(plan: Plan, signals: Signals, start: float, stop: float, focus: float) -> tuple[np.ndarray, float]:
    import acoular

    acoular.config.global_caching = "none"
    sonar, grid = plan.scene.sonar, plan.scene.sonar.beams
    rate, position = signals.sampling_frequency, plan.elements.position
    first, last = (round((t - signals.start) * rate) for t in (start, stop))
    points = (focus * direction(grid.azimuth[None, :], grid.elevation[:, None])).reshape(-1, 3)
    travel = np.array([np.linalg.norm(points - q, axis=1) for q in position]) / sonar.assumed_sound_speed * rate
    before, spread = int(travel.min()) - 1, int(np.ceil(np.ptp(travel))) + 3
    data = np.zeros((before + last - first + spread, len(position)))
    data[before : before + last - first] = signals.pressure[:, first:last].T
    beamformer = acoular.BeamformerTime(
        source=acoular.TimeSamples(data=data, sample_freq=rate),
        steer=acoular.SteeringVector(
            grid=acoular.ImportGrid(pos=points.T),
            mics=acoular.MicGeom(pos_total=position.T),
            env=acoular.Environment(c=sonar.assumed_sound_speed),
            steer_type="classic",
        ),
    )
    next(beamformer.result(128))  # compiles
    began = time.process_time()
    energy = np.zeros(len(points))
    for block in beamformer.result(128):
        energy += np.sum(np.square(block), axis=0)
    seconds = time.process_time() - began
    return (energy / rate).reshape(grid.elevations, grid.azimuths), seconds
