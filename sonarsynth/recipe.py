"""A recipe: the seed, the scene, and which frames make the dataset. `frame(i)` is the only way to a frame."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge
from pydantic import TypeAdapter

from sonarsynth.description import description
from sonarsynth.scene import Frame, Scene
from sonarsynth.tracing.ray_request import RayRequest

SPLITS = ("train", "validation", "test")
"""Names of the splits, in the order of their numbers in the store."""


@description
class Recipe:
    """A dataset: `frames` frames of one scene along its trajectory, drawn from one seed."""

    title: str = "sonarsynth dataset"
    seed: Annotated[int, Ge(0)] = 0
    licence: str = "CC-BY-4.0"
    """Licence of the dataset (not of the software)."""
    scene: Scene
    rays: RayRequest | None = None
    """Rays to follow through the scene, for `sonarsynth rays`; they do not change the dataset."""

    @property
    def frames(self) -> int:
        """Number of frames of the whole dataset."""
        return self.scene.trajectory.frames

    def frame(self, index: int) -> tuple[Scene, Frame]:
        """Scene and frame number `index`; raises IndexError outside 0..frames-1."""
        if not 0 <= index < self.frames:
            raise IndexError(f"frame {index} is outside 0..{self.frames - 1}")
        return self.scene, self.scene.frame(index, index=index, seed=self.seed)

    def split(self, index: int) -> int:
        """Index into SPLITS of a frame: one trajectory is one sequence, and a sequence is never divided."""
        return 0

    def as_json(self) -> dict[str, Any]:
        """The resolved recipe as plain JSON values."""
        value: dict[str, Any] = _ADAPTER.dump_python(self, mode="json")
        return value

    @property
    def digest(self) -> str:
        """SHA-256 of everything in the recipe that decides numbers: descriptions, seed, and what the files hold.

        Where the files lie does not matter.
        """
        deciding = {name: value for name, value in self.as_json().items() if name != "rays"}
        meshes = {t.name: mesh.digest for t, mesh in zip(self.scene.world.targets, self.scene.meshes, strict=True)}
        text = json.dumps([_by_content(deciding), meshes], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _by_content(value: Any) -> Any:
    """The same JSON value with the path of each file replaced by the digest of what it holds."""
    if isinstance(value, dict):
        path = value.get("path")
        held = {"path": hashlib.sha256(Path(path).read_bytes()).hexdigest()} if isinstance(path, str) else {}
        return {name: _by_content(v) for name, v in value.items()} | held
    return [_by_content(v) for v in value] if isinstance(value, list) else value


_ADAPTER: TypeAdapter[Recipe] = TypeAdapter(Recipe)
