"""``touchline demo``: a whole job, shown in the console if there is a terminal."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.choices import PlanChoice, SetupChoice, VehicleChoice
from touchline.cli.display import print_figures, say
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption
from touchline.cli.output_choice import deliver
from touchline.cli.run_command import run_job
from touchline.cli.template_choice import TemplateArgument
from touchline.jobs.recording.recording_end import end_recording, lacking
from touchline.jobs.single.reports import estimator_figures, paint_figures
from touchline.recordings.writing import check_recordable
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import RecordRequest
from touchline.schemas.setup import Setup
from touchline.schemas.topics import DEFAULT_NAMESPACE
from touchline.supervision.priority import switch_threads_soon
from touchline.supervision.temporary_system import local_system, watched

_CONSOLE_SPEED = 20.0
_RECORDING = Path("session.mcap")


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("demo")(with_groups(demo))


def demo(
    body: VehicleChoice,
    template: TemplateArgument = "soccer-11",
    headless: Annotated[bool, typer.Option("--headless", help="Do not open the console, even on a terminal.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Paint a whole pitch, soccer-11 or another: in the console at 20× on a terminal, else as fast as possible."""
    setup = SetupChoice(vehicle=body.vehicle).chosen()
    check_recordable(_RECORDING)
    if sys.stdin.isatty() and sys.stdout.isatty() and not (headless or as_json):
        _in_console(setup, template)
        return
    field, options = load_template(template), PlanChoice().options()
    figures = run_job(field, speed=-1.0, setup=setup, options=options, record=_RECORDING)
    deliver(f"{field.title}, painted", figures, None, as_json)
    if not figures["success"]:
        sys.exit(ExitCode.FAILED)


def _in_console(setup: Setup, template: str) -> None:
    from touchline.tui.console import run_console

    with local_system({DEFAULT_NAMESPACE: setup}, join_as=topics.SUPERVISOR) as system:  # the console attends to it
        say("Starting the services")
        system.wait_until_ready(say)
        system.bus.call(topics.RECORD, RecordRequest(request_id="demo", path=str(_RECORDING.absolute())))
        switch_threads_soon()
        with watched(system):
            report = run_console(system.bus.config, template=template, auto_start=True, speed=_CONSOLE_SPEED)
            stopped = end_recording(system.bus, say)
    if report is not None:
        figures = {"success": report.success, "paint": paint_figures(report), "estimator": estimator_figures(report)}
        print_figures("Painted", figures)
    if stopped is not None and stopped.path:
        print_figures(f"Recording {_RECORDING}", {"messages": stopped.messages, "lost": stopped.lost})
    if problem := lacking(stopped, _RECORDING):
        say(f"the recording is not complete: {problem}")
        sys.exit(ExitCode.FAILED)
