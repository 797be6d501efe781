"""Two robots on one template, over many seeds: one is paused, or fails and the other one takes over.

    python -m benchmarks shared job=soccer-11 runs=20 seed=1 workers=2

`pan` is 30 m by 20 m and covered by two clay rollers, to `coverage` %; any template of lines, such as `soccer-11`, is
painted by two line markers. In every run with a seed one of both, at a random time, (a) is paused for 30 s, (b) fails,
and 20 s later the other one takes over what it has left. Prints a row for each run and the extremes of all. Ends with
exit code 1 if bodies came nearer than 0.5 m, or one left the field. `reason` says why a job was no success: lines
beside a robot that stands there cannot be painted.
"""

import random
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial
from multiprocessing import get_context
from typing import Any, Final

import shapely

from benchmarks._settings import Small
from benchmarks.random_fields import template_of
from touchline.jobs.shared.shared_areas import share_areas
from touchline.jobs.shared.shared_job import APART_M, SharedJob, share_job
from touchline.jobs.shared.shared_simulation import names_of, simulate_shared
from touchline.jobs.shared.team_order import TeamOrder
from touchline.jobs.shared.team_report import team_figures
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup

ROBOTS: Final = 2
PAUSE_S: Final = 30.0
ORDERED_AFTER_S: Final = 20.0
SMALL: Final = Small(
    {"job": "tennis", "runs": 1, "seed": 2, "workers": 1},
    (
        "tennis, # robots: planned # s, in # s",
        "paused for # s",
        "failed, taken over after # s",
        "seed # at_s # total_s # apart_m # coverage_pct #",
        "apart_m: # to #, median #",
        "total_s: # to #, median #",
    ),
)
Row = dict[str, Any]


def pan_job(coverage_pct: float) -> SharedJob:
    """Job of two clay rollers on a pan, up to a coverage (%); 0: the default."""
    template = template_of("pan", shapely.box(0.0, 0.0, 30.0, 20.0))
    options = PlanOptions(coverage_pct=coverage_pct)
    return share_areas(template, options, load_vehicle("clay-roller"), [None] * ROBOTS)


def lines_job(template: str) -> SharedJob:
    """Two line markers on the lines of a template."""
    return share_job(load_template(template), PlanOptions(), Setup().vehicle, [None] * ROBOTS)


def paused(job: SharedJob, seed: int) -> Row:
    """One run in which one is paused."""
    at_s, robot = _drawn(job, seed)
    return _row(job, seed, [TeamOrder(at_s, robot, "pause"), TeamOrder(at_s + PAUSE_S, robot, "resume")])


def failed(job: SharedJob, seed: int) -> Row:
    """One run in which one fails, and the other one takes over."""
    at_s, robot = _drawn(job, seed)
    return _row(job, seed, [TeamOrder(at_s, robot, "fail"), TeamOrder(at_s + ORDERED_AFTER_S, robot, "take-over")])


def _drawn(job: SharedJob, seed: int) -> tuple[float, int]:
    """Draw the sim time of the event, and the robot."""
    chance = random.Random(seed)
    return chance.uniform(5.0, job.table.end_s), chance.randrange(ROBOTS)


def _row(job: SharedJob, seed: int, orders: Sequence[TeamOrder]) -> Row:
    setup, begun = Setup(vehicle=job.vehicle), time.process_time()
    outcome = simulate_shared(job, [setup.with_seed(seed + number) for number in range(ROBOTS)], orders)
    figures = team_figures(job, outcome, names_of(ROBOTS))
    area, paint, traversal = figures.get("area", {}), figures.get("paint", {}), figures["traversal"]
    return {
        "seed": seed,
        "at_s": orders[0].at_s,
        "total_s": traversal["total_time_s"],
        "apart_m": traversal["closest_bodies_m"],
        "coverage_pct": (area or paint)["coverage_pct"],
        **{name: traversal[name] for name in ("left_out_m", "left_out_m2") if name in traversal},
        **({"outside_m": area["body_outside_m"], "missed_most_m2": _inside_m2(area)} if area else {}),
        **({"twice_m2": paint["double_paint_m2"], "wet": paint["wet_crossings"]} if paint else {}),
        "processor_s": time.process_time() - begun,
        "reason": figures["reason"],
    }


def _inside_m2(area: dict[str, Any]) -> float:
    """The largest missed patch but for the margin along the edges, which is the largest of all."""
    return max((patch["area_m2"] for patch in area["missed"][1:]), default=0.0)


def _text(value: float | int | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _print(title: str, rows: Sequence[Row]) -> None:
    print(f"\n{title}")
    for row in rows:
        print("  ", *(f"{name} {_text(value)}" for name, value in row.items()))
    for name in (name for name, value in rows[0].items() if isinstance(value, float)):
        values = sorted(row[name] for row in rows)
        print(f"   {name}: {values[0]:.4f} to {values[-1]:.4f}, median {values[len(values) // 2]:.4f}")


def main(job: str = "pan", runs: int = 20, seed: int = 1, workers: int = 2, coverage: float = 0.0) -> None:
    """Run all and print the figures."""
    work, seeds = pan_job(coverage) if job == "pan" else lines_job(job), range(seed, seed + runs)
    print(f"{job}, {ROBOTS} robots: planned {work.table.end_s:.0f} s, in {work.planning_time_s:.0f} s")
    disturbances = {f"paused for {PAUSE_S:g} s": paused, f"failed, taken over after {ORDERED_AFTER_S:g} s": failed}
    found = list[Row]()
    with ExitStack() as stack:
        pool = stack.enter_context(ProcessPoolExecutor(workers, get_context("spawn"))) if workers > 1 else None
        for title, run in disturbances.items():
            rows = list((pool.map if pool else map)(partial(run, work), seeds))
            _print(title, rows)
            found += rows
    if any(row["apart_m"] < APART_M or row.get("outside_m", 0.0) > 0.0 for row in found):
        sys.exit(1)
