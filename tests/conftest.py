"""The same examples on every machine, no deadlines on shared cores, and no choices kept from one run to the next."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("repeatable")
os.environ["SONARSYNTH_CACHE"] = ""
