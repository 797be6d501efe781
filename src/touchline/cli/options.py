"""Options that several subcommands share, and the exit codes."""

from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer

from touchline.bus import BusConfig
from touchline.schemas.errors import SpecError

PLOT_ENDINGS = (".svg", ".png")


class ExitCode(IntEnum):
    """What the command's exit code says."""

    OK = 0
    FAILED = 1
    UNUSABLE = 2
    INTERRUPTED = 130


SpeedOption = Annotated[
    str,
    typer.Option("--speed", metavar="FACTOR", help="Times real time (1, 20, 0.5 …), or `max` for as fast as it goes."),
]
ReportOption = Annotated[
    Path | None,
    typer.Option("--report", metavar="FILE", help="Write the figures to this JSON file.", show_default=False),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
RecordingArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RECORDING", help="A recording: a file or a folder (docs/recording.md).", show_default=False
    ),
]
RecordingsOption = Annotated[
    Path | None,
    typer.Option(
        "--recordings",
        metavar="FOLDER",
        help="The folder that recordings go to, and none elsewhere; by default where this is started.",
        exists=True,
        file_okay=False,
        show_default=False,
    ),
]
RobotsOption = Annotated[
    Path | None,
    typer.Option(
        "--robots",
        metavar="FILE",
        help="JSON file of several robots, each with its namespace, vehicle, computer and world (docs/robots.md).",
        show_default=False,
    ),
]
_ROBOT_HELP = "Namespace of the robot; default: $TOUCHLINE_NAMESPACE, or tt2."
RobotOption = Annotated[str | None, typer.Option("--robot", metavar="NAME", help=_ROBOT_HELP, show_default=False)]
SomeRobotsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--robot",
        metavar="NAME",
        help="Namespace of a robot; may be repeated. Default: those in $TOUCHLINE_NAMESPACE, or all.",
        show_default=False,
    ),
]
SupervisorOption = Annotated[
    int | None, typer.Option("--supervisor", hidden=True, help="End when this process is not the parent any more.")
]


def speed_factor(text: str, option: str = "--speed") -> float:
    """``max`` as −1, otherwise the number.

    Raises:
        SpecError: It is neither.
    """
    if text == "max":
        return -1.0
    try:
        factor = float(text)
    except ValueError:
        factor = -1.0
    if not 0 < factor <= 10_000:
        raise SpecError("command line", option, f"is {text!r}", "give a number above 0 (times real time) or max")
    return factor


def check_plot(path: Path | None, option: str = "--plot") -> None:
    """Refuse a picture of a kind that cannot be drawn, before any work is done.

    Raises:
        SpecError: The file's ending is none of ours.
    """
    if path is not None and path.suffix not in PLOT_ENDINGS:
        raise SpecError("command line", option, f"ends in {path.suffix!r}", f"use {' or '.join(PLOT_ENDINGS)}")


def config_of(robot: str | None) -> BusConfig:
    """The bus, and the robot that is named, or else the environment's.

    Raises:
        SpecError: It cannot be used.
    """
    return BusConfig.from_environment([robot] if robot is not None else ())
