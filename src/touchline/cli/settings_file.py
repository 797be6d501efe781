"""Options from a file and from the environment: what the command line leaves out.

`touchline.toml` in the current folder, or the file that `TOUCHLINE_CONFIG` names, has a table for each subcommand. An
environment variable has the name of subcommand and option, `TOUCHLINE_SIMULATE_SEED`. The command line comes first,
then the environment, then the file.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from touchline.schemas.errors import SpecError
from touchline.schemas.near_names import did_you_mean

PREFIX: Final = "TOUCHLINE"
FILE_VARIABLE: Final = f"{PREFIX}_CONFIG"
FILE_NAME: Final = "touchline.toml"
Command = TyperCommand | TyperGroup
_NOT_SET: Final = ("help", "version", "install_completion", "show_completion")


class SetOption(NamedTuple):
    """Option that is set elsewhere than on the command line.

    Attributes:
        command: Subcommand, such as `simulate` or `fleet run`.
        option: Its option, such as `--seed`.
        value: Value that it gets, as text.
        source: Name of the file or of the environment variable.
    """

    command: str
    option: str
    value: str
    source: str


def settings_path() -> Path | None:
    """Path of the settings file; None if there is none.

    Raises:
        SpecError: The environment names a file that is not there.
    """
    named = os.environ.get(FILE_VARIABLE)
    if named:
        if not Path(named).is_file():
            raise SpecError(FILE_VARIABLE, "", f"is {named!r}, which is not a file", "name one, or unset the variable")
        return Path(named)
    return Path(FILE_NAME) if Path(FILE_NAME).is_file() else None


def settings() -> dict[str, Any]:
    """Content of the settings file; empty if there is none.

    Raises:
        SpecError: It cannot be read.
    """
    path = settings_path()
    if path is None:
        return {}
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise SpecError(
            str(path), "", f"cannot be used ({error})", "mend it; docs/reference/commands.md tells how"
        ) from error


def command_of(app: typer.Typer) -> Command:
    """Command of an application of Typer."""
    found = typer.main.get_command(app)
    assert isinstance(found, TyperCommand | TyperGroup), "as Typer makes them"
    return found


def defaults_for(command: Command, given: Mapping[str, Any], place: str = "") -> dict[str, Any]:
    """Convert the tables of a file to the defaults that Click takes.

    Args:
        command: The command, with those subcommands that may run.
        given: Tables and values by name.
        place: Name of the table, for errors.

    Raises:
        SpecError: A name is neither an option nor a subcommand.
    """
    named = _options(command)
    known = _subcommands(command)
    found: dict[str, Any] = {}
    for name, value in given.items():
        inside = f"{place}.{name}".lstrip(".")
        if isinstance(value, dict):
            if name in known:
                found[name] = defaults_for(known[name], value, inside)
            elif place:
                raise SpecError(_file(), inside, "is not a subcommand", did_you_mean(name, known) or "remove it")
        elif name not in named:
            raise SpecError(_file(), inside, "is not an option", did_you_mean(name, named) or "remove it")
        else:
            found[str(named[name].name)] = value
    return found


def _file() -> str:
    return str(settings_path() or FILE_NAME)


def _subcommands(command: Command) -> dict[str, Command]:
    return dict(command.commands) if isinstance(command, TyperGroup) else {}  # type: ignore[arg-type]


def _options(command: Command) -> dict[str, TyperOption]:
    """Options by their long names without dashes in front."""
    return {
        name.removeprefix("--"): option
        for option in command.params
        if isinstance(option, TyperOption) and option.name not in _NOT_SET
        for name in option.opts
        if name.startswith("--")
    }


def set_options(app: typer.Typer) -> Iterator[SetOption]:
    """Find the options of a command that file or environment set.

    Raises:
        SpecError: The file cannot be used.
    """
    command = command_of(app)
    given = settings()
    for name in given:
        if name not in _subcommands(command):
            raise SpecError(
                _file(), name, "is not a subcommand", did_you_mean(name, _subcommands(command)) or "remove it"
            )
    yield from _set_in(command, defaults_for(command, given), "", _file())


def _set_in(command: Command, defaults: Mapping[str, Any], place: str, file: str) -> Iterator[SetOption]:
    for name, option in _options(command).items():
        variable = "_".join([PREFIX, *place.upper().replace("-", "_").split(), str(option.name).upper()])
        if place and variable in os.environ:
            yield SetOption(place, f"--{name}", os.environ[variable], variable)
        elif option.name in defaults:
            yield SetOption(place, f"--{name}", str(defaults[option.name]), file)
    for name, inner in _subcommands(command).items():
        yield from _set_in(inner, defaults.get(name, {}), f"{place} {name}".strip(), file)
