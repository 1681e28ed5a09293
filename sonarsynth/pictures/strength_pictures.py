"""Target strength of a body over aspect and frequency: the table, in a file, and its picture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, counted, finite_json
from sonarsynth.pictures.figures.strength_figure import strength_figure
from sonarsynth.pictures.figures.style import save
from sonarsynth.scattering import Scattering
from sonarsynth.store.files.place import write_atomically
from sonarsynth.targets.shapes import Shape
from sonarsynth.targets.target_strength import target_strength


@dataclass(frozen=True, eq=False)
class StrengthTable:
    """Backscatter of a body round its z axis."""

    aspect: Floats  # (aspect,) rad: where the sonar is, 0 ahead, port positive
    frequency: Floats  # (frequency,) Hz
    strength: Floats  # (aspect, frequency) dB re 1 m2; -inf where nothing comes back

    def as_json(self) -> dict[str, Any]:
        """Numbers for programs: aspects in degrees, null for -inf."""
        return {
            "aspect_deg": np.rad2deg(self.aspect).round(9).tolist(),
            "frequency_hz": self.frequency.tolist(),
            "target_strength_db": finite_json(self.strength),
        }

    def summary(self) -> str:
        """Highest, lowest and mean, in one line."""
        finite = np.isfinite(self.strength)
        if not finite.any():
            return "nothing comes back at any aspect"
        high = np.unravel_index(np.argmax(np.where(finite, self.strength, -np.inf)), self.strength.shape)
        mean = 10.0 * np.log10(np.mean(10.0 ** (self.strength / 10.0)))
        at = f"{np.rad2deg(self.aspect[high[0]]):g} deg and {self.frequency[high[1]] / 1e3:g} kHz"
        return (
            f"{counted(self.strength.size, 'level')}: maximum {self.strength[high]:.1f} dB re 1 m2 at {at}, "
            f"median {np.median(self.strength):.1f} dB, mean power {mean:.1f} dB"
        )


def strength_table(
    shape: Shape, frequency: Floats, aspect: Floats, sound_speed: float, law: Scattering
) -> StrengthTable:
    """Backscatter of a shape at frequencies (frequency,) Hz and aspects (aspect,) rad. Raises as `target_strength`."""
    towards = np.stack([np.cos(aspect), np.sin(aspect), np.zeros(len(aspect))], axis=-1)[:, None]
    return StrengthTable(aspect, frequency, target_strength(shape, frequency, -towards, towards, sound_speed, law))


def write_strength(table: StrengthTable, title: str, out: Path) -> list[Path]:
    """Write `target_strength.csv` (aspect, frequency, level) and `target_strength.png` into a folder; their paths."""
    out.mkdir(parents=True, exist_ok=True)
    files = [out / "target_strength.csv", out / "target_strength.png"]
    lines = ["aspect_deg,frequency_hz,target_strength_db"]
    for aspect, levels in zip(np.rad2deg(table.aspect), table.strength, strict=True):
        rows = zip(table.frequency, levels, strict=True)
        lines += [f"{aspect:.9g},{frequency:.9g},{level:.4f}" for frequency, level in rows]
    write_atomically(files[0], ("\r\n".join(lines) + "\r\n").encode())
    save(strength_figure(title, table.aspect, table.frequency, table.strength), files[1])
    return files
