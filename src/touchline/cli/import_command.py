"""``touchline import``: converts logs of other robots and receivers to sessions."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_event, print_figures, print_json, print_table, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("import")(with_groups(import_))


@dataclass(frozen=True)
class LogChoice:
    """Mapping and destination of imported logs."""

    mapping: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="JSON file that maps streams to sensors (docs/guides/logs.md)."),
    ] = None
    out: Annotated[Path | None, typer.Option(metavar="FILE.mcap", help="Session to write.")] = None
    listed: Annotated[
        bool, typer.Option("--list", help="List the streams in the logs and propose a mapping; write nothing.")
    ] = False

    def check(self) -> None:
        """Raise `SpecError` if the options contradict each other."""
        if not self.listed and self.out is None:
            raise SpecError("command line", "--out", "is missing", "name the session to write, or use --list")


def import_(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG…", help="Logs of one robot and one drive.")],
    *,
    choice: LogChoice,
    as_json: JsonOption = False,
) -> None:
    """Convert a ROS 1 or 2 bag, NMEA, UBX, RTKLIB solutions or tables to a session, for `touchline estimate`.

    Without a mapping, streams are mapped by their standard types.
    """
    from touchline.checking.importing.import_logs import import_logs, load_mapping
    from touchline.checking.importing.mapping_proposal import log_list, proposal
    from touchline.recordings.writing import check_recordable

    choice.check()
    if choice.listed:
        streams, proposed = log_list(logs)
        if as_json:
            print_json({"streams": streams, "mapping": proposed})
            return
        _print_streams(streams)
        print_json(proposed)
        return
    assert choice.out is not None
    check_recordable(choice.out)
    mapping = load_mapping(choice.mapping) if choice.mapping is not None else proposal(logs)
    folder = choice.mapping.parent if choice.mapping is not None else Path()
    with progress_bar("Import") as advance:
        done = import_logs(logs, mapping, choice.out, folder, advance)
    if as_json:
        print_json({**done.figures, "told": done.remarks, "problem": done.problem})
    else:
        print_figures(f"Session {choice.out}", done.figures)
    for line in done.remarks:
        print_event(Event.WARN, line)
    if done.problem:
        print_event(Event.ERROR, f"the session is not whole: {done.problem}")
        sys.exit(ExitCode.FAILED)


def _print_streams(streams: list[dict[str, object]]) -> None:
    table = Table(box=None, padding=(0, 2))
    for name in ("stream", "type"):
        table.add_column(name)
    for name in ("messages", "rate Hz", "from s", "to s"):
        table.add_column(name, justify="right")
    table.add_column("note")
    for stream in streams:
        numbers = (f"{stream[name]:,.3f}" if stream[name] is not None else "–" for name in ("from_s", "to_s"))
        rate = "–" if stream["rate_hz"] is None else f"{stream['rate_hz']:.4g}"
        texts = (escape(plain(str(stream[name]), 200)) for name in ("stream", "type"))
        table.add_row(*texts, f"{stream['messages']:,}", rate, *numbers, escape(plain(str(stream["note"]), 200)))
    print_table(table)
