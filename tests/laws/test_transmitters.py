"""A sonar's own transmitter: where it is, where it sends, what it sends, and what becomes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sonarsynth import FieldError, build, render
from sonarsynth.conventions import Floats, direction
from sonarsynth.equations.bubble import pulses
from sonarsynth.geometry.motion import Circle, ConstantVelocity, Motion, Still, pose
from sonarsynth.imaging import FocusedDelayAndSum
from sonarsynth.planning import plan
from sonarsynth.planning.notes.source_notes import out_of_band
from sonarsynth.ranging import SensorDelays
from sonarsynth.ranging.location.triggered import Triggered
from sonarsynth.receiver import Band, BandPass, BeamGrid, PlanarLattice, elements
from sonarsynth.recipe import Recipe
from sonarsynth.scattering import Isotropic
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.sources.snap_models import Gabor
from sonarsynth.sources.transmitter import Sweep, TransmitBeam, Transmitter
from sonarsynth.store import folder_of
from sonarsynth.store.cards.facts import facts_of
from tests.scenes import point_scene

SWEEP = Sweep(start=40e3, stop=80e3, duration=2e-3)
TONE = Gabor(frequency=60e3, cycles=10.0)
BEAM = TransmitBeam(azimuth_width=np.deg2rad(60), elevation_width=np.deg2rad(30), azimuth=0.2, elevation=-0.1)
AT = (0.1, 0.05, -0.3)
TARGET = (30.0, 2.0, -51.0)
C = 1500.0


def scene(
    transmitter: Transmitter, motion: Motion | None = None, target: tuple[float, float, float] = TARGET
) -> Recipe:
    """A point in deep water, and a sonar that knows when and where it sends."""
    band = {"band": Band(low=38e3, high=82e3), "filter": BandPass(low=38e3, high=82e3)}
    beams = BeamGrid(azimuth_span=np.deg2rad(20), azimuths=21, elevation_span=np.deg2rad(20), elevations=21)
    array = PlanarLattice(columns=16, rows=12, pitch=0.01, face=0.0)
    recipe = point_scene(target, AT, strength=1e-2, array=array, beams=beams, sound_speed_error=0.0, **band)
    return with_source(recipe, transmitter, motion)


def with_source(recipe: Recipe, source: Any, motion: Motion | None = None) -> Recipe:
    own = recipe.scene
    processing = replace(own.processing, locating=Triggered(time_error=1e-9, position_error=1e-6))
    trajectory = own.trajectory if motion is None else replace(own.trajectory, sonar=motion)
    world = replace(own.world, sources=(source,))
    return replace(recipe, scene=replace(own, world=world, processing=processing, trajectory=trajectory))


def test_at_rest_it_is_a_source_that_stands_there() -> None:
    """Every bit of what is heard, located and ranged."""
    own = scene(Transmitter(position=AT, pulse=TONE, source_level=180.0))
    place = tuple(pose(own.scene.trajectory.sonar, 0.0).to_world(AT).tolist())
    other = with_source(own, SnappingShrimp(position=place, snap=TONE, source_level=180.0))
    ours, theirs = (render(plan(recipe, ["signals", "image", "cloud"]), 0) for recipe in (own, other))
    for name in ("signals/pressure", "image/energy", "cloud/range", "source_estimates/position"):
        np.testing.assert_array_equal(ours[name].values, theirs[name].values)
    assert int(ours["cloud/count"]) == 1


@pytest.mark.parametrize(
    "motion",
    [
        ConstantVelocity(start=(1.0, 2.0, -50.0), heading=0.7, speed=2.0, climb=0.3, pitch=0.1, roll=-0.2),
        Circle(centre=(5.0, 0.0, -40.0), radius=3.0, speed=1.5, pitch=0.2, roll=0.1),
    ],
    ids=lambda m: m.kind,
)
def test_it_goes_and_turns_with_the_sonar(motion: Motion) -> None:
    recipe = scene(Transmitter(position=AT, pulse=SWEEP, source_level=200.0, beam=BEAM, ping_times=(0.0, 0.02)), motion)
    frame, step = recipe.scene.frame(0), 1e-4
    for late, sent in zip((0.0, 0.02), frame.moment.snaps, strict=True):
        before, now, after = (pose(motion, frame.time + late + off) for off in (-step, 0.0, step))
        np.testing.assert_allclose(sent.position, now.to_world(AT), atol=1e-12)
        moved = (after.to_world(AT) - before.to_world(AT)) / (2.0 * step)
        np.testing.assert_allclose(sent.velocity, moved, atol=1e-7)
        assert sent.directivity is not None
        towards = direction(np.linspace(-1.5, 1.5, 7), np.linspace(-0.6, 0.7, 7))
        np.testing.assert_allclose(sent.directivity(now.turn_to_world(towards)), BEAM.pattern(towards), atol=1e-12)


def test_a_beam_has_half_its_power_at_its_widths_and_little_behind() -> None:
    ahead = TransmitBeam(azimuth_width=np.deg2rad(60), elevation_width=np.deg2rad(20), baffle=40.0)
    assert ahead.pattern(direction(0.0, 0.0)) == pytest.approx(1.0, abs=1e-12)
    sides = np.deg2rad([[30.0, 0.0], [-30.0, 0.0], [0.0, 10.0], [0.0, -10.0]])
    assert ahead.pattern(direction(*sides.T)) ** 2 == pytest.approx(0.5, abs=2e-5)
    behind = direction(np.deg2rad([110.0, 180.0, -150.0]), np.array([0.0, 0.0, 0.2]))
    assert 20.0 * np.log10(ahead.pattern(behind)) == pytest.approx(-40.0, abs=1e-9)
    turned = replace(ahead, azimuth=0.3, elevation=-0.2)
    assert turned.pattern(direction(0.3, -0.2)) == pytest.approx(1.0, abs=1e-12)
    assert turned.pattern(direction(0.3, -0.2 + np.deg2rad(10.0))) ** 2 == pytest.approx(0.5, abs=2e-5)
    rim = ahead.pattern(
        direction(0.5 * np.pi + np.array([-1e-7, 1e-7]), np.zeros(2))
    )  # no step at the plane of its face
    assert abs(np.diff(rim)) < 1e-6


def peak(pressure: Floats, rate: float) -> Floats:
    """Peak (hydrophone,) of tones from their energy: peak^2 s sqrt(pi)/2 of a Gaussian of deviation s."""
    deviation = TONE.cycles / TONE.frequency / np.sqrt(8.0 * np.log(2.0))
    return np.asarray(np.sqrt(np.sum(pressure**2, axis=1) / rate / (0.5 * np.sqrt(np.pi) * deviation)))


def test_what_arrives_is_what_the_sonar_equation_says() -> None:
    """SL + 20 lg b + TS - 20 lg r1 r2 of a tone, with one TS on the axis of the beam and beside it; the direct sound is
    SL + 20 lg b - 20 lg r."""
    sonar, strengths = pose(Still(position=(0.0, 0.0, -50.0), heading=0.5 * np.pi), 0.0), []
    sender, place = Transmitter(position=AT, pulse=TONE, source_level=190.0, beam=BEAM), sonar.to_world(AT)
    sent = 10.0 ** (190.0 / 20.0 - 6.0)
    for target in (TARGET, (20.0, -4.0, -54.0), (25.0, 10.0, -46.0)):
        recipe = scene(sender, target=target)
        frame = render(plan(recipe, ["signals"]), 0)
        hydrophones = sonar.to_world(elements(recipe.scene.sonar.array).position)
        pressure = frame["signals/pressure"].values.astype(float)
        rate = recipe.scene.sonar.sampling_frequency
        late = float(frame["signals/start"]) + np.arange(pressure.shape[1]) / rate > 0.02
        out, away = np.array(target) - place, hydrophones - place
        r1, r = np.linalg.norm(out), np.linalg.norm(away, axis=1)
        loud = sent * BEAM.pattern(sonar.turn_to_body(out / r1)) / r1
        r2 = np.linalg.norm(np.array(target) - hydrophones, axis=1)
        strengths.append(peak(pressure[:, late], rate) / (loud / r2))
        direct = sent * BEAM.pattern(sonar.turn_to_body(away / r[:, None])) / r
        assert peak(pressure[:, ~late], rate) == pytest.approx(np.abs(direct), rel=2e-3)
        budget = frame["link_budget/transmission_loss_out"].values[0, :, 0]
        centre = (sonar.position - place) / (r0 := np.linalg.norm(sonar.position - place))
        heard = sent * BEAM.pattern(sonar.turn_to_body(centre)) / r0
        assert budget == pytest.approx(-20.0 * np.log10(np.abs([loud, heard]) / sent), abs=5e-3), "the beam is in it"
        assert "beam of a transmitter" in frame["link_budget/transmission_loss_out"].attrs["long_name"]
    assert np.array(strengths) == pytest.approx(np.mean(strengths), rel=5e-3)


def wave(sweep: Sweep, time: Floats) -> Floats:
    """The same in closed form, at times (sample,) s from its middle."""
    t, length = time + 0.5 * sweep.duration, sweep.duration
    if sweep.law == "linear":
        cycles = sweep.start * t + (sweep.stop - sweep.start) * t**2 / (2.0 * length)
    else:
        k = (1.0 - sweep.start / sweep.stop) / length  # 1/f = (1 - k t)/f1
        cycles = sweep.start * (t if k == 0.0 else -np.log(np.maximum(1.0 - k * t, 1e-9)) / k)
    ends = np.clip(np.minimum(t, length - t) / (0.5 * sweep.taper * length), 0.0, 1.0)
    return np.asarray(np.sin(2.0 * np.pi * cycles) * 0.5 * (1.0 - np.cos(np.pi * ends)))


LAWS = pytest.mark.parametrize("law", ["linear", "hyperbolic"])


@LAWS
@pytest.mark.parametrize(
    ("start", "stop", "length", "taper", "highest"),
    [
        (40e3, 80e3, 2e-3, 0.1, 100e3),
        (70e3, 30e3, 2e-3, 0.1, 100e3),
        (50e3, 50e3, 2e-3, 0.1, 100e3),
        (3.6e3, 3.9e3, 0.4e-3, 0.1, 12e3),  # a cycle and a half: its ends took a sample each, and it was 0.011 off
        (5e3, 8e3, 0.2e-3, 0.02, 30e3),
        (5e3, 8e3, 2e-3, 0.005, 30e3),
    ],
)
def test_a_sweep_has_the_spectrum_of_its_waveform(
    law: Any, start: float, stop: float, length: float, taper: float, highest: float
) -> None:
    sweep = Sweep(start=start, stop=stop, duration=length, law=law, taper=taper)
    f = np.linspace(0.2 * highest, highest, 161)
    step = 5e-5 * length
    time = np.arange(-0.5 * length, 0.5 * length + step, step)
    exact = np.exp(-2j * np.pi * f[:, None] * time) @ wave(sweep, time) * step
    assert np.abs(pulses.spectrum(f, sweep.pulse(0.0, highest)) - exact).max() < 2e-5 * np.abs(exact).max()


@pytest.mark.parametrize(
    ("law", "start", "stop", "length", "loss"),
    [
        ("linear", 25e3, 85e3, 2e-3, 0.09),
        ("hyperbolic", 25e3, 85e3, 2e-3, 0.02),
        ("linear", 360e3, 440e3, 4e-3, 0.58),
        ("hyperbolic", 360e3, 440e3, 4e-3, 0.05),
    ],
)
def test_a_sweep_that_is_stretched_by_motion_comes_at_another_time(
    law: Any, start: float, stop: float, length: float, loss: float
) -> None:
    """At 2 m/s towards a target: by (2 v/c) f2 T/B, counted from its beginning (Rihaczek 1969, Principles of
    High-Resolution Radar); with losses of 0.02 to 0.6 dB."""
    sweep, stretch = Sweep(start=start, stop=stop, duration=length, law=law), 1.0 + 2.0 * 2.0 / C
    step = 1.0 / (12.0 * stop)
    half = int(0.7 * length / step)
    time = np.arange(-half, half) * step
    still, moved = wave(sweep, time), wave(sweep, (time + 0.5 * length) * stretch - 0.5 * length)
    size = 4 * half

    def envelope(a: Floats, b: Floats) -> Floats:
        product = np.fft.fft(a, size) * np.fft.fft(b, size).conj()
        product[size // 2 :] = 0.0
        return np.abs(np.fft.fftshift(np.fft.ifft(product)))

    own, other = envelope(still, still), envelope(moved, still)
    shift = (np.argmax(other) - np.argmax(own)) * step
    assert shift == pytest.approx(
        -2.0 * 2.0 / C * stop * length / (stop - start), abs=0.02 * length / (length * (stop - start)) + 2 * step
    )
    assert 20.0 * np.log10(own.max() / other.max()) == pytest.approx(loss, abs=0.02)


@LAWS
def test_the_echo_of_a_sweep_is_one_point_where_the_target_is(law: Any) -> None:
    ping = Transmitter(position=AT, pulse=replace(SWEEP, law=law), source_level=190.0, beam=BEAM)
    cloud = render(scene(ping), 0)["cloud"]
    assert int(cloud["count"]) == 1 and int(cloud["target"][0]) == 0
    away = np.linalg.norm(np.array(TARGET) - [0.0, 0.0, -50.0])
    assert abs(float(cloud["range"][0]) - away) < 1e-3


@pytest.mark.parametrize("below", [0.25, 3.0])
def test_points_out_of_focus_err_as_they_say(below: float) -> None:
    """A point 1 m off an array of 40 cm: focused at 20 m it is several, 3.5 degrees and up to 5 cm beside it, where 0.4
    degrees and 0.6 cm were predicted; focused there one, within millimetres. The plan says which of them, and the dB
    that images lose by it."""
    ping = Transmitter(position=(0.05, 0.0, -below), pulse=replace(SWEEP, duration=0.2e-3), source_level=190.0)
    near = scene(ping, target=(1.0, 0.0, -50.0))
    sonar = replace(near.scene.sonar, array=PlanarLattice(columns=8, rows=8, pitch=0.05))
    brightest, said = [], []
    for focus in (20.0, 1.0):
        processing = replace(near.scene.processing, beamforming=FocusedDelayAndSum(focus=focus))
        made = plan(replace(near, scene=replace(near.scene, sonar=sonar, processing=processing)), ["cloud", "image"])
        frame = render(made, 0)
        cloud = frame["cloud"]
        brightest.append(10.0 * np.log10(float(frame["image/energy"].max())))
        said.append([line for line in made.warnings if line.startswith("point: out of focus in frame 0: 1 m off")])
        cloud = cloud.isel(point=slice(int(cloud["count"])))
        assert cloud.sizes["point"] == 1 if focus == 1.0 else cloud.sizes["point"] > 1
        for name, true in {"range": cloud["true_range"], "elevation": 0.0, "azimuth": 0.0}.items():
            assert (np.abs(cloud[name] - true) < 3.0 * cloud[f"{name}_error"]).all(), name
    assert float(cloud["range_error"][0]) < 5e-3 and float(cloud["elevation_error"][0]) < 0.3
    assert len(said[0]) == 1 and said[1] == []
    loss = float(said[0][0].split("an echo is ")[1].split(" dB")[0])
    assert loss == pytest.approx(brightest[1] - brightest[0], abs=1.0)


@pytest.mark.parametrize(("strength", "away"), [(1e-6, 20.0), (1e-12, 2.5)])
def test_a_faint_echo_is_a_point_and_what_the_ping_leaves_is_none(strength: float, away: float) -> None:
    """113 dB under the direct sound, where 102 were the end; and what is left of that once it is taken out."""
    own = scene(Transmitter(position=AT, pulse=SWEEP, source_level=190.0), target=(away, 0.0, -50.0)).scene
    made = replace(own, physics=replace(own.physics, scattering=Isotropic(strength=strength)))
    cloud = render(plan(Recipe(scene=made), ["cloud"]), 0)["cloud"]
    if strength < 1e-9:
        assert int(cloud["count"]) == 0
    else:
        assert int(cloud["count"]) == 1 and abs(float(cloud["range"][0]) - away) < 2e-3


def test_the_card_of_a_dataset_says_what_lights_it(tmp_path: Path) -> None:
    own = scene(Transmitter(position=AT, pulse=TONE, source_level=190.0))
    both = replace(own.scene.world, sources=(*own.scene.world.sources, SnappingShrimp(position=(10.0, 3.0, -55.0))))
    for recipe, light in (
        (own, "active sonar that is lit by its own pings:"),
        (replace(own, scene=replace(own.scene, world=both)), "active sonar that is lit by its own pings and snapping"),
        (
            with_source(own, SnappingShrimp(position=(10.0, 3.0, -55.0))),
            "passive sonar that is lit by snapping shrimp:",
        ),
    ):
        store = folder_of(tmp_path / f"{len(light)}.zarr")
        build(plan(recipe, []), str(store), workers=0)
        assert light in facts_of(store).summary


@pytest.mark.parametrize(("start", "under"), [(38e3, None), (38.0, 20), (300e3, 60)])
def test_a_pulse_out_of_the_band_is_noted(start: float, under: int | None) -> None:
    """Hz for kHz, or a sonar whose band was forgotten: nothing is heard, which nothing said."""
    pulse = Sweep(start=start, stop=1.5 * start, duration=2e-3)
    notes = out_of_band(scene(Transmitter(position=AT, pulse=pulse, source_level=180.0)).scene)
    levels = [float(note.split(" dB under")[0].split()[-1]) for note in notes]
    assert all(level > under for level in levels) if under else not levels
    assert len(levels) == (under is not None)


def test_bad_transmitters_are_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="position is the middle of the array"):
        Transmitter(position=(0.0, 0.0, 0.0), pulse=TONE, source_level=190.0)
    with pytest.raises(FieldError, match=r"sources\.0\.position: .* at hydrophone \d+ of the array"):
        plan(scene(Transmitter(position=(0.0, 0.075, -0.055), pulse=TONE, source_level=190.0)))
    near = scene(Transmitter(position=(0.05, 0.01, -0.04), pulse=SWEEP, source_level=190.0))
    listening = replace(near.scene, processing=replace(near.scene.processing, locating=SensorDelays()))
    with pytest.raises(FieldError, match=r"set scene\.processing\.locating: \{kind: trigger\}"):
        plan(replace(near, scene=listening))
    above = scene(Transmitter(position=(0.0, 0.0, 60.0), pulse=TONE, source_level=190.0))
    with pytest.raises(FieldError, match=r"sources\.0\.position: depth -10 m is outside the water"):
        plan(above)
