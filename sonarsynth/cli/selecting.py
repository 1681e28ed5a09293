"""Texts of the command line that select frames and products."""

from __future__ import annotations

import re

from sonarsynth.cli.running import BadOption


def frame_numbers(text: str | None, count: int) -> tuple[int, ...] | None:
    """Frames named by "0:8", "3", "8:" or several with commas; None (all) for None. Raises BadOption."""
    if text is None:
        return None
    chosen: set[int] = set()
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d*)(:?)(\d*)\s*", part)
        if found is None or not part.strip() or not (found[2] or found[1]):
            raise BadOption(f"--frames: '{part}' is no frame and no range such as 0:8")
        first = int(found[1] or 0)
        stop = (int(found[3]) if found[3] else count) if found[2] else first + 1
        if stop > count:
            raise BadOption(f"--frames: '{part}' ends past the last frame, {count - 1}")
        if stop <= first:
            raise BadOption(f"--frames: '{part}' holds no frame; there are 0 to {count - 1}")
        chosen.update(range(first, stop))
    return tuple(sorted(chosen))


def product_names(text: str) -> frozenset[str]:
    """Products named with commas. Raises BadOption."""
    from sonarsynth.planning import chosen_products

    try:
        return chosen_products(part.strip() for part in text.split(",") if part.strip())
    except ValueError as error:
        raise BadOption(f"--products: {error}") from None
