"""``touchline sweep``: many simulations at once."""

import time
from collections.abc import Generator
from contextlib import closing
from typing import TYPE_CHECKING, Annotated

import typer

from touchline.cli.choices import VehicleChoice, check_follower
from touchline.cli.display import Advance, progress_bar
from touchline.cli.groups import with_groups
from touchline.cli.sweep_output import SweepOutput, Swept
from touchline.cli.sweep_subject import SubjectChoice
from touchline.cli.workers_choice import WorkersChoice
from touchline.schemas.errors import TouchlineError
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles.shipped import on_its_ground, with_its_own

if TYPE_CHECKING:
    from touchline.jobs.sweep.task import SweepRun


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("sweep")(with_groups(sweep))


def sweep(
    subject: SubjectChoice,
    body: VehicleChoice,
    seeds: Annotated[
        int,
        typer.Option(metavar="N", help="Runs of each combination, with consecutive seeds from the scenario's.", min=1),
    ] = 20,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUES",
            help="Values to combine: NAME=VALUE,VALUE… with a field of the scenario (gnss.white_m), `template`, "
            "`follower`, a planning option (plan.paint_speed_mps), a field of the goal (goal.method) "
            "or of the onboard computer (onboard.gnss.white_m); may be repeated.",
        ),
    ] = None,
    *,
    processes: WorkersChoice,
    results: SweepOutput,
) -> None:
    """Simulate every combination of settings with many seeds; Ctrl-C ends it and reports the finished runs."""
    from touchline.jobs.sweep.combinations import cases as all_cases
    from touchline.jobs.sweep.combinations import parse_settings
    from touchline.jobs.sweep.task import lost_run, perform, prepare

    work, options, scenario = subject.chosen()
    vehicle = body.chosen()
    world, computer = on_its_ground(body.name, scenario), with_its_own(body.name, OnboardConfig())
    cases = all_cases(work, world, options, parse_settings(settings or []), computer)
    for case in cases:
        check_follower(case.config)
    with progress_bar("Touchline") as advance:
        jobs, tasks = prepare(cases, seeds, vehicle, advance)
        swept = collect(processes.done(perform, jobs, tasks, lost_run), len(tasks), advance)
    results.conclude(swept, cases)


def collect(runs: Generator["SweepRun", None, None], wanted: int, advance: Advance) -> Swept:
    """Collect runs until the last one, Ctrl-C or a problem; the finished ones are returned.

    Raises:
        TouchlineError: Not even one could be done.
    """
    swept = Swept(wanted)
    begun = time.monotonic()
    advance(0.0, f"0 of {wanted}")
    try:
        with closing(runs):
            for run in runs:
                swept.runs.append(run)
                advance(len(swept.runs) / wanted, f"{len(swept.runs)} of {wanted}")
    except KeyboardInterrupt:
        swept.interrupted = True
    except TouchlineError as error:
        if not swept.runs:
            raise
        swept.problem = str(error)
    swept.wall_s = time.monotonic() - begun
    return swept
