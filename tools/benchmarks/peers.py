"""The peers that the benchmarks measure against: the thesis's imaging loop, and Acoular's BeamformerTime."""

from __future__ import annotations

import time
import warnings

import numpy as np

from sonarsynth.conventions import direction
from sonarsynth.planning import Plan
from sonarsynth.products import Arrivals, Signals


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
    warnings.simplefilter("ignore")
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
