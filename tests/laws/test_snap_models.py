"""Snaps of every model, one beside another: what they share, how they vary, and how long and loud they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.noise import filters
from sonarsynth.receiver import POINT, LowPass, Romanis, Sonar, elements
from sonarsynth.recipe import Recipe
from sonarsynth.signals import GriddedSynthesis, pulse_support
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.filtered_pulse import (
    LONGEST_TAIL,
    at_longest,
    cut_tail,
    fir,
    pulse_spectrum,
    snap_gains,
    snap_levels,
)
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble, SnapModel, SnappingShrimp
from sonarsynth.sources.snap_models import Gabor, KellerMiksis, RecordedSnap, Ricker, SnapVariation
from sonarsynth.sources.snap_pulses import largest_scales, waveform
from sonarsynth.state import Emission
from tests.laws.test_synthesis import absorption, arrivals, error, some_of, target_at
from tests.scenes import remus

RICKER = Ricker(frequency=50e3, peak=3e3)
MODELS: tuple[SnapModel, ...] = (
    LogarithmicBubble(),
    KellerMiksis(depth=10.0),
    RICKER,
    Gabor(frequency=50e3, peak=2e3),
)
EVERY = pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
SONAR = Sonar()
LOW = LowPass(cutoff=60e3)
TIME = np.arange(-300, 301) / 500e3


def recorded(folder: Path, wave: Floats) -> RecordedSnap:
    path = folder / "snap.csv"
    np.savetxt(path, np.c_[TIME, wave], delimiter=",", header="time (s),pressure (Pa)", comments="")
    return RecordedSnap(path=str(path), time=0.0)


def snap(model: SnapModel, level: float | None = None, gain: float = 1.0, width: float = 1.0) -> Emission:
    return Emission(np.zeros(3), 0.0, model, level, gain, width)


def with_shrimp(frames: int = 2, **of_shrimp: object) -> Recipe:
    recipe = remus(frames)
    shrimp = SnappingShrimp(position=(14.0, -5.0), **of_shrimp)  # type: ignore[arg-type]
    return replace(recipe, scene=replace(recipe.scene, world=replace(recipe.scene.world, sources=(shrimp,))))


@EVERY
def test_a_source_level_is_imposed_and_a_gain_comes_on_top(model: SnapModel) -> None:
    heard = (snap(model), snap(model, 187.0), snap(model, 187.0, gain=2.0), snap(model, gain=0.5))
    peak = model.pulse(0.0, 1e5).peak
    own = 20.0 * np.log10(peak * 1e6)
    expected = [own, 187.0, 187.0 + 20.0 * np.log10(2.0), own - 20.0 * np.log10(2.0)]
    assert snap_levels(heard) == pytest.approx(expected, abs=1e-9)
    assert snap_gains(heard) * peak == pytest.approx(1e-6 * 10.0 ** (np.array(expected) / 20.0), rel=1e-9)


@EVERY
@pytest.mark.parametrize("chosen", [SONAR.antialias, LOW], ids=["band", "low"])
def test_a_pulse_is_over_after_its_support(model: SnapModel, chosen: LowPass) -> None:
    for width in (1.0, 1.3):
        made = pulses.scaled(model.pulse(0.0, 2.0 * pulses.reach(fir(chosen))), 1.0, width)
        before, after = pulse_support(waveform(model, width), chosen, 1e-4)
        t = np.arange(-before - 2e-3, after + 2e-3, 2e-6)
        size = np.abs(pulses.filtered(t, made, fir(chosen)))
        outside = (t < -before - 2e-6) | (t > after + 2e-6)
        assert size[outside].max() < 1.2e-4 * size.max()


@EVERY
def test_a_width_stretches_the_pulse_before_the_filter(model: SnapModel) -> None:
    """w S(w f) H(f), as Doppler does; and of a width and Doppler the product counts."""
    rate, samples, width = SONAR.sampling_frequency, 600, 1.2
    f, got = pulse_spectrum(waveform(model, width), SONAR.antialias, rate, samples)
    made = model.pulse(0.0, 1.5 * f[-1])
    exact = width * pulses.spectrum(width * f, made) * filters.response(f, fir(SONAR.antialias))
    size = np.abs(exact).max()
    assert np.abs(got - exact)[f < 0.5 * rate].max() < 1e-9 * size
    _, product = pulse_spectrum(waveform(model, width / 1.05), SONAR.antialias, rate, samples, 0.05)
    # the stretched spectrum of a shorter pulse; Doppler keeps the peak as a width does
    assert np.abs(product - got).max() < 1e-9 * size


def test_the_fast_synthesis_of_different_snaps_is_the_exact_one(tmp_path: Path) -> None:
    """Every model at once, louder and longer, by paths that turn, blur and stretch: in a band, and down to 0 Hz."""
    models = (*MODELS, recorded(tmp_path, np.exp(-((TIME / 20e-6) ** 2))))
    snaps = tuple(snap(m, 190.0, 1.0 + 0.1 * i, 0.9 + 0.05 * i) for i, m in enumerate(models))
    array, random = some_of(elements(Romanis()), 90), np.random.default_rng(3)
    of = target_at(10.0, 20, 2, direct=False)
    of = replace(
        of,
        snap=np.arange(20) % len(models),
        phase=random.choice([0.0, 0.3], 20),
        delay_std=random.uniform(0.0, 5e-6, 20),
        doppler=random.choice([-1e-3, 2e-3], 20),
    )
    for sonar in (SONAR, Sonar(filter=LOW, sampling_frequency=250e3)):
        start, samples = float(of.delay.min()) - 4e-3, int(9e-3 * sonar.sampling_frequency)
        exact, _ = DirectSum().pressure(of, snaps, Reception(array, sonar, absorption, start, samples))
        got, _ = GriddedSynthesis().pressure(of, snaps, Reception(array, sonar, absorption, start, samples))
        assert 1e-9 < error(got, exact) < 3e-4


@pytest.mark.parametrize("width", [1.0, 1.25])
def test_a_path_gives_the_pulse_itself(width: float) -> None:
    of = arrivals([0.05], [[1.0, 0.0, 0.0]], [10.0], [1.0])
    start, samples = 0.047, 1200
    for model in MODELS:
        got, _ = DirectSum().pressure(
            of, (snap(model, gain=1.5, width=width),), Reception(POINT, SONAR, None, start, samples)
        )
        made = pulses.scaled(model.pulse(0.0, 2.0 * pulses.reach(fir(SONAR.antialias))), 1.5, width)
        t = start + np.arange(samples) / SONAR.sampling_frequency - 0.05
        assert error(got[0], pulses.filtered(t, made, fir(SONAR.antialias))) < 1e-3  # the filter's stop band is cut


def test_slow_tails_of_turned_pulses_are_bounded_and_said(tmp_path: Path) -> None:
    """With a net impulse J a turned pulse falls as J/(pi t); without one, and with no net integral of it, as 1/t^3."""
    wave = np.exp(-((TIME / 20e-6) ** 2))
    slow = waveform(recorded(tmp_path, wave))
    assert pulse_support(slow, LOW, turned=True) == (LONGEST_TAIL, LONGEST_TAIL)
    t = np.linspace(-1e-4, 1e-4, 801)
    top = np.abs(pulses.filtered(t, slow.model.pulse(0.0, 3e5), fir(LOW))).max()
    impulse = np.sqrt(np.pi) * 20e-6
    assert cut_tail(slow, LOW) == pytest.approx(impulse / (np.pi * LONGEST_TAIL) / top, rel=0.2)
    quick = waveform(RICKER)
    assert max(pulse_support(quick, LOW, turned=True)) < 2e-3
    assert cut_tail(quick, LOW) == 1e-7


def test_supports_of_varied_widths_are_bounds_of_few_kinds() -> None:
    widths = np.random.default_rng(1).uniform(0.8, 1.3, 200)
    longer = [at_longest(waveform(RICKER, w)).width for w in widths]
    assert all(w <= big <= 1.051 * w for w, big in zip(widths, longer, strict=True))
    assert len(set(longer)) < 13
    assert at_longest(waveform(RICKER)).width == 1.0


def test_a_bubble_collapses_at_the_depth_of_its_shrimp() -> None:
    for position, height, depth in (((1.0, 2.0), 0.5, 9.5), ((1.0, 2.0, -3.0), 0.0, 3.0), ((1.0, 2.0, 0.0), 0.0, 0.0)):
        got = SnappingShrimp(position=position, height=height, snap=KellerMiksis()).model(10.0)
        assert got == KellerMiksis(depth=depth)
    own = KellerMiksis(depth=4.0)
    assert SnappingShrimp(position=(0.0, 0.0), snap=own).model(10.0) == own
    with pytest.raises(ValueError, match="needs the depth"):
        pulse_support(waveform(KellerMiksis()), LOW)


def test_a_file_that_changes_is_another_waveform(tmp_path: Path) -> None:
    model = recorded(tmp_path, np.exp(-((TIME / 20e-6) ** 2)))
    first = waveform(model)
    level = snap_levels((snap(model),))
    assert waveform(model) == first
    recorded(tmp_path, 20.0 * np.exp(-((TIME / 20e-6) ** 2)))
    assert waveform(model) != first
    assert snap_levels((snap(model),)) - level == pytest.approx(20.0 * np.log10(20.0))


def test_what_varies_is_drawn_by_seed_frame_and_shrimp_alone() -> None:
    recipe = with_shrimp(30, variation=SnapVariation(level=3.0, width=0.1), snap_times=(0.0, 0.01))
    scene = recipe.scene
    world = scene.world
    two = replace(recipe, scene=replace(scene, world=replace(world, sources=(*world.sources, *world.sources))))

    def drawn(of: Recipe, index: int) -> list[tuple[float, float]]:
        return [(s.gain, s.width) for s in of.frame(index)[1].moment.snaps]

    forward = [drawn(recipe, i) for i in range(30)]
    assert [drawn(recipe, i) for i in reversed(range(30))] == forward[::-1]
    assert [drawn(two, i)[:2] for i in range(30)] == forward  # another shrimp changes nothing of the first
    every = [one for i in range(30) for one in drawn(two, i)]
    assert len(set(every)) == len(every)
    assert [drawn(replace(recipe, seed=9), i) for i in range(30)] != forward
    assert {tuple(drawn(with_shrimp(), i)) for i in range(2)} == {((1.0, 1.0),)}


def test_levels_vary_as_stated_and_within_bounds() -> None:
    variation = SnapVariation(level=2.0, width=0.05)
    recipe = with_shrimp(400, snap=RICKER, source_level=190.0, variation=variation, snap_times=(0.0, 0.01))
    snaps = [s for i in range(400) for s in recipe.frame(i)[1].moment.snaps]
    level, width = snap_levels(tuple(snaps)), np.array([s.width for s in snaps])
    gain, longest = largest_scales(variation)
    assert np.abs(level - 190.0).max() <= 20.0 * np.log10(gain) + 1e-9
    assert width.max() <= longest and width.min() >= 1.0 / longest - 1e-12
    few = 4.0 / np.sqrt(level.size)
    assert level.mean() == pytest.approx(190.0, abs=2.0 * few)
    assert level.std() == pytest.approx(2.0, rel=few)
    assert np.log(width).std() == pytest.approx(0.05, rel=few)
    assert abs(np.corrcoef(level[::2], level[1::2])[0, 1]) < 1.5 * few
