"""What a description of the sound speed says of itself beside its numbers."""

from __future__ import annotations

from typing import ClassVar

from sonarsynth.description.method import Method


class SpeedModel(Method):
    """A description of the sound speed over depth."""

    measured: ClassVar[bool] = False
    """Whether it was measured, at some depths: then it may end above the bottom, and is that of real water."""
