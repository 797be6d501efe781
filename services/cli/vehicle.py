"""``touchline vehicle``: the shipped robot as a file to start from."""

import typer

from touchline.schemas.vehicle import Vehicle


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("vehicle")(vehicle)


def vehicle() -> None:
    """Print the shipped robot as JSON, every field: what `--vehicle` takes, to be changed."""
    typer.echo(Vehicle().model_dump_json(indent=1))
