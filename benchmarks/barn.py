"""Drives through the worlds of BARN by a robot that knows nothing of them but what its lidar sees.

`python -m benchmarks barn data=FOLDER worlds=50 runs=1`; the folder has `barn-50.csv`, with the cylinders (world, x_m,
y_m), and `barn-50-paths.csv`, with the reference lengths (world, reference_path_m). The whole drive counts,
with the seconds in which the robot aligns before it moves, and those from 1 m before the goal to rest; score: 0 after a
contact or 100 s, else reference time at 2 m/s over the time, at least twice that.
"""

import csv
import math
from collections import defaultdict
from pathlib import Path

import numpy as np

from benchmarks._settings import NotHereError, Small
from touchline.jobs.goal.goal_simulation import GoalDrive, drive_to_goal
from touchline.jobs.single.simulation import Products
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup

VEHICLE = "examples/vehicles/jackal-lidar.json"
START, GOAL = {"x_m": -2.25, "y_m": 3.0, "heading_rad": math.pi / 2.0}, (-2.25, 13.0)
RADIUS_M, NEAR_M, LONGEST_S, FASTEST_MPS = 0.075, 1.0, 100.0, 2.0
SMALL = Small(
    {"worlds": 1},
    ("world #: reached, # contacts, # s, score #", "success # %, contacts #, score #", "time of successes # s"),
)


def main(data: str = "", worlds: int = 50, runs: int = 1) -> None:
    """Drive through the first worlds, and print a line for each run and the means."""
    if not data:
        raise NotHereError("the worlds are not shipped: give data=FOLDER")
    cylinders = defaultdict(list)
    for row in _rows(data, "barn-50.csv"):
        cylinders[int(row["world"])].append((float(row["x_m"]), float(row["y_m"])))
    paths = _rows(data, "barn-50-paths.csv")
    best_s = {int(row["world"]): float(row["reference_path_m"]) / FASTEST_MPS for row in paths}
    results = []
    for world in sorted(cylinders)[:worlds]:
        for run in range(runs):
            done = _drive(cylinders[world], 1 + world + 1000 * run)
            contacts = 0 if done.contacts is None else done.contacts.while_moving
            took_s = done.taken_s
            reached = done.true.off_m(done.goal) <= NEAR_M and took_s <= LONGEST_S
            score = best_s[world] / max(took_s, 2.0 * best_s[world]) if reached and not contacts else 0.0
            results.append((reached and not contacts, contacts, score, took_s))
            ended = "reached" if reached else "not reached"
            print(f"world {world}: {ended}, {contacts} contacts, {took_s:.1f} s, score {score:.3f}", flush=True)
    table = np.array(results, dtype=float)
    print(
        f"success {100.0 * table[:, 0].mean():.1f} %, contacts {table[:, 1].sum():.0f}, score {table[:, 2].mean():.3f}"
    )
    print(f"time of successes {table[table[:, 0] > 0.0, 3].mean():.1f} s")


def _drive(cylinders: list[tuple[float, float]], seed: int) -> GoalDrive:
    posts = [{"kind": "post", "x_m": x, "y_m": y, "radius_m": RADIUS_M, "height_m": 1.0} for x, y in cylinders]
    scenario = Scenario.model_validate({"seed": seed, "start": START, "objects": posts})
    goal = PoseGoal(x_m=GOAL[0], y_m=GOAL[1], heading_rad=math.nan)
    return drive_to_goal(Setup(vehicle=load_vehicle(VEHICLE), scenario=scenario), goal, PlanOptions(), Products())


def _rows(folder: str, name: str) -> list[dict[str, str]]:
    with (Path(folder) / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
