"""``touchline export``: recorded topics as tables, the painted field as a map of the earth, a copy for viewers."""

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
    viewer: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.mcap",
            help="Write a copy here with the topics that viewers draw, for recordings made without; it must not exist.",
            show_default=False,
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            metavar="NAME",
            help="Of a recording of several robots, the one on the map; else all.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write topics of a recording as CSV or Parquet (a row a message), its field as GeoJSON, or a copy for viewers.

    The exit code is 1 if not all of the recording could be read.
    """
    check_writable(tables.csv, tables.parquet, geojson)
    check_recordable(viewer)
    if geojson is None and viewer is None and not tables.asked:
        remedy = "say what to write: --csv, --parquet, --geojson or --viewer"
        raise SpecError("command line", "--csv", "is missing", remedy)
    written: dict[str, int] = {}
    problem = tables.write(file, written) if tables.asked else ""
    if geojson is not None:
        from touchline.jobs.single.earth_map import earth_map

        found = earth_map(file, robot)
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
    """Returns what of the recording is not in the copy; empty if all is."""
    from touchline.recordings.viewing_copy import copy_with_viewing

    found, drawn = copy_with_viewing(file, out)
    written["messages"] = found.messages
    say(f"{found.messages:,} messages in {out}, of which {drawn:,} are for viewers")
    return "; ".join(map(str, found.losses))
