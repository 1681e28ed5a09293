"""`tools/bench odds [--windows 24]`: in which share of windows a target is found, by the sea that it is in.

The thesis scene (remus.yaml, three frames of its pass) with the snap at three distances from the middle of the track,
of three source levels, among other shrimp of three densities. Echoes and what they are heard against are made by the
project's own chain and added; each window has another draw of the chorus, of the electronics (30 dB) and of the places
of scatterers. A target is found where the brightest beam of the image lies on it, or within a beam width of its outline
(`brightest`), or where one of the three brightest peaks does (`peaks`). Shares are means over the windows and the three
frames, with their range over frames. All levels are asked of the same windows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter

from sonarsynth.equations.arrays.apertures import whole_beams_per_width
from sonarsynth.imaging import OrderStatistic
from sonarsynth.imaging.image_window import snapshots_of
from sonarsynth.pipeline import TracedFrame, digitise, trace_frame
from sonarsynth.pipeline.frame_chorus import frame_chorus, with_chorus
from sonarsynth.pipeline.frame_reverberation import frame_reverberation, with_reverberation
from sonarsynth.pipeline.labelled_estimates import beam_widths, heard_directly
from sonarsynth.pipeline.synthesis import frame_signals
from sonarsynth.planning import Plan, plan
from sonarsynth.products import Signals, Snapshots
from sonarsynth.recipe import reading

RECIPE, FRAMES = "configs/remus.yaml", (10, 32, 55)
DENSITIES, LEVELS, DISTANCES = (1e-4, 1e-3, 1e-2), (194.6, 185.0, 175.0), (5.6, 10.0, 20.0)
HEIGHT, ALONG = 5.5, np.array([-6.0, -5.0]) / 61.0**0.5
"""m of the track over the bottom, and the direction from its middle to the snap of the recipe."""
WINDOWS, STACKED, MEDIANS = 24, 5, 48
"""Windows of a row; windows that a median is taken of, and how many such medians."""
PEAKS = 3
ANSWERS = ("scene.world.reverberation={}", "scene.world.environment.surface.wind_speed=5 m/s", "accuracy.speckle=0.3")
OTHER_DISTANCE, OTHER_LEVEL = 10.0, 194.6
"""Of the rows below the first nine."""
Found = list[tuple[bool, bool]]  # brightest, peaks; of windows


@dataclass(frozen=True)
class Seen:
    """A frame: its echoes, when it is listened to, and which beams are on the target."""

    made: Plan
    traced: TracedFrame
    window: tuple[float, float]
    on: np.ndarray

    def spectra(self, signals: Signals) -> Snapshots:
        """Of the window."""
        return snapshots_of(signals, self.made.scene.sonar, *self.window)

    def echoes(self) -> Signals:
        """At the first of LEVELS."""
        return frame_signals(self.made, self.traced.frame, self.traced.arrivals)

    def sea(self, window: int) -> tuple[Signals, Signals | None]:
        """What does not answer to the snap in a window, and what does: reverberation, at the first of LEVELS."""
        frame = replace(self.traced.frame, seed=1000 + window)
        echoes = self.echoes()
        quiet = replace(echoes, pressure=np.zeros_like(echoes.pressure))
        heard = digitise(self.made, frame, with_chorus(self.made, frame, quiet, frame_chorus(self.made, frame)))
        answer = frame_reverberation(self.made, frame)
        return heard, None if answer is None else with_reverberation(self.made, frame, quiet, answer)

    def image(self, spectra: np.ndarray, like: Snapshots, method: Any = None) -> np.ndarray:
        """Energy (elevation, azimuth) of the beams of spectra (sensor, bin)."""
        method = self.made.choices.beamforming if method is None else method
        of = like.having(spectra.astype(np.complex64))
        return np.asarray(method.energies(of, self.made.elements, self.made.scene.sonar))

    def found(self, energy: np.ndarray) -> tuple[bool, bool]:
        """Whether the brightest beam, and whether one of the brightest peaks, is on the target."""
        highest = np.where(maximum_filter(energy, 7, mode="nearest") == energy, energy, 0.0).ravel()
        best = np.argsort(-highest)[:PEAKS]
        return bool(self.on.ravel()[best[0]]), bool(self.on.ravel()[best].any())


def seen(density: float, distance: float, more: tuple[str, ...] = ()) -> list[Seen]:
    """The frames of the thesis scene in a sea."""
    x, y = np.array([20.0, 0.0]) + ALONG * np.sqrt(distance**2 - HEIGHT**2)
    settings = [
        f"scene.world.sources.0.position=[{x:.3f}, {y:.3f}]",
        f"scene.world.sources.0.source_level={LEVELS[0]} dB",
        f"scene.world.chorus={{density: {density:f}, images: 6}}",
        "scene.sonar.electronics={level: 30 dB}",
        "scene.sonar.converter=null",
        *more,
    ]
    made = plan(reading.load(RECIPE, settings), products=("image",))
    beams, frames = made.scene.sonar.beams, []
    high, wide = whole_beams_per_width(beam_widths(made), beams.azimuth, beams.elevation)
    rows, columns = np.mgrid[-high : high + 1, -wide : wide + 1]
    for index in FRAMES:
        traced = trace_frame(made, index)
        light = float(heard_directly(made, traced.arrivals, traced.frame.moment.snaps).time[0])
        window = light + made.windows.echo_start, light + made.windows.echo_stop
        on = binary_dilation(traced.truth.beam_target == 0, (rows / high) ** 2 + (columns / wide) ** 2 <= 1.0)
        frames.append(Seen(made, traced, window, on))
    return frames


def row(
    name: str, frames: list[Seen], windows: int, level: float, seas: list[list[tuple[Snapshots, Snapshots | None]]],
    method: Any = None, stacked: int = 1,
) -> dict[str, Any]:  # fmt: skip
    """Shares of windows in which the target is found."""
    shares, gain, bright = [], 10.0 ** ((level - LEVELS[0]) / 20.0), list[float]()
    draw = np.random.default_rng(7)
    for frame, heard in zip(frames, seas, strict=True):
        echo = frame.spectra(frame.echoes())
        images = [
            frame.image(
                gain * (echo.spectra + (0.0 if answer is None else answer.spectra)) + noise.spectra, echo, method
            )
            for noise, answer in heard[:windows]
        ]
        bright.append(10.0 * np.log10(gain**2 * frame.image(echo.spectra, echo)[frame.on].max()))
        if stacked > 1:
            picks = [draw.choice(len(images), stacked, replace=False) for _ in range(MEDIANS)]
            images = [np.median([images[n] for n in some], axis=0) for some in picks]
        shares.append(np.mean([frame.found(image) for image in images], axis=0))
    brightest, peaks = np.array(shares).T
    return {
        "case": name,
        "level_db": level,
        "windows": windows,
        "echo_db": [min(bright), max(bright)],  # re 1 Pa2 s, the brightest beam of the frames without any noise
        "brightest": float(brightest.mean()),
        "brightest_range": [float(brightest.min()), float(brightest.max())],
        "peaks": float(peaks.mean()),
        "peaks_range": [float(peaks.min()), float(peaks.max())],
    }


def seas_of(frames: list[Seen], windows: int) -> list[list[tuple[Snapshots, Snapshots | None]]]:
    """What is heard beside the echoes in windows of each frame."""
    made = []
    for frame in frames:
        both = [frame.sea(n) for n in range(windows)]
        made.append([(frame.spectra(a), None if b is None else frame.spectra(b)) for a, b in both])
    return made


def bench(windows: int = WINDOWS) -> dict[str, Any]:
    """Shares by density, distance, level; then with reverberation, by the median over time, and of several windows."""
    rows = []
    for density in DENSITIES:
        mine: list[dict[str, Any]] = []
        for distance in DISTANCES:
            frames = seen(density, distance)
            seas = seas_of(frames, windows)
            mine += [{**row("chorus", frames, windows, level, seas), "distance_m": distance} for level in LEVELS]
            if distance == OTHER_DISTANCE:
                few = max(windows // 3, 4)
                others = [
                    row("median over time", frames, few, OTHER_LEVEL, seas, OrderStatistic()),
                    row(f"median of {STACKED} windows", frames, windows, OTHER_LEVEL, seas, stacked=STACKED),
                ]
        frames = seen(density, OTHER_DISTANCE, ANSWERS)
        seas = seas_of(frames, windows)
        others.insert(0, row("with reverberation", frames, windows, OTHER_LEVEL, seas))
        others.append(
            row(f"with reverberation, median of {STACKED}", frames, windows, OTHER_LEVEL, seas, stacked=STACKED)
        )
        mine += [{**other, "distance_m": OTHER_DISTANCE} for other in others]
        rows += [{**one, "density": density} for one in mine]
    return {"frames": list(FRAMES), "rows": rows}


def table(result: dict[str, Any]) -> str:
    """Shares by density: brightest beam, and one of three peaks after the stroke."""
    of: dict[tuple[str, float, float], dict[float, dict[str, Any]]] = {}
    for one in result["rows"]:
        of.setdefault((one["case"], one["level_db"], one["distance_m"]), {})[one["density"]] = one
    lines = [f"{'found: brightest beam / a peak of three':48s}" + "".join(f"{d:>24.0e}" for d in DENSITIES)]
    for (case, level, distance), by in of.items():
        cells = [
            f"{x['brightest']:.2f} ({x['brightest_range'][0]:.2f}-{x['brightest_range'][1]:.2f}) / {x['peaks']:.2f}"
            for x in by.values()
        ]
        low, high = next(iter(by.values()))["echo_db"]
        what = f"{case}, {level:g} dB, {distance:g} m"
        lines.append(f"{what:48s}" + "".join(f"{cell:>24s}" for cell in cells) + f"  echo {low:.0f} to {high:.0f} dB")
    return "\n".join(lines)
