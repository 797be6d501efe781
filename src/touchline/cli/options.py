"""Options shared by several subcommands, and the exit codes."""

from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.schemas.errors import SpecError
from touchline.schemas.optional_packages import require

if TYPE_CHECKING:
    from touchline.bus import BusConfig

PLOT_ENDINGS = (".svg", ".png")


class ExitCode(IntEnum):
    """Exit codes of the command."""

    OK = 0
    FAILED = 1
    UNUSABLE = 2
    INTERRUPTED = 130


SpeedOption = Annotated[
    str,
    typer.Option(
        "--speed", metavar="FACTOR", help="Pace, × real time (1, 20, 0.5 …), or `max` for as fast as possible."
    ),
]
ReportOption = Annotated[
    Path | None, typer.Option("--report", metavar="FILE", help="Write the figures to this JSON file.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")]
RecordingArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RECORDING", help="A recording: a file or a folder (docs/guides/recordings.md).", show_default=False
    ),
]
RecordingsOption = Annotated[
    Path | None,
    typer.Option(
        "--recordings",
        metavar="FOLDER",
        help="Folder of recordings; none are written elsewhere (default: the current folder).",
        exists=True,
        file_okay=False,
    ),
]
RobotsOption = Annotated[
    Path | None,
    typer.Option(
        "--robots",
        metavar="FILE",
        help="JSON file of robots (robots.md in docs/reference): namespace, vehicle, computer and world of each.",
    ),
]
_ROBOT_HELP = "Namespace of the robot (default: $TOUCHLINE_NAMESPACE, or tt2)."
RobotOption = Annotated[str | None, typer.Option("--robot", metavar="NAME", help=_ROBOT_HELP)]
RecordedRobotOption = Annotated[
    str | None, typer.Option("--robot", metavar="NAME", help="Robot to use, if the recording holds several.")
]
SomeRobotsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--robot",
        metavar="NAME",
        help="Namespace of a robot; may be repeated (default: those in $TOUCHLINE_NAMESPACE, or all).",
    ),
]
LogsOption = Annotated[
    Path | None,
    typer.Option(
        "--logs",
        metavar="FOLDER",
        help="Folder of log files, one for each service's process (default: log in the user's state folder).",
        file_okay=False,
    ),
]
SecureOption = Annotated[
    bool,
    typer.Option(
        "--secure", help="Mutual TLS and access control, with identities from the folder of keys (`touchline keys`)."
    ),
]
SupervisorOption = Annotated[
    int | None,
    typer.Option("--supervisor", hidden=True, help="End when the process with this id is no longer the parent."),
]


def speed_factor(text: str, option: str = "--speed") -> float:
    """Parse a pace: ``max`` as −1, otherwise the number.

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
    """Refuse a picture that cannot be drawn, before any work is done.

    Raises:
        SpecError: The file's ending is not supported.
        MissingExtra: Matplotlib is not installed.
    """
    if path is None:
        return
    if path.suffix not in PLOT_ENDINGS:
        raise SpecError("command line", option, f"ends in {path.suffix!r}", f"use {' or '.join(PLOT_ENDINGS)}")
    require("matplotlib", option)


def config_of(robot: str | None) -> "BusConfig":
    """Return the bus configuration for the named robot, or else the environment's.

    Raises:
        SpecError: The name or the environment is not usable.
    """
    from touchline.bus import BusConfig

    return BusConfig.from_environment([robot] if robot is not None else ())


def refuse_options(options: object, problem: str, remedy: str) -> None:
    """Refuse a dataclass of options that are None unless they are given.

    Raises:
        SpecError: One of them is given.
    """
    for name, value in vars(options).items():
        if value is not None:
            raise SpecError("command line", f"--{name}", f"is {value!s}, {problem}", remedy)
