"""``touchline config``: options that file and environment set."""

import os

import typer
from rich import box
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_json, print_line, print_table
from touchline.cli.options import JsonOption
from touchline.cli.settings_file import SetOption, set_options
from touchline.schemas.bus_variables import CONFIG_VARIABLE, ENDPOINT_VARIABLE, NAMESPACE_VARIABLE

#: Variables that are no option of a subcommand.
_OF_THE_BUS = (ENDPOINT_VARIABLE, NAMESPACE_VARIABLE, CONFIG_VARIABLE)


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("config")(config)


def config(*, as_json: JsonOption = False) -> None:
    """List the options that touchline.toml or the environment set, and from where."""
    from touchline.cli.commands import command_line

    found = [SetOption("every command", "", os.environ[name], name) for name in _OF_THE_BUS if name in os.environ]
    found += set_options(command_line())
    if as_json:
        print_json([each._asdict() for each in found])
        return
    if not found:
        print_line("no option is set by touchline.toml or the environment")
        return
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("command", "option", "value", "from"):
        table.add_column(heading, overflow="fold")
    for each in found:
        table.add_row(*map(escape, each))
    print_table(table)
