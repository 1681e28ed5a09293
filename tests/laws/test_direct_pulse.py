"""The direct pulse taken out: it goes however rays bend, echoes stay as beam patterns say, and doubt is in the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.imaging import Clean, FocusedDelayAndSum
from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.planning.measured import lost_echoes
from sonarsynth.planning.measured.lost_echoes import losses
from sonarsynth.products import SourceEstimates
from sonarsynth.ranging import SensorDelays, range_profiles
from sonarsynth.ranging.cancelling.direct_pulse import deviations, remove, remove_others, trusted
from sonarsynth.ranging.location import Triggered
from sonarsynth.ranging.location.plane_waves import PlaneWaveFit
from sonarsynth.ranging.range_profiles import direct_spectrum
from sonarsynth.receiver import BeamGrid, Converter, PlanarLattice, Romanis, Sonar, elements
from sonarsynth.recipe.scene import Processing
from sonarsynth.state import Receiver, Survey
from tests.heard import RATE, add_noise, cloud_of, hear, pulse_spectrum, silence
from tests.scenes import point_scene

C = 1500.0
ARRAY = elements(PlanarLattice(columns=12, rows=8, pitch=0.02))
SONAR = Sonar(
    array=PlanarLattice(columns=12, rows=8, pitch=0.02),
    assumed_sound_speed=C,
    beams=BeamGrid(azimuths=31, elevations=15, azimuth_span=1.0, elevation_span=0.4),
)
POSE = Pose(np.array([0.0, 0.0, -3.0]), quaternion(np.pi / 2))
SNAP = 6.0 * direction(-0.4, -0.2)
CLOCK = 6.0 / C
LENGTH = 1e-3
START = CLOCK - 2.2e-3
TARGET = 8.0 * direction(0.1, 0.05)
IMAGE = FocusedDelayAndSum(focus=None)


def direct(lag=0.0, gain=1.0, noise=0.0):
    """The pulse of a snap, each sensor `lag` (s) late and `gain` times as loud as a sphere has it."""
    quiet = silence(ARRAY, START, 1000)
    whole = hear(quiet, ARRAY, SNAP, 0.0, 1.0, C)
    f = np.fft.rfftfreq(1000, 1 / whole.sampling_frequency)
    turned = np.fft.rfft(whole.pressure, axis=1) * np.exp(-2j * np.pi * f * np.reshape(lag, (-1, 1)))
    pressure = np.reshape(gain, (-1, 1)) * np.fft.irfft(turned, 1000, axis=1)
    return add_noise(replace(whole, pressure=pressure.astype(np.float32)), noise, np.random.default_rng(1))


def with_echo(signals, excess, target=TARGET, amplitude=1e-2):
    """An echo that comes `excess` s after the direct pulse at the array centre."""
    return hear(signals, ARRAY, target, CLOCK + excess - np.linalg.norm(target) / C, amplitude, C)


def located(signals):
    survey = Survey(3.0 - SNAP[2], Profile(np.zeros(1), np.full(1, C)))
    return SensorDelays().locate(signals, Receiver(POSE, ARRAY, SONAR), survey, 1)


def without(signals, estimates=None):
    return remove(signals, located(signals) if estimates is None else estimates, ARRAY, SONAR, LENGTH)


def energy(pressure):
    return float(np.sum(np.square(pressure, dtype=float)))


def imaged(signals, excess, estimates=None, method=IMAGE):
    """The image of what is left from `excess` less half a pulse on, NaN where it may hold the direct pulse."""
    left = without(signals, estimates)
    window = CLOCK + excess - 2.5e-4, CLOCK + excess + 6e-4

    def imaging(some, start, stop):
        return method.image(some, ARRAY, SONAR, start, stop)

    return trusted(imaging(left, *window), signals, left, SONAR, imaging, CLOCK - LENGTH)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.3])
def test_some_sensors_tell_the_direct_pulse_where_they_hear_what_all_do(noise, monkeypatch):
    """noise: root mean square, over the peak of the pulse. Where that hides part of it, all of 508 are heard."""
    array, random = elements(Romanis()), np.random.default_rng(3)
    pulse = hear(silence(array, START, 1000), array, SNAP, 0.0, 1.0, C)
    heard = add_noise(pulse, noise * float(np.abs(pulse.pressure).max()), random)
    some = direct_spectrum(heard, located(direct()), array, SONAR, 1152, 1e-4)
    monkeypatch.setattr(range_profiles, "ENOUGH", array.count)
    every = direct_spectrum(heard, located(direct()), array, SONAR, 1152, 1e-4)
    band = slice(round(25e3 * 1152 / RATE), round(85e3 * 1152 / RATE))
    wrong = np.abs(some - every)[band].max() / np.abs(every).max()
    assert (wrong == 0.0) == (noise == 0.3)
    assert wrong < 2e-3


BENT = 40e-9 * np.sin(np.linspace(0, 9, ARRAY.count)), 1 + 0.01 * np.cos(np.linspace(0, 20, ARRAY.count))


@pytest.mark.parametrize("bent", [(0.0, 1.0), BENT])
@pytest.mark.parametrize("excess", [None, 0.3e-3, 0.6e-3])
def test_the_direct_pulse_falls_by_60_db_where_rays_bend_and_echoes_overlap(bent, excess):
    """40 ns are 2 % of a period: along the sphere alone it would fall by 40 dB."""
    alone = direct(*bent)
    heard = alone if excess is None else with_echo(alone, excess)
    left = without(heard).pressure
    echo = 0.0 if excess is None else heard.pressure - alone.pressure
    early = np.s_[:, : int((CLOCK - START + 1e-4) * heard.sampling_frequency)]
    if excess is None:
        assert energy(left) < 1e-6 * energy(alone.pressure)
    assert energy((left - echo)[early]) < 1e-6 * energy(alone.pressure)


@pytest.mark.parametrize("target", [TARGET, 8.0 * direction(-0.3, -0.2), 8.0 * direction(-0.41, -0.19), 2.0 * SNAP])
def test_an_echo_loses_what_a_beam_on_the_snap_hears_of_it(target):
    """Of its energy, at each frequency: |sum over sensors of the phase between the two waves|^2 over their number."""
    alone, excess = direct(), 0.4e-3
    both = with_echo(alone, excess, target)
    estimates = located(alone)
    echo = both.pressure.astype(float) - alone.pressure
    kept = without(both, estimates).pressure.astype(float) - without(alone, estimates).pressure
    f = np.linspace(22e3, 88e3, 400)
    late = (np.linalg.norm(target - ARRAY.position, axis=1) - np.linalg.norm(SNAP - ARRAY.position, axis=1)) / C
    face = [
        np.prod([np.sinc(np.multiply.outer(f, u[..., k] * ARRAY.face / C)) for k in (1, 2)], axis=0)
        for u in ((p - ARRAY.position) / np.linalg.norm(p - ARRAY.position, axis=1)[:, None] for p in (target, SNAP))
    ]
    wave, response = face[0] * np.exp(-2j * np.pi * np.multiply.outer(f, late)), face[1]
    heard = np.abs(np.sum(response * wave, axis=1)) ** 2 / np.sum(response**2, axis=1)
    weight = np.abs(pulse_spectrum(f)) ** 2
    expected = weight @ heard / (weight @ np.sum(np.abs(wave) ** 2, axis=1))
    assert 1 - energy(kept) / energy(echo) == pytest.approx(expected, rel=0.1, abs=0.01)


def test_a_later_snap_in_the_echo_window_is_taken_out_and_what_is_not_located_stays():
    first, excess = direct(), 1.2e-3
    later = hear(silence(ARRAY, START, 1000), ARRAY, 7.0 * direction(0.3, 0.1), CLOCK + excess - 7.0 / C, 0.5, C)
    both = replace(first, pressure=first.pressure + later.pressure)
    rows = vars(located(first)), vars(located(later))
    estimates = SourceEstimates(**{name: np.concatenate([row[name] for row in rows]) for name in rows[0]})
    window = CLOCK + 0.8e-3, CLOCK + 1.6e-3
    left = remove_others(both, estimates, ARRAY, SONAR, 0.5e-3, window)
    assert energy(left.pressure - first.pressure) < 1e-5 * energy(later.pressure)
    assert remove_others(both, estimates, ARRAY, SONAR, 0.5e-3, (window[0] - 2e-3, window[1] - 2e-3)) is both
    nowhere = replace(estimates, position=np.where([[True], [False]], estimates.position, np.nan))
    assert remove_others(both, nowhere, ARRAY, SONAR, 0.5e-3, window) is both


def test_noise_is_left_as_it_is():
    noise = 1e-4
    heard = direct(noise=noise)
    left = without(heard)
    assert energy(left.pressure) == pytest.approx(heard.pressure.size * noise**2, rel=0.03)


def unlike(signals, size):
    """Each sensor with phases (rad) of its own over frequency, which no lag and no gain describes."""
    f = np.fft.rfftfreq(1000, 1 / signals.sampling_frequency)
    one, other = np.random.default_rng(0).normal(size=(2, ARRAY.count, 1))
    phase = size * (one * np.sin(2 * np.pi * f / 30e3) + other * np.cos(2 * np.pi * f / 30e3))
    pressure = np.fft.irfft(np.fft.rfft(signals.pressure, axis=1) * np.exp(1j * phase), 1000, axis=1)
    return replace(signals, pressure=pressure.astype(np.float32))


@pytest.mark.parametrize("size", [0.03, 0.3])
def test_beams_that_may_hold_the_direct_pulse_are_nan(size):
    """Sensors that are unlike leave some of it: no beam that is given holds three times what it should."""
    excess = 0.5e-3
    clean = imaged(with_echo(direct(), excess, amplitude=1e-3), excess)
    image = imaged(with_echo(unlike(direct(), size), excess, amplitude=1e-3), excess, located(direct()))
    given = np.isfinite(image.energy)
    assert np.isfinite(clean.energy).all() and clean.remainder < 1e-6
    assert given[np.unravel_index(clean.energy.argmax(), given.shape)]
    assert (image.energy[given] < 3 * clean.energy[given]).all()
    assert given.all() == (size < 0.1)
    fainter = imaged(with_echo(unlike(direct(), size), excess, amplitude=3e-5 * size), excess, located(direct()))
    assert fainter.remainder > 0.25 and not np.isfinite(fainter.energy).all()


def test_beams_that_a_method_leaves_nothing_in_are_numbers_unless_the_direct_pulse_is_left():
    """`clean` leaves exact silence beside an echo: any remainder is more than that, and none that matters."""
    excess, method = 0.5e-3, Clean(focus=None)
    image = imaged(with_echo(direct(), excess), excess, method=method)
    assert np.isfinite(image.energy).all() and (image.energy == 0.0).any() and 0.0 < image.remainder < 1e-6
    unsure = imaged(with_echo(unlike(direct(), 0.3), excess, amplitude=1e-3), excess, located(direct()), method)
    assert (~np.isfinite(unsure.energy)).any()
    plain = imaged(with_echo(unlike(direct(), 0.3), excess, amplitude=1e-3), excess, located(direct()))
    assert unsure.remainder == pytest.approx(plain.remainder, rel=1.0)


@pytest.mark.parametrize("off", [-0.12e-3, -0.05e-3, 0.0, 0.05e-3, 0.12e-3])
@pytest.mark.parametrize("end", ["start", "stop"])
def test_no_point_lies_at_an_end_of_the_window(end, off):
    """An echo that the window cuts, whichever side of the end its peak is on, makes no point; a whole one does."""
    excess = 2e-3
    signals = with_echo(direct(), excess)
    estimates = located(signals)
    water = Profile(np.zeros(1), np.full(1, C))

    def delays(start, stop):
        image = IMAGE.image(signals, ARRAY, SONAR, CLOCK + start, CLOCK + stop)
        return cloud_of(signals, image, estimates, ARRAY, SONAR, POSE, water, focus=None).delay

    window = (excess + off, excess + 0.8e-3) if end == "start" else (excess - 0.8e-3, excess + off)
    assert len(delays(*window)) == 0
    assert delays(excess - 0.8e-3, excess + 0.8e-3) == pytest.approx(excess, abs=2e-6)


def overlapped(target, **processing):
    recipe = point_scene(target, (4.0, 1.5, -50.0), strength=1e-3, array=PlanarLattice(columns=12, rows=8, pitch=0.02))
    return replace(recipe, scene=replace(recipe.scene, processing=Processing(**processing)))


def test_the_plan_takes_the_direct_pulse_out_where_it_hides_echoes_and_says_what_that_costs():
    ahead, hidden, clear = (3.5, 0.2, -50.0), (4.25, 1.594, -50.03), (9.0, -4.0, -50.0)
    made = plan(overlapped(ahead))
    assert made.windows.direct_removed and made.windows.echo_start < 1e-3
    (line,) = (note for note in made.warnings if "removed" in note and note.startswith("the direct pulse"))
    assert "dB below the echoes" in line and "frame 0" in line
    aside, behind = losses(made, 0), losses(plan(overlapped(hidden)), 0)
    assert aside.fall > 70 and aside.below > 60 and next(iter(aside.lost.values())) < 0.1
    assert next(iter(behind.lost.values())) > 0.95  # the echo comes from where the snap is
    kept = plan(overlapped(ahead, direct_pulse="keep"))
    assert not kept.windows.direct_removed and kept.windows.echo_start == kept.windows.supports.clear
    assert any(note.startswith("point: ") and "lost to the echo window in frame 0" in note for note in kept.warnings)
    far = plan(overlapped(clear))
    assert not far.windows.direct_removed and not any("lost" in note for note in far.warnings)


def test_the_plan_counts_what_the_converter_leaves_of_the_direct_pulse():
    """What is left of it falls by 6 dB a bit, to what is left without a converter; what it clips stays."""
    ahead = overlapped((3.5, 0.2, -50.0))

    def at(bits, full_scale=600.0):
        sonar = replace(ahead.scene.sonar, converter=Converter(bits=bits, full_scale=full_scale))
        return losses(plan(replace(ahead, scene=replace(ahead.scene, sonar=sonar))), 0)

    exact, fine, few, fewest = losses(plan(ahead), 0), at(24), at(12), at(8)
    assert fine.fall == pytest.approx(exact.fall, abs=0.1) and fine.below == pytest.approx(exact.below, abs=0.1)
    assert few.fall - fewest.fall == pytest.approx(4 * 6.02, abs=4.0) and few.fall < exact.fall - 30
    assert few.below - fewest.below == pytest.approx(4 * 6.02, abs=4.0)
    assert at(24, 300.0).fall < 30


def test_where_nothing_is_recorded_of_the_direct_pulse_nothing_is_taken_out():
    """Of zeros its lags were 0/0: memory beside the record was read, or a plan ended in a division by zero."""
    nothing = replace(direct(), pressure=np.zeros((ARRAY.count, 1000), np.float32))
    lag, gain = deviations(nothing, ARRAY, SONAR, PlaneWaveFit.of(located(direct()), 0))
    assert not lag.any() and (gain == 1.0).all()
    ahead = overlapped((3.5, 0.2, -50.0), locating=Triggered())
    sonar = replace(ahead.scene.sonar, converter=Converter(bits=16, full_scale=1e9))
    made = plan(replace(ahead, scene=replace(ahead.scene, sonar=sonar)), ["signals", "image"])
    assert made.windows.direct_removed and any("nothing is recorded" in note for note in made.warnings)
    assert not render(made, 0)["signals/pressure"].values.any()


def test_the_plan_says_that_images_may_have_nothing_but_what_is_left_of_the_direct_pulse():
    ahead = overlapped((3.5, 0.2, -50.0), direct_pulse="remove")
    alone = replace(ahead, scene=replace(ahead.scene, world=replace(ahead.scene.world, targets=())))
    for recipe, said in ((ahead, False), (alone, True)):
        assert any("but no echo is heard in the frames measured" in note for note in plan(recipe).warnings) == said


@pytest.mark.parametrize(("below", "said"), [(29.0, "to 29 dB below the echoes"), (-29.0, "to 29 dB over the echoes")])
def test_a_pulse_that_stays_louder_than_the_echoes_is_said_to_be_over_them(
    below: float, said: str, monkeypatch: pytest.MonkeyPatch
):
    made = plan(overlapped((3.5, 0.2, -50.0)))
    monkeypatch.setattr(lost_echoes, "losses", lambda *_: lost_echoes.EchoLosses(0, {}, 3.0, below))
    assert said in lost_echoes.lost_echoes(made)[0]
