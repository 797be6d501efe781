"""``touchline run``: one job from template to report, with real service processes."""

import time
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer

from touchline.schemas import topics
from touchline.schemas.digest import scenario_hash
from touchline.schemas.messages import GetPaintRequest, PlanOptions, Smear
from touchline.schemas.plugins import EXTERNAL
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.bus import BusConfig
from touchline.services.cli.choices import PlanChoice, SetupChoice
from touchline.services.cli.display import Advance, print_event, progress_bar, say
from touchline.services.cli.drawing import DrawingChoice
from touchline.services.cli.groups import with_groups
from touchline.services.cli.options import SpeedOption, speed_factor
from touchline.services.cli.output_choice import OutputChoice
from touchline.services.runs.bus_run import BusRun, JobFailed, JobOptions
from touchline.services.system.running_system import only_one
from touchline.services.system.temporary_system import LocalSystem, local_system, severity_of


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("run")(with_groups(run))


@dataclass
class Terminal:
    """Shows a job on standard error, and ends it when the robot's process dies."""

    system: LocalSystem
    advance: Advance
    _stage: str = field(default="", init=False)

    def stage(self, text: str) -> None:
        """Name the stage."""
        self._stage = text
        self.advance(0.0, text)

    def progress(self, fraction: float, text: str) -> None:
        """Move the bar."""
        self.advance(fraction, f"{self._stage}: {text}")

    def event(self, severity: int, text: str) -> None:
        """Print an event."""
        print_event(severity, text)

    def check(self) -> None:
        """Tell what happened to the services."""
        for notice in self.system.poll():
            print_event(severity_of(notice), f"supervisor: {notice.text}")
            if notice.node == topics.ROBOT_SIM and notice.kind in ("died", "hung"):
                raise JobFailed(f"{notice.text}; its traversal is lost, what was recorded until then is kept")


def run(
    drawing: DrawingChoice,
    robot: SetupChoice,
    planning: PlanChoice,
    speed: SpeedOption = "max",
    *,
    output: OutputChoice,
) -> None:
    """Paint a template once: start planner, robot and bridge, do the job over Zenoh, stop them, report."""
    template, setup = drawing.chosen(), robot.chosen()
    figures = run_job(
        template,
        speed=speed_factor(speed),
        setup=setup,
        options=planning.options(),
        record=output.record,
        plot=output.plot,
    )
    output.conclude("Run", drawing.template, setup, figures)


def run_job(
    template: Template,
    *,
    speed: float,
    setup: Setup,
    options: PlanOptions,
    record: Path | None,
    plot: Path | None = None,
) -> dict[str, Any]:
    """Start a system of its own, do one job, stop it.

    The robot's map frame is the template's: its origin on the earth, if it has one, becomes the scenario's.

    Returns:
        The run report; when the job ended early, ``success`` false and the reason.
    """
    begun = time.monotonic()
    setup = setup.at(template.origin)
    cause = scenario_hash(setup, template, options)
    job_options = JobOptions(template.to_json(), options, speed, record, cause, setup.vehicle)
    # A private bus, so that any number can run at once; but an external follower could not find that.
    config = BusConfig.from_environment() if setup.onboard.follower == EXTERNAL else None
    with (
        only_one(config) if config else nullcontext(),
        local_system(
            setup,
            config,
            join_as=topics.OPERATOR,
            recordings=record.parent if record else None,
        ) as system,
        progress_bar("Touchline") as advance,
    ):
        advance(0.0, "Starting the services")
        system.wait_until_ready(say)
        job = BusRun(system.bus, job_options, Terminal(system, advance))
        try:
            figures = job.run()
        except JobFailed as error:
            print_event(2, str(error))
            return {"success": False, "reason": str(error)}
        first_motion_s = job.started_at - begun
        if plot is not None:
            advance(1.0, "Drawing")
            _draw(system, template, plot, figures, job.smears)
    return {**figures, "first_motion_s": first_motion_s}


def _draw(
    system: LocalSystem, template: Template, path: Path, figures: dict[str, Any], smears: tuple[Smear, ...]
) -> None:
    from touchline.services.runs.painted_picture import draw_painted, painted_caption

    strokes = system.bus.call(topics.GET_PAINT, GetPaintRequest(), timeout_s=30.0).strokes
    draw_painted(template, strokes, path, painted_caption(figures["paint"]), smears)
