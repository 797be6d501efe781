"""``touchline plan``: a template's trajectory, without any service running."""

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from schemas.errors import SpecError
from schemas.vehicle import Vehicle
from services.cli.display import print_figures, progress_bar
from services.cli.drawing import OriginOption, PlaceOption, SetOption, chosen_template
from services.cli.options import (
    Colour,
    DryingTimeOption,
    ForwardOnlyOption,
    HardDryingOption,
    JsonOption,
    KappaOption,
    Method,
    MethodOption,
    Order,
    OrderOption,
    PaintSpeedOption,
    ReportOption,
    ReturnOption,
    SigmaOption,
    TemplateArgument,
    TransitSpeedOption,
    check_plot,
    plan_options,
    write_json,
)
from services.reports import plan_figures


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("plan")(plan)


@contextmanager
def first_interrupt() -> Iterator[list[int]]:
    """A list that the first Ctrl-C makes non-empty: the best order so far is taken. The second one interrupts."""
    told: list[int] = []
    usual = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        told.append(number)
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, note)
    try:
        yield told
    finally:
        signal.signal(signal.SIGINT, usual)


def plan(
    template: TemplateArgument,
    settings: SetOption = None,
    place: PlaceOption = None,
    origin: OriginOption = None,
    order: OrderOption = Order.OPTIMISED,
    method: MethodOption = Method.G2,
    kappa_max: KappaOption = 0.0,
    sigma_max: SigmaOption = 0.0,
    paint_speed: PaintSpeedOption = 0.0,
    transit_speed: TransitSpeedOption = 0.0,
    forward_only: ForwardOnlyOption = False,
    drying_time: DryingTimeOption = 0.0,
    hard_drying: HardDryingOption = False,
    return_to_start: ReturnOption = False,
    out: Annotated[
        Path | None, typer.Option(help="Write the trajectory (JSON, fields as in tt_trajectory_msgs/Trajectory).")
    ] = None,
    report: ReportOption = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the plan to this .svg or .png file.")] = None,
    colour: Annotated[
        Colour, typer.Option(help="What colours the plot: kind of line, speed, or curvature.")
    ] = Colour.PLAIN,
    plot_wheels: Annotated[
        Path | None,
        typer.Option("--plot-wheels", help="Draw wheel speed and acceleration over time to this .svg or .png file."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a template: from what is to be painted to the trajectory that the robot drives."""
    from services.planner.plan import plan as make_plan
    from services.planner.plot import plot_plan
    from services.planner.plot_wheels import plot_wheels as draw_wheels

    check_plot(plot)
    check_plot(plot_wheels, "--plot-wheels")
    options = plan_options(
        method,
        kappa_max=kappa_max,
        sigma_max=sigma_max,
        paint_speed=paint_speed,
        transit_speed=transit_speed,
        order=order,
        forward_only=forward_only,
        drying_time=drying_time,
        hard_drying=hard_drying,
        return_to_start=return_to_start,
    )
    begun = time.perf_counter()
    drawing = chosen_template(template, settings, place, origin)
    vehicle = Vehicle()
    with progress_bar("Planning") as advance, first_interrupt() as interrupted:
        planned = make_plan(
            drawing, vehicle, options, lambda stage, fraction: advance(fraction, stage), lambda: bool(interrupted)
        )
    timed = planned.report.model_copy(update={"planning_time_s": time.perf_counter() - begun})
    figures = plan_figures(timed)
    try:
        if out is not None:
            out.write_text(planned.trajectory.model_dump_json(indent=1) + "\n", encoding="utf-8")
        if plot is not None:
            plot_plan(planned, drawing, plot, colour.value, vehicle)
        if plot_wheels is not None:
            draw_wheels(planned, drawing, vehicle, plot_wheels)
    except OSError as error:
        problem = f"cannot be written ({error.strerror})"
        raise SpecError(str(error.filename), "", problem, "give a writable path") from error
    if report is not None:
        write_json(figures, report)
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
    else:
        print_figures(f"Plan of {drawing.title or drawing.name}", figures)
