"""The card of a dataset: what people read (Markdown) and what programs read (Croissant), made from the store alone.

Both lie beside the store, not in it: what is in a store is only what was laid out and written, to the byte.
"""

from __future__ import annotations

import json
from pathlib import Path

from sonarsynth.store import Damage, Folder, Mismatch, absolute, beside, folder_of
from sonarsynth.store.cards.croissant import croissant
from sonarsynth.store.cards.facts import facts_of
from sonarsynth.store.cards.markdown import markdown
from sonarsynth.store.files.place import read_beside, write_atomically

__all__ = ["croissant", "facts_of", "markdown", "write"]


def write(store: Folder | str, folder: Folder | str | None = None) -> tuple[Folder, Folder]:
    """Write `<store>.card.md`, the card, and `<store>.croissant.json`, the Croissant metadata.

    Parameters
    ----------
    store: folder or URL of a store.
    folder: where the files go (default: beside the store).

    Returns
    -------
    The two files.

    Raises
    ------
    store.Mismatch where there is no store of ours, store.Damage where its metadata cannot be read, OSError where the
    files cannot be written.
    """
    store = absolute(store)
    facts = facts_of(store)
    try:
        texts = {"card.md": markdown(facts), "croissant.json": json.dumps(croissant(facts), indent=2) + "\n"}
    except (TypeError, ValueError, KeyError, AttributeError, IndexError, RecursionError) as error:
        kind = type(error).__name__
        raise Damage(f"{store}: what it says of itself is not of the types that a store has ({kind})") from None
    files = [beside(store, suffix) for suffix in texts]
    if folder is not None:
        folder = folder_of(folder)
        if isinstance(folder, Path):
            folder.mkdir(parents=True, exist_ok=True)
        files = [folder / file.name for file in files]
    for file, text in zip(files, texts.values(), strict=True):
        if _there(file) != text.encode():
            write_atomically(file, text.encode())
    return files[0], files[1]


def _there(file: Folder) -> bytes:
    """What a file holds; nothing where it is none that we wrote."""
    try:
        return read_beside(file)
    except (OSError, Mismatch):
        return b""
