"""``touchline vehicle`` and ``onboard``: the shipped robot and its computer as files to start from."""

from typing import Annotated

import typer

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import DRIVES, TOOLS
from touchline.schemas.vehicles import Vehicle
from touchline.services.cli.plugin_option import PluginOption


def register(app: typer.Typer) -> None:
    """Add the subcommands."""
    app.command("vehicle")(vehicle)
    app.command("onboard")(onboard)


def vehicle(
    drive: Annotated[str, PluginOption("--drive", DRIVES, "KIND", "What moves it")] = DRIVES.default,
    tool: Annotated[str, PluginOption("--tool", TOOLS, "KIND", "What it works with")] = TOOLS.default,
) -> None:
    """Print a robot as JSON, every field, the shipped one by default: what `--vehicle` takes, to be changed."""
    robot = Vehicle.model_validate({"drive": {"kind": drive}, "tool": {"kind": tool}})
    typer.echo(robot.model_dump_json(indent=1))


def onboard() -> None:
    """Print what the shipped robot's computer is told as JSON, every field: what `--onboard` takes, to be changed."""
    typer.echo(OnboardConfig().model_dump_json(indent=1))
