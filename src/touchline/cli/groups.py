"""Groups of options shared by subcommands: a dataclass in a command's signature stands for its fields."""

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any, get_type_hints

import typer
from typer.models import CommandInfo

from touchline.cli.bus_options import with_bus_options, with_network_option
from touchline.cli.overview import ON_BUS, ON_DASK
from touchline.cli.verbosity import with_verbosity


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return ``command`` for Typer: each parameter that is a dataclass is replaced by the dataclass's fields.

    A field's annotation and default are the option's. The help has arguments and options in the order of the signature;
    a group that follows an option in it is keyword-only, since it has no default.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += _fields_of(groups[name])
        else:
            parameters.append(parameter.replace(annotation=hints[name]))

    @wraps(command)
    def flat(**values: Any) -> None:
        gathered = {name: kind(**{f.name: values.pop(f.name) for f in fields(kind)}) for name, kind in groups.items()}
        command(**gathered, **values)

    by_name = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in parameters]
    flat.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    flat.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return flat


def _fields_of(group: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    shown = inspect.signature(group).parameters
    return [parameter.replace(annotation=hints[name]) for name, parameter in shown.items()]


def in_panel(app: typer.Typer, name: str) -> None:
    """Put every subcommand without a panel into the panel ``name``, and add the options that all have."""
    for command in app.registered_commands:
        if not isinstance(command.rich_help_panel, str):
            command.rich_help_panel = name
            _add_common(command, command.name or "")
    for group in app.registered_groups:
        if not isinstance(group.rich_help_panel, str):
            group.rich_help_panel = name
            for command in group.typer_instance.registered_commands if group.typer_instance else ():
                _add_common(command, group.name or "")


def _add_common(command: CommandInfo, name: str) -> None:
    if command.callback is not None:
        added = with_bus_options if name in ON_BUS else with_network_option if name in ON_DASK else lambda own: own
        command.callback = with_verbosity(added(command.callback))
