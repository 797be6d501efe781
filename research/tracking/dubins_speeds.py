"""Speed laws on Dubins paths: constant, the network study's, and the planner's passes."""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.vehicles.shipped import TURTLEBOT2
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.poses.law4 import ARRIVED_M, SLOW_MPS, STEP_S, Law4
from touchline.services.planner.poses.shipped_methods import BEARING
from touchline.services.planner.poses.traveller import Traveller
from touchline_research.target_table import TargetRow, TargetTable, against_targets
from touchline_research.tracking.studied_robot import ORIGIN

RADIUS_M: Final = 0.3
HALF_BOX_M: Final = 2.5
GAINS_1PS: Final = (0.5, 1.0, 2.0)
OPTIONS: Final = PlanOptions(kappa_max_1pm=1.0 / RADIUS_M, start=ORIGIN)
MOST_MPS2: Final = TURTLEBOT2.drive.max_acceleration_mps2
MEAN_S, NEAR_M, ROUNDING = 6.0, 0.01, 1e-5


class SpeedRun(NamedTuple):
    """Drive along a path: seconds, maximum acceleration (m/s²), speed at the end (m/s), distance to the goal (m)."""

    seconds: float
    acceleration_mps2: float
    left_mps: float
    off_m: float


def dubins_speeds(count: int) -> TargetTable:
    """Create the table over a number of paths."""
    traveller = Traveller.of(TURTLEBOT2, OPTIONS)
    goals = list(_goals(count))
    paths = [BEARING.between(ORIGIN, goal, traveller).path for goal in goals]
    rows = [_row(f"constant {SLOW_MPS} m/s", [_constant(path) for path in paths])]
    rows += [_row(f"law4, p = {gain:g} 1/s", [_by_law4(Law4(gain), path) for path in paths]) for gain in GAINS_1PS]
    rows.append(
        _row("ours: the planner's passes", [_planned(goal) for goal in goals], TURTLEBOT2.drive.max_acceleration_mps2)
    )
    title = f"Speed laws on {count} Dubins paths to the bearing, 5 m box, radius {RADIUS_M} m, ≤ 0.5 m/s, from rest"
    note = (
        f"law4 is done within {1e2 * ARRIVED_M:.0f} cm of the goal, the passes at rest in it. All forgive the steps of "
        f"curvature of such paths. Accelerations are along the path, {MOST_MPS2:g} m/s² is the vehicle's."
    )
    return TargetTable(
        title, ("law", "mean", "largest acceleration", "left at the end", "off the goal"), tuple(rows), note
    )


def _goals(count: int) -> Iterator[PathPose]:
    for x, y in np.random.default_rng(9).uniform(-HALF_BOX_M, HALF_BOX_M, (count, 2)).tolist():
        yield PathPose(x, y, math.nan)


def _row(name: str, runs: list[SpeedRun], most_mps2: float = 0.0) -> TargetRow:
    table = np.array(runs)
    mean_s = float(table[:, 0].mean())
    acceleration, left, off = table[:, 1:].max(axis=0).tolist()
    asked = [
        (f"≤ {MEAN_S:g} s", mean_s <= MEAN_S),
        (f"≤ {most_mps2:g} m/s²", acceleration <= most_mps2 * (1.0 + ROUNDING)),
        (f"at rest within {1e2 * NEAR_M:g} cm", left == 0.0 and off <= NEAR_M),
    ]
    cells = (name, f"{mean_s:.2f} s", f"{acceleration:.2f} m/s²", f"{left:.2f} m/s", f"{1e2 * off:.2f} cm")
    figures = {"mean_s": mean_s, "acceleration_mps2": acceleration, "left_mps": left, "off_m": off}
    return TargetRow(cells, *against_targets(asked if most_mps2 else []), figures)


def _constant(path: PiecePath) -> SpeedRun:
    return SpeedRun(path.length_m / SLOW_MPS, SLOW_MPS / STEP_S, SLOW_MPS, 0.0)


def _by_law4(law: Law4, path: PiecePath) -> SpeedRun:
    speeds = law.speeds(path)
    steps = np.abs(np.diff(speeds)) / STEP_S
    off = path.length_m - STEP_S * float(speeds.sum())
    return SpeedRun(STEP_S * (len(speeds) - 1), float(steps.max(initial=0.0)), float(speeds[-1]), abs(off))


def _planned(goal: PathPose) -> SpeedRun:
    plan = plan_to_goal(
        PoseGoal(x_m=goal.x_m, y_m=goal.y_m, heading_rad=math.nan, method="bearing"), TURTLEBOT2, OPTIONS
    )
    speeds = plan.speeds
    gain = np.abs(np.diff(np.square(speeds.speed_mps))) / (2.0 * np.diff(speeds.station_m))
    x, y, _ = plan.sent[-1].curve.end
    off = math.hypot(x - goal.x_m, y - goal.y_m)
    return SpeedRun(speeds.total_time_s, float(gain.max()), float(speeds.speed_mps[-1]), off)
