"""``touchline estimate``: the estimator alone, on the sensors of a session."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from touchline.checking.estimating.reference_frame import FrameFit
from touchline.cli.display import print_event, print_figures, print_json, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.options import ExitCode, JsonOption, RecordedRobotOption, RecordingArgument, check_plot
from touchline.schemas.messages import Event


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("estimate")(with_groups(estimate))


@dataclass(frozen=True)
class EstimateChoice:
    """Robot, reference and picture of an estimate."""

    robot: RecordedRobotOption = None
    onboard: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Onboard JSON file whose values replace those of the session."),
    ] = None
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw track, innovations and NIS to this .svg or .png file.")
    ] = None
    align: Annotated[
        FrameFit,
        typer.Option(help="Alignment of the reference's frame: none, by an offset, or by offset and rotation."),
    ] = FrameFit.NONE


def estimate(file: RecordingArgument, *, choice: EstimateChoice, as_json: JsonOption = False) -> None:
    """Run the present estimator on a session's sensors; exit code 1 if the log violates its assumptions.

    Reports fixes accepted and rejected, NIS against its expectation, jumps, the error against the truth or a reference
    track, the distance from a smoothed track, and whether fixes that are withheld for 10, 30 and 60 s lie within 3 σ;
    for a stationary receiver also the scatter and drift of its fixes.
    """
    from touchline.checking.estimating.estimate_picture import draw_estimate
    from touchline.checking.estimating.estimator_inputs import EstimatorInputs
    from touchline.checking.estimating.log_figures import estimate_log, with_onboard
    from touchline.recordings.writing import check_writable

    check_plot(choice.plot)
    check_writable(choice.plot)
    with progress_bar("Estimate") as advance:
        inputs = EstimatorInputs(file, choice.robot)
        setup = inputs.setup if choice.onboard is None else with_onboard(inputs.setup, choice.onboard)
        run, figures = estimate_log(inputs, setup, choice.align, lambda done: advance(done, ""))
    if choice.plot is not None:
        draw_estimate(run, choice.align, choice.plot)
    if as_json:
        print_json({**figures, "told": run.remarks})
    else:
        against = figures.pop("verdict")
        print_figures(f"Estimator on {file}", {name: value for name, value in figures.items() if value is not None})
        figures["verdict"] = against
    for line in run.remarks:
        print_event(Event.WARN, line)
    for line in figures["verdict"]:
        print_event(Event.WARN, line)
    if figures["verdict"]:
        sys.exit(ExitCode.FAILED)
