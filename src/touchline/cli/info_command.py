"""``touchline info``: contents of a recording, and its losses."""

from typing import Any

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_event, print_figures, print_json, print_table
from touchline.cli.options import JsonOption, RecordingArgument
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("info")(info)


def info(file: RecordingArgument, as_json: JsonOption = False) -> None:
    """Show a recording's files, times, robots, topics, metadata and attachments, and its losses."""
    from touchline.recordings.recording_info import recording_info

    found = recording_info(file)
    if as_json:
        print_json(found)
        return
    shown = ("complete", "bytes", "messages", "duration_s", "sim_time_s", "wall_time")
    print_figures(f"Recording {file}", {**{name: found[name] for name in shown}, "robots": ", ".join(found["robots"])})
    _print_topics(found["topics"])
    if len(found["files"]) > 1:
        print_figures("Files", {each["name"]: _file(each) for each in found["files"]})
    if found["attachments"]:
        print_figures("Attachments", {each["name"]: f"{each['bytes']:,} bytes" for each in found["attachments"]})
    if found["metadata"]:
        print_figures("Metadata", found["metadata"])
    if found["problem"]:
        print_event(Event.WARN, found["problem"])


def _file(file: dict[str, Any]) -> str:
    ending = "" if file["complete"] and not file["losses"] else ", damaged" if file["losses"] else ", broken off"
    return f"{file['messages']:,} messages, {file['bytes']:,} bytes{ending}"


def _print_topics(topics: dict[str, dict[str, Any]]) -> None:
    table = Table(title="Topics", title_justify="left", box=None, padding=(0, 2))
    for name in ("topic", "type", "encoding"):
        table.add_column(name)
    for name in ("messages", "rate Hz", "bytes"):
        table.add_column(name, justify="right")
    for name, topic in topics.items():
        rate = "–" if topic["rate_hz"] is None else f"{topic['rate_hz']:.4g}"
        texts = (escape(plain(text)) for text in (name, topic["type"], topic["encoding"]))
        table.add_row(*texts, f"{topic['messages']:,}", rate, f"{topic['bytes']:,}")
    print_table(table)
