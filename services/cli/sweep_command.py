"""``touchline sweep``: many simulations at once."""

import json
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from touchline.schemas.catalogue import shipped_templates
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import read_text
from touchline.services.cli.choices import PlanChoice, SetupChoice, VehicleChoice, check_follower
from touchline.services.cli.display import output, print_event, progress_bar, say
from touchline.services.cli.groups import with_groups
from touchline.services.cli.options import ExitCode, JsonOption, ReportOption
from touchline.services.runs.writing import check_writable, write_json

#: Units are in the names of the JSON report; here they are scaled to what people say.
_SHOWN = {
    "coverage_pct": ("coverage of the length, %", 1.0, 2),
    "area_coverage_pct": ("coverage of the area, %", 1.0, 2),
    "within_tolerance_pct": ("within the tolerance, %", 1.0, 2),
    "of_field_pct": ("coverage of the field, %", 1.0, 2),
    "of_reachable_pct": ("coverage of what can be reached, %", 1.0, 2),
    "of_planned_pct": ("coverage of what was planned, %", 1.0, 2),
    "missed_m2": ("missed, m²", 1.0, 2),
    "overlap_m2": ("more than once, m²", 1.0, 1),
    "body_outside_m": ("body outside, cm", 1e2, 1),
    "gap_m": ("gaps, m", 1.0, 3),
    "overspray_m2": ("overspray, m²", 1.0, 3),
    "double_paint_m2": ("double paint, m²", 1.0, 4),
    "lateral_error_mean_m": ("lateral error mean, mm", 1e3, 2),
    "lateral_error_p95_m": ("lateral error p95, mm", 1e3, 2),
    "lateral_error_max_m": ("lateral error max, mm", 1e3, 2),
    "position_rmse_m": ("position RMSE, mm", 1e3, 2),
    "heading_rmse_rad": ("heading RMSE, mrad", 1e3, 2),
    "total_time_s": ("time, s", 1.0, 1),
    "follower_fallbacks": ("follower fallbacks", 1.0, 0),
}


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command("sweep")(with_groups(sweep))


def sweep(
    subject: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO|TEMPLATE",
            help="A scenario file, or what to paint: a shipped template's name or a template file.",
            show_default=False,
        ),
    ],
    body: VehicleChoice,
    seeds: Annotated[
        int,
        typer.Option(metavar="N", help="Runs of each combination, with the scenario's seed and those after it.", min=1),
    ] = 20,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUES",
            help="NAME=VALUE,VALUE…: values to combine, of a scenario's field (gnss.white_m), `template`, `follower`, "
            "a plan's option (plan.paint_speed_mps) or a field of the robot's computer (onboard.gnss.white_m). "
            "Can be given several times.",
            show_default=False,
        ),
    ] = None,
    template: Annotated[
        str, typer.Option(metavar="TEMPLATE", help="What to paint when a scenario is given.")
    ] = "soccer-11",
    workers: Annotated[int, typer.Option(metavar="N", help="Processes; 0: one for each core.", min=0)] = 0,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler, to use its workers instead.", show_default=False
        ),
    ] = None,
    report: ReportOption = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a line per run to this CSV file.", show_default=False)
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate every combination of settings with many seeds; Ctrl-C ends it with what is done so far."""
    from touchline.services.robot_sim.warm_up import warm_up
    from touchline.services.runs.sweep.combinations import cases as all_cases
    from touchline.services.runs.sweep.combinations import parse_settings
    from touchline.services.runs.sweep.places import cores, here, in_processes, on_dask
    from touchline.services.runs.sweep.summary import summarise, write_csv
    from touchline.services.runs.sweep.task import SweepRun, prepare

    check_writable(report, csv)
    painted, scenario = _subject(subject, template)
    vehicle = body.chosen()
    cases = all_cases(painted, scenario, PlanChoice().options(), parse_settings(settings or []))
    for case in cases:
        check_follower(case.config)
    runs: list[SweepRun] = []
    interrupted, broken = False, ""
    with progress_bar("Touchline") as advance:
        jobs, tasks = prepare(cases, seeds, vehicle, advance)
        warm_up(say, Setup(vehicle=vehicle))  # so that not every process compiles
        count = min(workers or cores(), len(tasks))
        if dask is not None:
            place = on_dask(jobs, tasks, dask)
        else:
            place = in_processes(jobs, tasks, count) if count > 1 else here(jobs, tasks)
        begun = time.monotonic()
        advance(0.0, f"0 of {len(tasks)}")
        try:
            with closing(place):
                for run in place:
                    runs.append(run)
                    advance(len(runs) / len(tasks), f"{len(runs)} of {len(tasks)}")
        except KeyboardInterrupt:
            interrupted = True
        except TouchlineError as error:
            if not runs:
                raise
            broken = str(error)  # what is done is worth telling
        wall_s = time.monotonic() - begun
    sim_s = sum(run.figures.get("total_time_s", 0.0) for run in runs)
    figures = summarise(cases, runs) | {
        "complete": len(runs) == len(tasks),
        "wall_time_s": wall_s,
        "real_time_factor": sim_s / wall_s,
    }
    if as_json:
        typer.echo(json.dumps(figures, indent=2))
    else:
        _print(figures, len(tasks))
    if report is not None:
        write_json(figures, report)
    if csv is not None:
        write_csv(figures, csv)
    if broken:
        print_event(2, broken)
    if interrupted:
        sys.exit(ExitCode.INTERRUPTED)
    if broken or not all(run.success for run in runs):
        sys.exit(ExitCode.FAILED)


def _subject(subject: str, template: str) -> tuple[str, Scenario]:
    """(template, scenario) from what the first argument names."""
    if subject in shipped_templates():
        return subject, Scenario()
    path = Path(subject)
    if not path.exists():
        names = ", ".join(shipped_templates())
        raise SpecError(subject, "", "is no scenario file, template file or shipped template", f"use one of: {names}")
    try:
        content = json.loads(read_text(path))
    except ValueError:
        content = None
    if isinstance(content, dict) and "segments" in content:
        return subject, Scenario()
    return template, SetupChoice(scenario=path).chosen().scenario


def _print(figures: dict[str, Any], wanted: int) -> None:
    console = output()
    for combination in figures["combinations"]:
        setting = ", ".join(f"{name}={value}" for name, value in combination["set"].items())
        failed = combination["failed_seeds"]
        title = f"{combination['template']}  {setting}  ({combination['runs']} runs, {len(failed)} failed)"
        table = Table(title=title, title_justify="left", box=None, padding=(0, 2))
        for name in ("", "mean", "p95", "worst", "seed of the worst"):
            table.add_column(name, justify="right" if name else "left")
        for name, values in combination["figures"].items():
            shown, scale, digits = _SHOWN.get(name, (name, 1.0, 4))
            numbers = (f"{scale * values[column]:,.{digits}f}" for column in ("mean", "p95", "worst"))
            table.add_row(shown, *numbers, str(values["worst_seed"]))
        console.print(table)
        if failed:
            console.print(f"  failed with seeds {', '.join(map(str, failed[:20]))}{' …' if len(failed) > 20 else ''}")
    done = len(figures["runs"])
    wall_s, factor = figures["wall_time_s"], figures["real_time_factor"]
    console.print(f"{done} of {wanted} runs in {wall_s:.1f} s, {factor:,.0f}× real time in all")
