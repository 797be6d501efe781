"""The command's entry: every subcommand, and how its errors reach a person."""

import io
import os
import sys
import traceback
from importlib import import_module
from typing import Annotated

import typer

from touchline.cli.display import Verbosity
from touchline.cli.groups import in_panel
from touchline.cli.options import ExitCode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.plain_text import plain_lines
from touchline.schemas.plugin_packages import blamed

#: The subcommands of each module, by panel, in the order of the help: what belongs together, and what is done first
#: before what is done with it.
PANELS: dict[str, dict[str, tuple[str, ...]]] = {
    "Jobs": {
        "demo_command": ("demo",),
        "plan_command": ("plan",),
        "run_command": ("run",),
        "simulate_command": ("simulate",),
        "goto_command": ("goto",),
        "fleet_command": ("fleet",),
        "sweep_command": ("sweep",),
        "study_command": ("study",),
    },
    "Drawings and robots": {
        "template_commands": ("templates",),
        "vehicle_commands": ("vehicle", "onboard"),
    },
    "The running system": {
        "system_commands": ("up", "status", "down"),
        "order_command": ("order", "fault", "topics"),
    },
    "Recordings": {
        "record_command": ("record",),
        "replay_command": ("replay",),
        "playback_command": ("playback",),
        "info_command": ("info",),
        "echo_command": ("echo",),
        "hz_command": ("hz",),
        "export_command": ("export",),
        "salvage_command": ("salvage",),
        "compare_command": ("compare",),
        "check_command": ("check",),
        "import_command": ("import",),
        "estimate_command": ("estimate",),
        "picture_command": ("picture",),
    },
    "Processes, each alone": {
        "service_commands": ("planner", "robot-sim", "bridge", "coordinator", "tui"),
    },
}


def command_line(asked: str | None = None) -> typer.Typer:
    """The command with its subcommands.

    Args:
        asked: The subcommand that is going to be run. Only its module is loaded: all of them take longer to import than
            most have to do. All are loaded if it is None or there is none of that name.
    """
    app = typer.Typer(
        name="touchline",
        help="Plan, drive and record ground robots that mark lines or cover areas, emulated ones included.",
        no_args_is_help=True,
        invoke_without_command=True,
        add_completion=True,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(touchline)
    known = asked == "--version" or any(asked in names for modules in PANELS.values() for names in modules.values())
    for panel, modules in PANELS.items():
        for module, names in modules.items():
            if not known or asked in names:
                import_module(f"touchline.cli.{module}").register(app)
                in_panel(app, panel)
    return app


def touchline(
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.", is_eager=True)] = False,
) -> None:
    """Plan, drive and record ground robots that mark lines or cover areas, emulated ones included."""
    if version:
        from importlib.metadata import version as version_of

        typer.echo(f"touchline {version_of('touchline')}")
        raise typer.Exit


def execute() -> int:
    """Run the command; what a person can mend is told in one line, without a traceback.

    Returns:
        The exit code.

    Raises:
        KeyboardInterrupt: It was interrupted before or after the work of a subcommand.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # where the locale has no ² or ·, a question mark will do
    completing = "_TOUCHLINE_COMPLETE" in os.environ
    try:
        command_line(sys.argv[1] if len(sys.argv) > 1 and not completing else None)()
    except TouchlineError as error:
        return _report(error)
    except Exception as error:
        plugin_error = blamed(error)
        if plugin_error is None:
            raise
        return _report(plugin_error)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else ExitCode.OK
    return ExitCode.OK


def _report(error: TouchlineError) -> int:
    if Verbosity.verbose:
        traceback.print_exc()
    sys.stderr.write(f"error: {plain_lines(str(error))}\n")
    return ExitCode.UNUSABLE
