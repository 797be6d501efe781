"""``touchline vehicle`` and ``onboard``: the shipped robot and its computer as files to start from."""

import typer

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicle import Vehicle


def register(app: typer.Typer) -> None:
    """Add the subcommands."""
    app.command("vehicle")(vehicle)
    app.command("onboard")(onboard)


def vehicle() -> None:
    """Print the shipped robot as JSON, every field: what `--vehicle` takes, to be changed."""
    typer.echo(Vehicle().model_dump_json(indent=1))


def onboard() -> None:
    """Print what the shipped robot's computer is told as JSON, every field: what `--onboard` takes, to be changed."""
    typer.echo(OnboardConfig().model_dump_json(indent=1))
