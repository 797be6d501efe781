"""Results of a sweep: a table or JSON of every combination's figures, a report, and a line per run."""

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from touchline.cli.display import print_event, print_json, print_line, print_table
from touchline.cli.options import ExitCode, JsonOption, ReportOption
from touchline.recordings.writing import check_writable, write_json
from touchline.schemas.messages import Event

if TYPE_CHECKING:
    from touchline.jobs.sweep.combinations import SweepCase
    from touchline.jobs.sweep.task import SweepRun

#: Columns of the table; the JSON report has SI units, here they are scaled.
_SHOWN = {
    "coverage_pct": ("coverage of the length, %", 1.0, 2),
    "area_coverage_pct": ("coverage of the area, %", 1.0, 2),
    "within_tolerance_pct": ("within the tolerance, %", 1.0, 2),
    "of_field_pct": ("coverage of the field, %", 1.0, 2),
    "of_reachable_pct": ("coverage of the reachable area, %", 1.0, 2),
    "of_planned_pct": ("coverage of the planned area, %", 1.0, 2),
    "missed_m2": ("missed, m²", 1.0, 2),
    "overlap_m2": ("more than once, m²", 1.0, 1),
    "body_outside_m": ("body outside, cm", 1e2, 1),
    "gap_m": ("gaps, m", 1.0, 3),
    "overspray_m2": ("overspray, m²", 1.0, 3),
    "double_paint_m2": ("double paint, m²", 1.0, 4),
    "lateral_error_mean_m": ("lateral error mean, mm", 1e3, 2),
    "lateral_error_p95_m": ("lateral error p95, mm", 1e3, 2),
    "lateral_error_max_m": ("lateral error max, mm", 1e3, 2),
    "contacts": ("contacts", 1.0, 1),
    "contacts_of_obedient": ("contacts of healthy robots", 1.0, 1),
    "closest_m": ("closest centres, m", 1.0, 4),
    "driven_mean_m": ("distance per robot, m", 1.0, 2),
    "beyond_walls_robot_s": ("beyond walls, robot-seconds", 1.0, 2),
    "cost_of_points": ("H, relative to Lloyd's points", 1.0, 4),
    "cost_of_squares": ("H, relative to squares", 1.0, 4),
    "spread_s": ("H within 5 % of its end after, s", 1.0, 1),
    "arrived_s": ("all arrived after, s", 1.0, 1),
    "off_m": ("position error at the goal, mm", 1e3, 2),
    "turned_rad": ("heading error at the goal, °", math.degrees(1.0), 2),
    "planned_time_s": ("planned time, s", 1.0, 1),
    "position_rmse_m": ("position RMSE, mm", 1e3, 2),
    "heading_rmse_rad": ("heading RMSE, mrad", 1e3, 2),
    "total_time_s": ("time, s", 1.0, 1),
    "follower_fallbacks": ("follower fallbacks", 1.0, 0),
}


@dataclass
class Swept:
    """Finished runs of a sweep.

    Attributes:
        runs: The runs.
        wanted: Number of runs asked for.
        wall_s: Wall-clock time they took.
        interrupted: Whether Ctrl-C ended the sweep early.
        problem: Another reason for an early end, or empty.
    """

    wanted: int
    runs: "list[SweepRun]" = field(default_factory=list)
    wall_s: float = 0.0
    interrupted: bool = False
    problem: str = ""

    def figures(self, cases: "list[SweepCase]") -> dict[str, Any]:
        """Return the sweep's report."""
        from touchline.jobs.sweep.summary import summarise

        sim_s = sum(run.figures.get("total_time_s", 0.0) for run in self.runs)
        return summarise(cases, self.runs) | {
            "complete": len(self.runs) == self.wanted,
            "wall_time_s": self.wall_s,
            "real_time_factor": sim_s / self.wall_s,
        }


@dataclass(frozen=True)
class SweepOutput:
    """Destinations of a sweep's results.

    Raises:
        SpecError: A file could not be written.
    """

    report: ReportOption = None
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a line per run to this CSV file.")] = None
    as_json: JsonOption = False

    def __post_init__(self) -> None:
        check_writable(self.report, self.csv)

    def conclude(self, swept: Swept, cases: "list[SweepCase]") -> None:
        """Print and write the figures; the exit code shows whether all runs succeeded."""
        from touchline.jobs.sweep.summary import write_csv

        figures = swept.figures(cases)
        if self.as_json:
            print_json(figures)
        else:
            _print(figures, swept.wanted)
        if self.report is not None:
            write_json(figures, self.report)
        if self.csv is not None:
            write_csv(figures, self.csv)
        if swept.problem:
            print_event(Event.ERROR, swept.problem)
        if swept.interrupted:
            sys.exit(ExitCode.INTERRUPTED)
        if swept.problem or not all(run.success for run in swept.runs):
            sys.exit(ExitCode.FAILED)


def _print(figures: dict[str, Any], wanted: int) -> None:
    for combination in figures["combinations"]:
        setting = ", ".join(f"{name}={value}" for name, value in combination["set"].items())
        failed = combination["failed_seeds"]
        title = f"{_work(combination)}  {setting}  ({combination['runs']} runs, {len(failed)} failed)"
        table = Table(title=title, title_justify="left", box=None, padding=(0, 2))
        for name in ("", "mean", "p95", "worst", "seed of the worst"):
            table.add_column(name, justify="right" if name else "left")
        for name, values in combination["figures"].items():
            shown, scale, digits = _SHOWN.get(name, (name, 1.0, 4))
            numbers = (f"{scale * values[column]:,.{digits}f}" for column in ("mean", "p95", "worst"))
            table.add_row(shown, *numbers, str(values["worst_seed"]))
        print_table(table)
        if "within_2cm_2deg_pct" in combination:
            print_line(f"  within 2 cm and 2° of the goal: {combination['within_2cm_2deg_pct']:.1f} % of the runs")
        if failed:
            print_line(f"  failed with seeds {', '.join(map(str, failed[:20]))}{' …' if len(failed) > 20 else ''}")
    done = len(figures["runs"])
    wall_s, factor = figures["wall_time_s"], figures["real_time_factor"]
    print_line(f"{done} of {wanted} runs in {wall_s:.1f} s, {factor:,.0f}× real time in all")


def _work(combination: dict[str, Any]) -> str:
    """Return a description of what its runs did."""
    if "team" in combination:
        return f"{combination['team']}: {combination['task']}"
    if "template" in combination:
        return str(combination["template"])
    return "goal " + ", ".join(f"{number:g}" for number in combination["goal"].values() if number is not None)
