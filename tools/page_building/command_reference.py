"""The page of all commands with their options, from what `--help` says."""

from __future__ import annotations

from typing import Any, get_args

import typer

from sonarsynth.cli import app
from tools.page_building.tables import MADE, cell, table

INTRODUCTION = """# Command line

Every command with its arguments and options, as `sonarsynth COMMAND --help` says them. In a clone the command is
`tools/sonarsynth`. [Commands](commands.md) says what each is for, with examples and exit statuses.
"""


def commands() -> str:
    """The page, a section a command."""
    group: Any = typer.main.get_command(app)
    sections = [section(name, command) for name, command in sorted(group.commands.items())]
    return f"{MADE}{INTRODUCTION}\n" + "\n\n".join(sections) + "\n"


def section(name: str, command: Any) -> str:
    """What a command does, and a table of what it takes."""
    rows = [row(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)]
    text = "\n\n".join(cell(part) for part in (command.help or "").split("\n\n"))
    return f"## {name}\n\n{text}" + (f"\n\n{table(('', 'default', ''), rows)}" if rows else "")


def row(parameter: Any) -> tuple[str, str, str]:
    """Spelling, default and text of an argument or an option."""
    if parameter.param_type_name == "argument":
        default = "" if parameter.required or parameter.default is None else str(parameter.default)
        return f"`{parameter.name.upper()}`", default, parameter.help or ""
    spelling = "/".join([*parameter.opts, *parameter.secondary_opts])
    takes = "" if parameter.is_flag else f" {parameter.metavar or words(parameter)}"
    silent = parameter.default in (None, False, "", []) or parameter.is_flag
    said = parameter.show_default if isinstance(parameter.show_default, str) else ""
    return f"`{spelling}{takes}`", said if silent else str(parameter.default), parameter.help or ""


def words(parameter: Any) -> str:
    """What an option takes: its choices, or its name."""
    choices = get_args(parameter.type_descriptor.annotation)
    return "|".join(choices) if choices and all(isinstance(one, str) for one in choices) else parameter.name.upper()
