"""Films: an MP4 where ffmpeg is installed, else a GIF."""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from sonarsynth.conventions import Progress
from sonarsynth.pictures.figures.style import BACKDROP, ENERGY_MAP, OUTLINES, pixels
from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

LONGEST = 128
"""Frames of a film at most."""

Item = TypeVar("Item")


def thinned(frames: Sequence[Item]) -> list[Item]:
    """The frames of a film: all, or of more than `LONGEST` every second, third ... of them."""
    return list(frames[:: -(-len(frames) // LONGEST) or 1])


def write_film(
    onto: Figure,
    show: Callable[[Item], None],
    views: Sequence[Item],
    folder: Path,
    frames_per_second: float,
    progress: Progress | None = None,
) -> Path:
    """Draw views one after another into `folder`/film.mp4 or film.gif; returns its path. show: draws one onto a figure,
    in place of the last."""
    if shutil.which("ffmpeg"):
        path = folder / "film.mp4"
        if _mp4(_drawn(onto, show, views, progress), path, frames_per_second):
            return path
        path.unlink(missing_ok=True)  # an ffmpeg without the codec
    return _gif(_drawn(onto, show, views, progress), folder / "film.gif", frames_per_second)


def _drawn(
    onto: Figure, show: Callable[[Item], None], views: Sequence[Item], progress: Progress | None
) -> Iterator[np.ndarray]:
    """Pixels (row, column, rgba) of one view after another."""
    for n, view in enumerate(views, 1):
        show(view)
        yield pixels(onto)
        if progress is not None:
            progress(n, len(views), 0)


def _mp4(shots: Iterator[np.ndarray], path: Path, frames_per_second: float) -> bool:
    """Whether ffmpeg took all frames, as raw pixels."""
    maker: subprocess.Popen[bytes] | None = None
    try:
        for shot in shots:
            if maker is None:
                size = f"{shot.shape[1]}x{shot.shape[0]}"
                raw = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", size, "-r", str(frames_per_second), "-i", "-"]
                even = ["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]  # what players take
                command = ["ffmpeg", "-y", "-loglevel", "error", *raw, *even, str(path)]
                maker = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
            assert maker.stdin is not None
            maker.stdin.write(shot.tobytes())
    except OSError:
        pass
    finally:
        if maker is not None:
            with suppress(OSError):
                maker.communicate()
    return maker is not None and maker.returncode == 0


def _gif(shots: Iterator[np.ndarray], path: Path, frames_per_second: float) -> Path:
    from PIL import Image

    colours = _palette()
    plain = (Image.fromarray(shot).convert("RGB") for shot in shots)
    frames = [shot.quantize(palette=colours, dither=Image.Dither.NONE) for shot in plain]
    milliseconds = max(20, round(1000 / frames_per_second))
    content, settings = io.BytesIO(), {"duration": milliseconds, "loop": 0, "optimize": False}
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:], **settings)
    write_atomically(path, content.getvalue())
    return path


def _palette() -> Image:
    """256 colours, the same for all frames: the energy map, greys, and the outlines on their background."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb
    from PIL import Image

    energy = colormaps[ENERGY_MAP](np.linspace(0.0, 1.0, 184))[:, :3]
    greys = np.repeat(np.linspace(0.0, 1.0, 39)[:, None], 3, axis=1)
    blend = np.linspace(0.0, 1.0, 8)[:, None]
    mixed = [(1 - blend) * to_rgb(BACKDROP) + blend * to_rgb(colour) for colour in OUTLINES]
    table = np.round(255 * np.concatenate([energy, greys, *mixed, [to_rgb(BACKDROP)]])).astype(np.uint8)
    palette = Image.new("P", (1, 1))
    palette.putpalette(table.tobytes())
    return palette
