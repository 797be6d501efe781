"""``touchline simulate``: one job in this process, without services, as fast as it goes."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from services.cli.choices import PlanChoice, ScenarioChoice
from services.cli.display import print_figures, progress_bar, stderr
from services.cli.drawing import DrawingChoice
from services.cli.groups import with_groups
from services.cli.options import ExitCode, JsonOption, ReportOption, check_plot
from services.reports import paint_figures
from services.writing import write_json


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("simulate")(with_groups(simulate))


def simulate(
    drawing: DrawingChoice,
    robot: ScenarioChoice,
    planning: PlanChoice,
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
    from services.picture import draw_painted, painted_caption
    from services.robot_sim.warm_up import warm_up
    from services.simulation import Job
    from services.simulation import simulate as paint

    check_plot(plot)
    template = drawing.chosen()
    chosen = robot.chosen().at(template.origin)
    with progress_bar("Touchline") as advance:
        job = Job.prepare(template, planning.options(), advance)
        warm_up(stderr.print, scenario=chosen, loop=not hashed and record is None)
        outcome = paint(job, chosen, hashed=hashed, record=record, with_strokes=plot is not None, progress=advance)
        if plot is not None:
            advance(1.0, "Drawing")
            draw_painted(template, outcome.strokes, plot, painted_caption(paint_figures(outcome.report)))
    figures: dict[str, Any] = {"template": drawing.template, **outcome.figures(job)}
    figures |= {"seed": chosen.seed, "follower": chosen.follower, "noise": chosen.noise}
    if report is not None:
        write_json(figures, report)
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
    else:
        print_figures(f"Simulation of {drawing.template}", figures)
    if not figures["success"]:
        sys.exit(ExitCode.FAILED)
