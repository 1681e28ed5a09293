"""Pictures of the page on the soundscape: what its presets sound like, beside published values."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import sonarsynth as ss
from sonarsynth.conventions import REFERENCE_PRESSURE
from sonarsynth.environment.noise import KnudsenNoise, RainNoise, ThermalNoise, WenzNoise, WindNoise
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.evaluation.soundscape.made_sound import listening_plan, made_sound
from sonarsynth.evaluation.soundscape.measured import MeasuredFigures, measure
from sonarsynth.evaluation.soundscape.model import sound_model
from sonarsynth.evaluation.soundscape.predicted import PASCAL, PredictedFigures, elevation_edges, predict
from sonarsynth.pictures.figures.style import INK, RAYS
from sonarsynth.planning import Plan
from sonarsynth.recipe.scene import Frame

ROOT = Path(__file__).resolve().parents[2]
SECONDS = 2.0
CHORUSES = {"mud": "mud", "harbour": "harbour", "1.5e-4": "1.5e-4 (default)", "reef": "reef", "rubble": "rubble"}
NOISES: dict[str, tuple[tuple[str, NoiseField], ...]] = {
    "wind and ships: Coates (1989), after Wenz (1962)": (
        ("wenz, wind 5 m/s, shipping 0.5", WenzNoise(wind_speed=5.0, shipping=0.5)),
        *((f"wind, {speed:g} m/s", WindNoise(wind_speed=speed)) for speed in (2.0, 5.0, 10.0)),
        ("thermal", ThermalNoise()),
    ),
    "sea state and rain": (
        *((f"knudsen, sea state {state:g}", KnudsenNoise(sea_state=state)) for state in (1.0, 2.0, 4.0, 6.0)),
        *((f"rain, {rate:g} mm/h", RainNoise(rate=rate)) for rate in (2.0, 10.0, 50.0)),
        ("thermal", ThermalNoise()),
    ),
}
PUBLISHED = {
    "wind and ships: Coates (1989), after Wenz (1962)": (
        ([1, 10, 25, 50, 85], [60.955, 46.090, 38.548, 32.835, 29.416], "o", "the total by hand"),
        ([100, 200], [25.0, 31.0], "s", "Mellen (1952)"),
    ),
    "sea state and rain": (
        ([20], [39.0], "o", "Knudsen et al. (1948), sea state 2"),
        ([5, 5, 5], [47.0, 57.8, 68.6], "^", "Ma et al. (2005), 5 kHz"),
        ([20], [64.0], "*", "shrimp, Everest et al. (1948)"),
    ),
}
"""kHz and dB re 1 uPa2/Hz."""


def noises(folder: Path, out: Path) -> None:
    """Spectra of the noise presets, 1 to 200 kHz."""
    figure, panels = plt.subplots(1, 2, figsize=(10.0, 4.2), dpi=100, sharey=True, layout="constrained")
    f = np.geomspace(1e3, 2e5, 200)
    for (title, presets), panel in zip(NOISES.items(), panels, strict=True):
        for (name, noise), colour in zip(presets, [INK, *RAYS, *RAYS], strict=False):
            level = 10.0 * np.log10(noise.density(f) / REFERENCE_PRESSURE**2)
            dashes = "--" if name.startswith(("rain", "wenz")) else "-"
            panel.plot(1e-3 * f, level, dashes, color=colour, linewidth=1.2, label=name)
        for kilohertz, levels, mark, name in PUBLISHED[title]:
            panel.plot(kilohertz, levels, mark, color=INK, mfc="none", markersize=8, label=name)
        panel.set(xscale="log", xlabel="frequency (kHz)", ylim=(0, 108))
        panel.set_title(title, fontsize=10, loc="left")
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7, frameon=False, ncols=2)
    panels[0].set_ylabel("level at a point (dB re 1 uPa$^2$/Hz)")
    figure.savefig(out / "noises.png", metadata={"Software": None})
    plt.close(figure)


def choruses(folder: Path, out: Path) -> None:
    """Spectra, loud arrivals, amplitudes, elevations and coherence of the chorus presets, two seconds of each."""
    heard = {name: _heard(density) for density, name in CHORUSES.items()}
    figure, panels = plt.subplots(2, 3, figsize=(12.0, 7.2), dpi=100, layout="constrained")
    spectrum, rates, tails, elevation, across, up = panels.ravel()
    for (name, (got, said)), colour in zip(heard.items(), [INK, *RAYS], strict=False):
        density = (10.0 * np.log10(d / REFERENCE_PRESSURE**2) for d in (got.figures.density, said.density))
        for level, dashes in zip(density, ("-", "--"), strict=True):
            spectrum.plot(1e-3 * got.frequency, level, dashes, color=colour, linewidth=1.0)
        loud, often = got.levels + PASCAL, got.figures.rates
        rates.errorbar(loud, np.where(often > 0, often, np.nan), got.spread.rates, fmt="o", color=colour, capsize=2)
        assert said.rates is not None
        rates.plot(loud, said.rates, "--", color=colour)
        alpha = "no stable law" if np.isnan(got.figures.stable[0]) else f"alpha {got.figures.stable[0]:.2f}"
        share = np.where(got.figures.exceedance > 0, got.figures.exceedance, np.nan)
        tails.plot(got.tail + PASCAL, share, color=colour, label=f"{name}: {alpha}")
    _default(elevation, across, up, *heard["1.5e-4 (default)"])
    levels, unfiltered = np.arange(120.0, 156.0), _direct_paths("1.5e-4")
    rates.plot(levels, [unfiltered(level) for level in levels], ":", color=INK, label="default, direct, no filter")
    spectrum.plot([], [], "-", color=INK, label="heard, two seconds")
    spectrum.plot([], [], "--", color=INK, label="Campbell's theorem")
    rates.plot([140.0, 150.0], [20.0, 3.5], "*", color=INK, markersize=11, mfc="none", label="Cato and Bell (1991)")
    spectrum.set(xlabel="frequency (kHz)", ylabel="level (dB re 1 uPa$^2$/Hz)", title="spectrum behind the filter")
    rates.set(yscale="log", ylim=(0.1, 3e3), xlabel="peak level (dB re 1 uPa)", title="arrivals above it (1/s)")
    tails.set(yscale="log", xlabel="magnitude (dB re 1 uPa)", title="share of samples above it")
    for panel in panels.ravel():
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7, frameon=False)
        panel.title.set_fontsize(10)
    figure.savefig(out / "choruses.png", metadata={"Software": None})
    plt.close(figure)


def _plan(chorus: str) -> tuple[Plan, Frame]:
    """A chorus at the array of remus.yaml."""
    recipe = ss.load(ROOT / "configs" / "remus.yaml", [f"scene.world.chorus={{{chorus}}}"])
    return listening_plan(recipe, SECONDS), recipe.frame(0)[1]


def _heard(density: str) -> tuple[MeasuredFigures, PredictedFigures]:
    """What is heard of a chorus, and its model."""
    plan, first = _plan(f"density: {density}")
    got = measure(made_sound(plan, first, SECONDS))
    return got, predict(sound_model(plan, first), got)


def _direct_paths(density: str) -> Callable[[float], float]:
    """Direct paths/s of a chorus whose peak is above a level (dB re 1 uPa) at a point, before any filter."""
    model = sound_model(*_plan(f"density: {density}, images: 0")).chorus
    assert model is not None
    return lambda level: float(model.counts(np.array([-1.0, 1.0]), 1.0, level)[0])


def _default(elevation: Axes, across: Axes, up: Axes, got: MeasuredFigures, said: PredictedFigures) -> None:
    """Where the default chorus comes from, and what that does to pairs of hydrophones."""
    edges, arrivals = elevation_edges(), got.sound.arrivals
    assert arrivals is not None and said.elevation is not None
    degrees = np.rad2deg(np.arcsin(edges))
    energy, wide = arrivals.by_elevation(edges)
    middle = 0.5 * (degrees[1:] + degrees[:-1])
    elevation.errorbar(middle, np.where(energy > 0, energy, np.nan), wide, fmt="o", color=INK, capsize=2, label="heard")
    elevation.stairs(said.elevation, degrees, linestyle="--", color=RAYS[0], label="model")
    top = float(said.elevation.max())
    elevation.set(yscale="log", ylim=(1e-4 * top, 5.0 * top), xlabel="elevation (deg, up positive)")
    elevation.set_title("default: energy in 10 deg re a snap at 1 m")
    offset = got.sound.position[got.pairs] - got.sound.position[0]
    away, level = np.linalg.norm(offset, axis=1), np.abs(offset[:, 2]) < 1e-9
    for panel, mask, name in ((across, level, "beside each other"), (up, ~level, "one over the other")):
        for n, (f, colour) in enumerate(zip(got.at.tolist(), RAYS, strict=False)):
            order = np.flatnonzero(mask)[np.argsort(away[mask])]
            coherence, wide = got.figures.coherence[n, order], got.spread.coherence[n, order]
            panel.errorbar(away[order], coherence, wide, fmt="o", color=colour, capsize=2, label=f"{1e-3 * f:.3g} kHz")
            panel.plot(away[order], said.coherence[n, order], "--", color=colour)
        panel.set(xlabel="distance (m)", ylim=(-0.5, 1.0), title=f"default: coherence, {name}")
