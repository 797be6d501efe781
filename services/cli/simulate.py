"""``touchline simulate``: one job in this process, without services, as fast as it goes."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from schemas.template import load_template
from services.cli.display import print_figures, progress_bar, stderr
from services.cli.options import (
    ExitCode,
    FollowerOption,
    JsonOption,
    Method,
    MethodOption,
    NoiseOption,
    Order,
    OrderOption,
    ReportOption,
    ScenarioOption,
    SeedOption,
    TemplateArgument,
    check_plot,
    chosen_scenario,
    plan_options,
    write_json,
)
from services.reports import paint_figures


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("simulate")(simulate)


def simulate(
    template: TemplateArgument,
    scenario: ScenarioOption = None,
    seed: SeedOption = None,
    follower: FollowerOption = None,
    noise: NoiseOption = None,
    order: OrderOption = Order.OPTIMISED,
    method: MethodOption = Method.G2,
    hashed: Annotated[bool, typer.Option("--hash", help="Work out the session hash; takes a little longer.")] = False,
    record: Annotated[
        Path | None, typer.Option(help="Record the session to this MCAP file.", show_default=False)
    ] = None,
    report: ReportOption = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw what was painted to this .svg or .png file.", show_default=False)
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Paint a template once in this process, without Zenoh: the figures of `run`, many times faster."""
    from services.picture import draw_or_refuse, painted_caption
    from services.robot_sim.warm_up import warm_up
    from services.simulation import Job
    from services.simulation import simulate as paint

    check_plot(plot)
    chosen = chosen_scenario(scenario, seed, follower, noise)
    drawing = load_template(template)
    with progress_bar("Touchline") as advance:
        job = Job.prepare(drawing, plan_options(method, order=order), advance)
        warm_up(stderr.print, scenario=chosen, loop=not hashed and record is None)
        outcome = paint(job, chosen, hashed=hashed, record=record, with_strokes=plot is not None, progress=advance)
        if plot is not None:
            advance(1.0, "Drawing")
            draw_or_refuse(drawing, outcome.strokes, plot, painted_caption(paint_figures(outcome.report)))
    figures: dict[str, Any] = {"template": template, **outcome.figures(job)}
    figures |= {"seed": chosen.seed, "follower": chosen.follower, "noise": chosen.noise}
    if report is not None:
        write_json(figures, report)
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
    else:
        print_figures(f"Simulation of {template}", figures)
    if not figures["success"]:
        sys.exit(ExitCode.FAILED)
