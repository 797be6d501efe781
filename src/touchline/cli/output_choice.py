"""Results of a command: figures as a table or as JSON; of a finished job a recording and a picture, too."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli.display import print_figures, print_json
from touchline.cli.options import ExitCode, JsonOption, ReportOption, check_plot
from touchline.recordings.writing import check_recordable, check_writable, write_json
from touchline.schemas.setup import Setup


def deliver(title: str, figures: dict[str, Any], report: Path | None, as_json: bool) -> None:
    """Print ``figures``, and write them to the file ``report`` if given.

    Raises:
        SpecError: The file cannot be written.
    """
    if as_json:
        print_json(figures)
    else:
        print_figures(title, figures)
    if report is not None:
        write_json(figures, report)


@dataclass(frozen=True)
class OutputChoice:
    """Destinations of a job's results.

    Raises:
        SpecError: The picture's format is not supported, or a file could not be written.
    """

    record: Annotated[Path | None, typer.Option(metavar="FILE.mcap", help="Record the session to this MCAP file.")] = (
        None
    )
    report: ReportOption = None
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw what was painted or covered to this .svg or .png file.")
    ] = None
    as_json: JsonOption = False

    def __post_init__(self) -> None:
        check_plot(self.plot)
        check_recordable(self.record)
        check_writable(self.report, self.plot)

    def conclude(self, doing: str, template: str, setup: Setup, figures: Mapping[str, Any]) -> None:
        """Print and write the figures, titled ``doing`` of ``template``; the exit code shows success."""
        named = {"template": template, **figures}
        named |= {
            "vehicle": setup.vehicle.name,
            "seed": setup.scenario.seed,
            "follower": setup.onboard.follower,
            "noise": setup.scenario.noise,
        }
        deliver(f"{doing} of {template}", named, self.report, self.as_json)
        if not figures["success"]:
            sys.exit(ExitCode.FAILED)
