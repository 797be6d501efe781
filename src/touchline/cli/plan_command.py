"""``touchline plan``: plans a template's trajectory without any service."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from touchline.cli.choices import PlanChoice, VehicleChoice
from touchline.cli.display import progress_bar, say, warn_of_left_out, warn_of_shortages
from touchline.cli.garbage import without_collecting
from touchline.cli.groups import with_groups
from touchline.cli.options import JsonOption, ReportOption, check_plot
from touchline.cli.output_choice import deliver
from touchline.cli.template_choice import TemplateChoice
from touchline.jobs.single.reports import plan_figures
from touchline.recordings.writing import check_writable, write_text, writing
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

if TYPE_CHECKING:
    from touchline.services.planner.plan import Plan


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("plan")(with_groups(plan))


@contextmanager
def first_interrupt() -> Iterator[list[int]]:
    """Yield a list that the first Ctrl-C makes non-empty, to take the best order so far; the second one interrupts."""
    interrupts: list[int] = []
    usual = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)
        signal.signal(signal.SIGINT, usual)
        say("taking the best order so far; Ctrl-C again stops")

    signal.signal(signal.SIGINT, note)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, usual)


@dataclass(frozen=True)
class PlanOutput:
    """Destinations of a plan.

    Raises:
        SpecError: A picture's format is not supported, or a file could not be written.
    """

    out: Annotated[
        Path | None,
        typer.Option(help="Write the trajectory to this JSON file (fields as in tt_trajectory_msgs/Trajectory)."),
    ] = None
    report: ReportOption = None
    plot: Annotated[Path | None, typer.Option(help="Draw the plan to this .svg or .png file.")] = None
    colour: Annotated[
        Literal["plain", "speed", "curvature"],
        typer.Option(help="Colours of the plot: by kind of line, speed, or curvature."),
    ] = "plain"
    plot_wheels: Annotated[
        Path | None,
        typer.Option(help="Draw each actuator over time (wheels, or drum and steering) to this .svg or .png file."),
    ] = None
    as_json: JsonOption = False

    def __post_init__(self) -> None:
        check_plot(self.plot)
        check_plot(self.plot_wheels, "--plot-wheels")
        check_writable(self.out, self.report, self.plot, self.plot_wheels)

    def deliver(self, planned: "Plan", template: Template, vehicle: Vehicle) -> None:
        """Write trajectory, pictures and figures."""
        if self.out is not None:
            write_text(planned.trajectory.model_dump_json(indent=1) + "\n", self.out)
        if self.plot is not None:
            from touchline.services.planner.plots.plan_picture import plot_plan

            with writing(self.plot):
                plot_plan(planned, template, self.plot, self.colour, vehicle)
        if self.plot_wheels is not None:
            from touchline.services.planner.plots.actuator_picture import plot_actuators

            with writing(self.plot_wheels):
                plot_actuators(planned, template, vehicle, self.plot_wheels)
        title = f"Plan of {template.title or template.name}"
        deliver(title, plan_figures(planned.report), self.report, self.as_json)


def plan(drawing: TemplateChoice, planning: PlanChoice, body: VehicleChoice, output: PlanOutput) -> None:
    """Plan a template: from the lines to mark, or the area to cover, to the trajectory that the robot drives."""
    with without_collecting():
        from touchline.core.stopwatch import Stopwatch
        from touchline.services.planner.plan import plan as make_plan

    options = planning.options()
    watch = Stopwatch()
    template, vehicle = drawing.chosen(), body.chosen()
    with progress_bar("Planning") as advance, first_interrupt() as interrupted, without_collecting():
        planned = make_plan(
            template, vehicle, options, lambda stage, fraction: advance(fraction, stage), lambda: bool(interrupted)
        )
    timed = planned.report.model_copy(update={"planning_time_s": watch.elapsed_s})
    warn_of_shortages(timed, vehicle)
    warn_of_left_out(timed.left_out)
    output.deliver(replace(planned, report=timed), template, vehicle)
