"""``touchline salvage``: the readable part of a damaged recording, as a sound one."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.display import print_event, print_figures, print_json
from touchline.cli.options import ExitCode, JsonOption, RecordingArgument
from touchline.recordings.writing import check_recordable
from touchline.schemas.messages import Event


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("salvage")(salvage)


def salvage(
    file: RecordingArgument,
    out: Annotated[Path, typer.Argument(metavar="OUT.mcap", help="File to write; must not exist.")],
    as_json: JsonOption = False,
) -> None:
    """Copy all that can be read of a recording to a complete, indexed file; exit code 1 if something is lost."""
    from touchline.recordings.salvage import salvage as salvaged

    check_recordable(out)
    found = salvaged(file, out)
    figures = {"path": str(out), "messages": found.messages, "attachments": found.attachments, "lost": found.lost}
    if as_json:
        figures["losses"] = [asdict(loss) for loss in found.losses]
        figures["ending"] = found.ending
        print_json(figures)
    else:
        shown = {**figures, "lost": "unknown" if found.lost is None else found.lost}
        print_figures(f"Salvaged from {file}", shown)
    for loss in found.losses:
        print_event(Event.WARN, str(loss))
    if found.ending:
        print_event(Event.INFO, f"{file.name} is {found.ending}")
    if found.losses:
        sys.exit(ExitCode.FAILED)
