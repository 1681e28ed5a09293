"""The same examples on every machine, no deadlines on shared cores, and no search for garbage where there is none."""

from __future__ import annotations

import gc
from collections.abc import Generator

import pytest
from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("repeatable")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Libraries and tests stay to the end: looking through them for garbage took a third of collecting."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
