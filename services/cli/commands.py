"""The command's entry: every subcommand, and how its errors reach a person."""

import io
import sys
from typing import Annotated

import typer

from touchline.schemas.errors import TouchlineError
from touchline.schemas.plain_text import plain_lines
from touchline.services.cli import (
    check_command,
    compare_command,
    demo_command,
    echo_command,
    estimate_command,
    export_command,
    fleet_command,
    goto_command,
    hz_command,
    import_command,
    info_command,
    order_command,
    picture_command,
    plan_command,
    playback_command,
    record_command,
    replay_command,
    run_command,
    salvage_command,
    service_commands,
    simulate_command,
    study_command,
    sweep_command,
    system_commands,
    template_commands,
    vehicle_commands,
)
from touchline.services.cli.groups import in_panel
from touchline.services.cli.options import ExitCode

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
#: The order of the help: what belongs together, and what is done first before what is done with it.
for name, modules in {
    "Jobs": (
        demo_command,
        plan_command,
        run_command,
        simulate_command,
        goto_command,
        fleet_command,
        sweep_command,
        study_command,
    ),
    "Drawings and robots": (template_commands, vehicle_commands),
    "The running system": (system_commands, order_command),
    "Recordings": (
        record_command,
        replay_command,
        playback_command,
        info_command,
        echo_command,
        hz_command,
        export_command,
        salvage_command,
        compare_command,
        check_command,
        import_command,
        estimate_command,
        picture_command,
    ),
    "Processes, each alone": (service_commands,),
}.items():
    for module in modules:
        module.register(app)
        in_panel(app, name)


@app.callback()
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
    try:
        app()
    except TouchlineError as error:
        sys.stderr.write(f"error: {plain_lines(str(error))}\n")
        return ExitCode.UNUSABLE
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else ExitCode.OK
    return ExitCode.OK
