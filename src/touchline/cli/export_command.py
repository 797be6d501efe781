"""``touchline export``: topics as tables, the field as a map, a copy for viewers."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.display import print_event, print_json, say
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption, RecordingArgument
from touchline.cli.table_choice import TableChoice
from touchline.recordings.writing import check_recordable, check_writable, write_text
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.schemas.optional_packages import require


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("export")(with_groups(export))


def export(
    file: RecordingArgument,
    tables: TableChoice,
    geojson: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write template, plan and paint to this GeoJSON file (WGS 84).")
    ] = None,
    viewer: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.mcap",
            help="Write a copy with the topics that viewers draw, if the recording has none; must not exist.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Robot to put on the map, if the recording holds several (default: all)."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write topics as CSV or Parquet (a row per message), the field as GeoJSON, or a copy for viewers.

    The exit code is 1 if part of the recording could not be read.
    """
    check_writable(tables.csv, tables.parquet, geojson)
    check_recordable(viewer)
    if geojson is None and viewer is None and not tables.asked:
        remedy = "give --csv, --parquet, --geojson or --viewer"
        raise SpecError("command line", "--csv", "is missing", remedy)
    if viewer is not None:
        require("shapely", "--viewer")
    written: dict[str, int] = {}
    problem = tables.write(file, written) if tables.asked else ""
    if geojson is not None:
        from touchline.jobs.single.geojson_map import geojson_map

        found = geojson_map(file, robot)
        write_text(json.dumps(found, allow_nan=False) + "\n", geojson)
        written["features"] = len(found["features"])
        say(f"{written['features']:,} features in {geojson}")
    if viewer is not None:
        problem = "; ".join(filter(None, (problem, _copy_for_viewers(file, viewer, written))))
    if as_json:
        print_json({**written, "problem": problem})
    if problem:
        print_event(Event.WARN, f"{file}: {problem}")
        sys.exit(ExitCode.FAILED)


def _copy_for_viewers(file: Path, out: Path, written: dict[str, int]) -> str:
    """Write the copy and return what is missing from it; empty if nothing is."""
    from touchline.recordings.viewing_copy import copy_with_viewing

    found, drawn = copy_with_viewing(file, out)
    written["messages"] = found.messages
    say(f"{found.messages:,} messages in {out}, of which {drawn:,} are for viewers")
    return "; ".join(map(str, found.losses))
