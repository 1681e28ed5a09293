"""Snaps louder than the full scale of a converter, and echoes fainter than its counts: plans forecast them; what is cut
off moves the time of snaps, and predicted errors hold it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth import plan, render
from sonarsynth.conventions import REFERENCE_PRESSURE
from sonarsynth.environment.noise.flat_noise import FlatNoise
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.motion import Line
from sonarsynth.planning.measured.converter_levels import peak
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging import SensorDelays
from sonarsynth.receiver import Converter, PlanarLattice, Sonar, elements
from sonarsynth.receiver.sensor_errors import SensorErrors
from sonarsynth.recipe import Recipe
from sonarsynth.signals.electronics import convert
from sonarsynth.state import Receiver, Survey
from tests.heard import envelope_late, hear_direct
from tests.scenes import remus

C = 1540.0
ARRAY = PlanarLattice(columns=12, rows=12, pitch=0.1, face=0.04953)
SOURCES = np.array([[14.0, -5.0, -5.0], [5.0, -2.0, -3.0], [9.0, 3.0, -6.0]])
POSE = Pose(np.array([0.0, 0.0, -40.0]), quaternion(np.pi / 2))


def located(signals: Signals, share: float) -> SourceEstimates:
    """Of signals that the converter clips at a share of their peak."""
    converter = Converter(bits=16, full_scale=share * float(np.abs(signals.pressure).max()))
    sonar = Sonar(array=ARRAY, assumed_sound_speed=C, converter=converter)
    receiver, water = Receiver(POSE, elements(ARRAY), sonar), Profile(np.array([0.0]), np.array([C]))
    return SensorDelays(on_bottom=False).locate(convert(signals, converter), receiver, Survey(60.0, water), 1)


@pytest.mark.parametrize("share", [0.9, 0.8, 0.7, 0.5, 0.3, 0.1])
def test_the_time_of_a_clipped_snap_errs_by_what_is_predicted(share: float) -> None:
    """Over places the error is 0.1 to 2 of what is predicted, root mean square, and nowhere over 3."""
    pulls = []
    for source in SOURCES:
        found = located(hear_direct(elements(ARRAY), source), share)
        late = found.time[0] - np.linalg.norm(source) / C - envelope_late()
        pulls.append(late / found.time_error[0])
    assert 0.1 < np.sqrt(np.mean(np.square(pulls))) < 2.0
    assert np.abs(pulls).max() < 3.0


def test_what_is_not_clipped_adds_nothing() -> None:
    """Nor do other samples that are clipped, far from the snap."""
    signals = hear_direct(elements(ARRAY), SOURCES[0])
    assert located(signals, 1.01).time_error[0] < 3e-9
    signals.pressure[0, -3:] = np.abs(signals.pressure).max() * 1.02
    assert located(signals, 0.99).time_error[0] < 3e-9


def test_a_plan_forecasts_the_frames_that_clip() -> None:
    """A sonar that comes nearer, with gains that err: frames that clip when rendered, and by how much they would."""
    recipe = remus(3, sensor_errors=SensorErrors(gain=1.0))
    approach = Line(start=(0.0, 0.0, -5.0), stop=(4.0, 0.0, -5.0), duration=6.3)
    scene = replace(recipe.scene, trajectory=replace(recipe.scene.trajectory, sonar=approach))

    def at(full_scale: float | None) -> Recipe:
        converter = None if full_scale is None else Converter(bits=24, full_scale=full_scale)
        return replace(recipe, scene=replace(scene, sonar=replace(scene.sonar, converter=converter)))

    analog = [render(at(None), n)["signals/pressure"].values for n in range(3)]
    peaks = np.sort([np.abs(pressure).max() for pressure in analog])
    for clipping, full_scale in ((2, 0.5 * (peaks[0] + peaks[1])), (0, 1.01 * peaks[2])):
        own = at(float(full_scale))
        assert sum(int(render(own, frame)["signals/clipped"]) > 0 for frame in range(3)) == clipping
        lines = [line for line in plan(own, ["signals"]).warnings if "clip" in line]
        excess = 20.0 * np.log10(peaks[2] / full_scale)
        assert len(lines) == (clipping > 0)
        for line in lines:
            assert f"in {clipping} of 3 frames" in line
            assert float(line.split("up to ")[1].split(" dB")[0]) == pytest.approx(excess, abs=0.08)


def test_a_plan_says_which_echoes_the_converter_rounds_to_nothing() -> None:
    """Under half a count, where images are empty; of a few counts; and nothing where they have many, or noise."""
    recipe, environment = remus(1), remus(1).scene.world.environment
    loudest = peak(plan(recipe), recipe.frame(0)[1], echoes=True)

    def at(counts: float, noise: FlatNoise | None = None) -> Recipe:
        converter = Converter(bits=16, full_scale=loudest / counts * 2**15)
        world = replace(recipe.scene.world, environment=replace(environment, noise=noise))
        scene = replace(recipe.scene, world=world, sonar=replace(recipe.scene.sonar, converter=converter))
        return replace(recipe, scene=scene)

    for counts, empty in ((0.49, True), (0.52, False)):
        assert (float(render(at(counts), 0)["image/energy"].max()) == 0.0) is empty
        (line,) = (line for line in plan(at(counts)).warnings if line.startswith("echoes peak at"))
        assert ("nothing of them is recorded" in line) is empty and f"{counts:.2g} counts" in line
    silent = render(at(1e-6), 0)
    assert not silent["signals/pressure"].values.any()
    assert any(
        line.startswith("snaps are under half a count of the converter in 1 of 1") for line in plan(at(1e-6)).warnings
    )
    heard = FlatNoise(level=float(20.0 * np.log10(loudest / 0.49 / REFERENCE_PRESSURE) - 10.0 * np.log10(80e3)))
    for recorded in (at(20.0), at(0.49, heard)):
        assert not any(line.startswith("echoes peak at") for line in plan(recorded).warnings)


@pytest.mark.parametrize(("crest", "clips"), [(3.9, True), (7.0, False)])
def test_a_plan_says_that_noise_clips(crest: float, clips: bool) -> None:
    """Where its peaks are over full scale: 4 times its rms is in every frame, 7 times in none of a thousand."""
    recipe, level = remus(1), 140.0
    rms = 1e-6 * 10.0 ** (level / 20.0) * np.sqrt(recipe.scene.sonar.band.high - recipe.scene.sonar.band.low)
    environment = replace(recipe.scene.world.environment, noise=FlatNoise(level=level))
    world = replace(recipe.scene.world, environment=environment, sources=())
    sonar = replace(recipe.scene.sonar, converter=Converter(bits=16, full_scale=float(crest * rms)))
    own = replace(recipe, scene=replace(recipe.scene, world=world, sonar=sonar))
    assert any("clips in every frame" in line for line in plan(own, ["signals"]).warnings) is clips
    assert (int(render(own, 0)["signals/clipped"]) > 0) is clips
