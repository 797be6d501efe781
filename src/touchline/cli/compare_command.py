"""``touchline compare``: two recordings compared message by message."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.display import print_json, print_line
from touchline.cli.options import ExitCode, JsonOption


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("compare")(compare)


def compare(
    left: Annotated[
        Path, typer.Argument(metavar="FIRST", help="Recording to compare with (docs/guides/recordings.md).")
    ],
    right: Annotated[Path, typer.Argument(metavar="SECOND", help="The other recording.")],
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic", metavar="TOPIC", help="Compare only this topic, such as /tt2/odometry/filtered; may be repeated."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare two recordings message by message; exit code 1 if they differ by more than the topics' tolerances."""
    from touchline.recordings.compare import compare as compared

    comparison = compared(left, right, topics or None)
    if as_json:
        found = {name: asdict(topic) for name, topic in comparison.topics.items()}
        verdict = {
            "same": comparison.same,
            "identical": comparison.identical,
            "names": comparison.names,
            "problems": comparison.problems,
            "notes": comparison.notes,
        }
        print_json(verdict | {"topics": found})
    else:
        for line in comparison.lines():
            print_line(line)
        alike = "the same within the tolerances" if comparison.same else "different"
        print_line(f"the sessions are {'identical' if comparison.identical else alike}")
    if not comparison.same:
        sys.exit(ExitCode.FAILED)
