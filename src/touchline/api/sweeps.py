"""`sweep()`: many simulations, and the `Table` of their figures."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.api.data_frames import Kind, as_frame
from touchline.api.given_arguments import Progress, no_progress, setup_of, template_of, vehicle_of
from touchline.api.planned import Plan
from touchline.jobs.sweep.combinations import SweepCase, cases
from touchline.jobs.sweep.task import SweepRun, lost_run, perform, prepare
from touchline.jobs.task_pool import spread
from touchline.schemas.given_angles import given_angle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

#: Quantile of the normal distribution for 95 %.
Z_95 = 1.959963984540054


@dataclass(frozen=True, repr=False)
class Table:
    """Figures of many runs.

    Attributes:
        rows: (n,) a row for each run: the settings, seed, success, reason, hash of the scenario, and the figures; those
            of a run that failed are NaN.
        settings: Names of the settings that were combined.
    """

    rows: NDArray[np.void]
    settings: tuple[str, ...]

    def frame(self, kind: Kind = "auto") -> Any:
        """`rows` as a DataFrame of pandas or polars, whichever is installed.

        Args:
            kind: "pandas", "polars", "numpy" or "auto".
        """
        return as_frame(self.rows, kind)

    def summary(self) -> NDArray[np.void]:
        """Mean and 95th percentile of each figure, and the share of successes, for each combination of settings.

        Returns:
            (m,) settings, runs, success (share), success_low and success_high (Wilson's interval of 95 %), then
            FIGURE_mean and FIGURE_p95 over the runs that have it.
        """
        figures = [name for name in self.rows.dtype.names or () if self.rows.dtype[name].kind == "f"]
        names = [name for name in figures if name not in self.settings]
        keys = [tuple(row[name] for name in self.settings) for row in self.rows]
        form = [(name, self.rows.dtype[name]) for name in self.settings]
        form += [("runs", np.dtype(np.int64))]
        form += [(name, np.dtype(np.float64)) for name in ("success", "success_low", "success_high")]
        form += [(f"{name}_{part}", np.dtype(np.float64)) for name in names for part in ("mean", "p95")]
        found = np.zeros(len(dict.fromkeys(keys)), form)
        for line, key in zip(found, dict.fromkeys(keys), strict=True):
            mine = self.rows[[each == key for each in keys]]
            for name, value in zip(self.settings, key, strict=True):
                line[name] = value
            line["runs"], line["success"] = len(mine), mine["success"].mean()
            line["success_low"], line["success_high"] = wilson(int(mine["success"].sum()), len(mine))
            for name in names:
                values = mine[name][~np.isnan(mine[name])]
                line[f"{name}_mean"] = values.mean() if len(values) else math.nan
                line[f"{name}_p95"] = np.percentile(values, 95.0) if len(values) else math.nan
        return found

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.rows)

    def __repr__(self) -> str:
        """One line: runs and successes."""
        return f"Table({len(self)} runs, {int(self.rows['success'].sum())} successful)"

    def _repr_html_(self) -> str:
        summary = self.summary()
        names = summary.dtype.names or ()
        head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
        body = "".join(
            f"<tr>{''.join(f'<td>{html.escape(_shown(line[name]))}</td>' for name in names)}</tr>" for line in summary
        )
        table = f'<div style="overflow-x: auto"><table><tr>{head}</tr>{body}</table></div>'
        return f"<p><code>{html.escape(repr(self))}</code></p>{table}"


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Interval of 95 % for a probability.

    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.

    Args:
        successes: Number of successes.
        runs: Number of runs.
    """
    share, wide = successes / runs, Z_95 * Z_95 / runs
    middle = (share + 0.5 * wide) / (1.0 + wide)
    half = math.sqrt(share * (1.0 - share) * wide + 0.25 * wide * wide) / (1.0 + wide)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def sweep(
    work: Template | Plan | str | Path | tuple[float, ...],
    /,
    *,
    seeds: int = 20,
    settings: Mapping[str, Sequence[Any]] | None = None,
    scenario: Scenario | None = None,
    vehicle: Vehicle | str | Path | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """Simulate every combination of settings with many seeds.

    Args:
        work: Template, its name or its file; a plan, whose template, vehicle and options are taken; or a goal: x, y (m)
            and perhaps heading (rad), map frame.
        seeds: Runs of each combination, with consecutive seeds from the scenario's.
        settings: Values to combine, by name: a field of the scenario ("gnss.white_m"), "follower", an option of the
            plan ("plan.paint_speed_mps"), a field of the goal ("goal.method") or of the robot's computer
            ("onboard.gnss.white_m").
        scenario: World of all runs; None: undisturbed.
        vehicle: Robot, its name or its file; None: the plan's, or the line marker.
        workers: Number of processes; None: one per core. Scripts that use several need `if __name__ == "__main__":`.
        progress: Called with the fraction done and the number of finished runs.

    Raises:
        SpecError: A setting or argument cannot be used.
        PlanningError: A template cannot be planned.
    """
    robot = work.vehicle if isinstance(work, Plan) and vehicle is None else vehicle_of(vehicle)
    setup, report = setup_of(robot, scenario, None, None, None), progress or no_progress
    subject, options = _subject(work)
    combined = cases(subject, setup.scenario, options, settings or {}, setup.onboard)
    jobs, tasks = prepare(combined, seeds, robot, report)
    runs: list[SweepRun] = []
    with closing(spread(perform, jobs, tasks, workers, lost_run)) as done:
        for run in done:
            runs.append(run)
            report(len(runs) / len(tasks), f"{len(runs)} of {len(tasks)} runs")
    return _table(sorted(runs, key=lambda run: (run.case, run.seed)), combined, tuple(settings or ()))


def _subject(work: Template | Plan | str | Path | tuple[float, ...]) -> tuple[Template | PoseGoal, PlanOptions]:
    if isinstance(work, Plan):
        return work.template, work.options.message()
    if isinstance(work, tuple):
        heading = given_angle("goal", work[2]) if len(work) > 2 else math.nan
        return PoseGoal(x_m=work[0], y_m=work[1], heading_rad=heading), PlanOptions()
    return template_of(work), PlanOptions()


def _table(runs: Sequence[SweepRun], combined: Sequence[SweepCase], settings: tuple[str, ...]) -> Table:
    figures = list(dict.fromkeys(name for run in runs for name in run.figures))
    columns: dict[str, NDArray[Any]] = {
        name: np.array([combined[run.case].setting[name] for run in runs]) for name in settings
    }
    columns["seed"] = np.array([run.seed for run in runs], np.int64)
    columns["success"] = np.array([run.success for run in runs], np.bool_)
    columns["reason"] = np.array([run.reason for run in runs], np.str_)
    columns["scenario_hash"] = np.array([run.scenario_hash for run in runs], np.str_)
    for name in figures:
        columns[name] = np.array([run.figures.get(name, math.nan) for run in runs])
    form = [(name, column.dtype if column.dtype.itemsize else np.dtype("U1")) for name, column in columns.items()]
    rows = np.zeros(len(runs), form)
    for name, column in columns.items():
        rows[name] = column
    rows.flags.writeable = False
    return Table(rows, settings)


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)
