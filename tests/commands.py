"""The command line, called from a test."""

from __future__ import annotations

import pytest

from sonarsynth.cli import main


def status(*arguments: str) -> object:
    """What a command ends with."""
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    return end.value.code
