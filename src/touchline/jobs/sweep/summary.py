"""Summary of a sweep: mean, 95th percentile, worst value and its seed for each combination and figure."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from touchline.jobs.goal.arrival import NEAR_M, NEAR_RAD, goal_figures
from touchline.jobs.sweep.combinations import SweepCase
from touchline.jobs.sweep.task import SweepRun
from touchline.recordings.writing import replacing
from touchline.schemas.messages import PoseGoal
from touchline.schemas.team import TeamScenario

#: Figures of which more is better; of all others less is.
MORE_IS_BETTER: Final = (
    "coverage_pct",
    "area_coverage_pct",
    "within_tolerance_pct",
    "of_field_pct",
    "of_reachable_pct",
    "of_planned_pct",
    "closest_m",
)


def summarise(cases: Sequence[SweepCase], runs: Sequence[SweepRun]) -> dict[str, Any]:
    """Return the sweep's report as a JSON object: a summary per combination, then every run.

    It does not depend on the order in which runs finished.
    """
    ordered = sorted(runs, key=lambda run: (run.case, run.seed))
    return {
        "combinations": [
            _combination(case, [run for run in ordered if run.case == index]) for index, case in enumerate(cases)
        ],
        "runs": [
            {
                "set": cases[run.case].setting,
                "seed": run.seed,
                "success": run.success,
                "reason": run.reason,
                "scenario_hash": run.scenario_hash,
                **run.figures,
            }
            for run in ordered
        ],
    }


def _combination(case: SweepCase, runs: list[SweepRun]) -> dict[str, Any]:
    finished = [run for run in runs if run.figures]
    names = dict.fromkeys(
        name for run in finished for name in run.figures
    )  # the time of arrival exists only for runs that arrived
    work: dict[str, Any] = {"template": getattr(case.work, "name", case.work)}
    if isinstance(case.work, TeamScenario):
        work = {"team": case.work.name, "task": case.work.task.kind}
    elif isinstance(case.work, PoseGoal):
        work = {"goal": goal_figures(case.work), "within_2cm_2deg_pct": _within_pct(runs)}
    return {
        "set": case.setting,
        **work,
        "runs": len(runs),
        "failed_seeds": [run.seed for run in runs if not run.success],
        "figures": {name: statistics(name, [run for run in finished if name in run.figures]) for name in names},
    }


def _within_pct(runs: Sequence[SweepRun]) -> float:
    """Return the share of runs that arrived, and in truth within 2 cm and 2°, percent."""
    near = [
        run
        for run in runs
        if run.success and run.figures["off_m"] <= NEAR_M and run.figures.get("turned_rad", 0.0) <= NEAR_RAD
    ]
    return 100.0 * len(near) / len(runs) if runs else 0.0


def statistics(name: str, runs: Sequence[SweepRun]) -> dict[str, float | int]:
    """Return mean, p95 and worst of one figure over runs; the percentile counts from the good side."""
    values = np.array([run.figures[name] for run in runs])
    badness = -values if name in MORE_IS_BETTER else values
    worst = int(np.argmax(badness))
    return {
        "mean": float(np.mean(values)),
        "p95": float(abs(np.quantile(badness, 0.95))),
        "worst": float(values[worst]),
        "worst_seed": runs[worst].seed,
    }


def write_csv(report: dict[str, Any], path: Path) -> None:
    """Write a line per run: settings, seed, figures.

    Raises:
        SpecError: The file cannot be written.
    """
    rows = [{**run["set"], **{name: value for name, value in run.items() if name != "set"}} for run in report["runs"]]
    names = list(dict.fromkeys(name for row in rows for name in row))
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)
