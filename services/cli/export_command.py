"""``touchline export``: recorded topics as tables, and the painted field as a map of the earth."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.services.cli.display import print_event, say
from touchline.services.cli.groups import with_groups
from touchline.services.cli.options import ExitCode, RecordingArgument
from touchline.services.cli.table_choice import TableChoice
from touchline.services.runs.writing import check_writable, write_text


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("export")(with_groups(export))


def export(
    file: RecordingArgument,
    tables: TableChoice,
    geojson: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write template, plan and paint as GeoJSON in WGS 84 here.", show_default=False
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", metavar="NAME", help="Of a recording of several robots, the one on the map.", show_default=False
        ),
    ] = None,
) -> None:
    """Write topics of a recording as CSV or Parquet, a row a message, or its field as GeoJSON.

    The exit code is 1 if not all of the recording could be read.
    """
    check_writable(tables.csv, tables.parquet, geojson)
    if geojson is None and not tables.asked:
        raise SpecError("command line", "--csv", "is missing", "say what to write: --csv, --parquet or --geojson")
    problem = tables.write(file) if tables.asked else ""
    if geojson is not None:
        from touchline.services.runs.earth_map import earth_map

        found = earth_map(file, robot)
        write_text(json.dumps(found, allow_nan=False) + "\n", geojson)
        say(f"{len(found['features']):,} features in {geojson}")
    if problem:
        print_event(Event.WARN, f"{file}: {problem}")
        sys.exit(ExitCode.FAILED)
