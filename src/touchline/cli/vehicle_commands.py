"""``touchline vehicle`` and ``onboard``: the shipped robot and its computer as files to start from."""

from typing import Annotated

import typer

from touchline.cli.plugin_option import PluginOption
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import DRIVES, TOOLS
from touchline.schemas.spec import EVERY_FIELD
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import DEFAULT_NAME, SHIPPED, with_its_own


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    app.command("vehicle")(vehicle)
    app.command("onboard")(onboard)


def vehicle(
    name: Annotated[str | None, typer.Argument(help=f"A shipped robot ({', '.join(SHIPPED)}) or a JSON file.")] = None,
    drive: Annotated[str | None, PluginOption("--drive", DRIVES, "KIND", "Drive")] = None,
    tool: Annotated[str | None, PluginOption("--tool", TOOLS, "KIND", "Tool")] = None,
) -> None:
    """Print a robot (default: the first shipped one) as JSON with every field, to change and give as `--vehicle`.

    With another kind of drive or tool, every field has that kind's default.
    """
    robot = load_vehicle(name) if name else Vehicle()
    parts = {part: {"kind": kind} for part, kind in (("drive", drive), ("tool", tool)) if kind}
    if parts:
        robot = Vehicle.model_validate(robot.model_dump() | parts)
    typer.echo(robot.model_dump_json(indent=1, context=EVERY_FIELD))


def onboard() -> None:
    """Print the shipped robot's computer as JSON with every field, to change and give as `--onboard`."""
    typer.echo(with_its_own(DEFAULT_NAME, OnboardConfig()).model_dump_json(indent=1, context=EVERY_FIELD))
