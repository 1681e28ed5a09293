"""The chorus: all the snaps of a sea that are heard, but light nothing."""

from __future__ import annotations

from sonarsynth.sources.chorus.shrimp_chorus import Chorus, Clusters
from sonarsynth.sources.chorus.snap_cells import ChorusSnaps, ListeningWindow, draw_snaps

__all__ = ["Chorus", "ChorusSnaps", "Clusters", "ListeningWindow", "draw_snaps"]
