"""``touchline plan``: a template's trajectory, without any service running."""

import json
import time
from pathlib import Path
from typing import Annotated

import typer

from schemas.errors import SpecError
from schemas.template import parse_template, template_text
from schemas.vehicle import Vehicle
from services.cli.display import print_figures, progress_bar
from services.cli.options import (
    JsonOption,
    KappaOption,
    Method,
    MethodOption,
    PaintSpeedOption,
    ReportOption,
    SigmaOption,
    TemplateArgument,
    TransitSpeedOption,
    plan_options,
    write_json,
)
from services.reports import plan_figures

PLOT_ENDINGS = (".svg", ".png")


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("plan")(plan)


def plan(
    template: TemplateArgument,
    method: MethodOption = Method.G2,
    kappa_max: KappaOption = 0.0,
    sigma_max: SigmaOption = 0.0,
    paint_speed: PaintSpeedOption = 0.0,
    transit_speed: TransitSpeedOption = 0.0,
    out: Annotated[
        Path | None, typer.Option(help="Write the trajectory (JSON, fields as in tt_trajectory_msgs/Trajectory).")
    ] = None,
    report: ReportOption = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the plan to this .svg or .png file.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a template: from what is to be painted to the trajectory that the robot drives."""
    from services.planner.plan import plan as make_plan
    from services.planner.plot import plot_plan

    if plot is not None and plot.suffix not in PLOT_ENDINGS:
        raise SpecError("command line", "--plot", f"ends in {plot.suffix!r}", f"use {' or '.join(PLOT_ENDINGS)}")
    options = plan_options(method, kappa_max, sigma_max, paint_speed, transit_speed)
    begun = time.perf_counter()
    text, source = template_text(template)
    drawing = parse_template(text, source)
    with progress_bar("Planning") as advance:
        planned = make_plan(drawing, Vehicle(), options, lambda stage, fraction: advance(fraction, stage))
    timed = planned.report.model_copy(update={"planning_time_s": time.perf_counter() - begun})
    figures = plan_figures(timed)
    try:
        if out is not None:
            out.write_text(planned.trajectory.model_dump_json(indent=1) + "\n", encoding="utf-8")
        if plot is not None:
            plot_plan(planned, drawing, plot)
    except OSError as error:
        problem = f"cannot be written ({error.strerror})"
        raise SpecError(str(error.filename), "", problem, "give a writable path") from error
    if report is not None:
        write_json(figures, report)
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
    else:
        print_figures(f"Plan of {drawing.title or drawing.name}", figures)
