"""RoutingProblem of assignment, from the records of tasks and robots."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.dispatch.distance_table import DistanceTable
from touchline.coordination.dispatch.insertion_kernels import (
    FreeRobots,
    Rates,
    RoutingProblem,
    TaskTable,
    WaysBetween,
    left_wh,
    task_wh,
    way_s,
)
from touchline.coordination.dispatch.robot_records import RobotRecord
from touchline.coordination.dispatch.task_records import TaskRecord
from touchline.coordination.dispatch.task_routes import TaskRoutes
from touchline.schemas.task_requests import DispatchTask

Floats = NDArray[np.float64]

LEG_S: Final = 2.0
"""Time that a way takes beyond its length over the speed: to turn, speed up and brake."""


class RobotFigures(NamedTuple):
    """Figures of a team's vehicle: largest speed (m/s), power while driving and standing (W), full battery (Wh)."""

    speed_mps: float
    driving_w: float
    standing_w: float
    battery_wh: float


class Energy(NamedTuple):
    """Energy that a robot needs for a task, has, and is to have left then (Wh)."""

    need_wh: float
    have_wh: float
    reserve_wh: float

    @property
    def suffices(self) -> bool:
        """True if it suffices."""
        return self.have_wh >= self.need_wh + self.reserve_wh

    def __str__(self) -> str:
        """Return it in words."""
        return (
            f"insufficient battery: needs {self.need_wh:.2f} Wh, has {self.have_wh:.2f} Wh, of which "
            f"{self.reserve_wh:.2f} Wh are the reserve"
        )


class RoutePlanner:
    """Assigns tasks to robots.

    Args:
        spec: Docks and figures of charging.
        table: Lengths of ways.
        figures: Figures of the robots.

    Attributes:
        docks: Place of each dock, x + iy (m), by name.
    """

    def __init__(self, spec: DispatchTask, table: DistanceTable, figures: RobotFigures) -> None:
        self._table, self._battery_wh = table, figures.battery_wh
        self.docks = {name: complex(dock.x_m, dock.y_m) for name, dock in spec.docks.items()}
        self.rates = Rates(
            speed_mps=figures.speed_mps,
            leg_s=LEG_S,
            driving_w=figures.driving_w,
            standing_w=figures.standing_w,
            charging_w=max(min((dock.power_w for dock in spec.docks.values()), default=1.0) - figures.standing_w, 1.0),
            full_wh=spec.recharge_soc * figures.battery_wh,
            least_wh=spec.recharge_threshold * figures.battery_wh if spec.docks else 0.0,
            reserve_wh=spec.reserve_share * figures.battery_wh,
            late_weight=spec.late_weight,
        )

    def way_s(self, place: complex, goal: complex) -> float:
        """Return the time of a way (s)."""
        return float(way_s(float(self._table.lengths_m([place], [goal])[0, 0]), self.rates))

    def nearest(self, place: complex, docks: Mapping[str, complex]) -> str:
        """Return the name of the nearest of some docks."""
        lengths_m = self._table.lengths_m([place], list(docks.values()))[0]
        return list(docks)[int(lengths_m.argmin())]

    def ends_at(self, robot: RobotRecord, now_s: float) -> tuple[float, float, complex]:
        """Return when a robot is free (s), its charge then (Wh), and where."""
        charge_wh, job, rates = robot.charge * self._battery_wh, robot.job, self.rates
        if job is None:
            return now_s, charge_wh, robot.place
        if job.charges:
            dock = self.docks[job.dock or self.nearest(robot.place, self.docks)]
            charging_s = max(rates.full_wh - charge_wh, 0.0) * 3600.0 / rates.charging_w
            return now_s + self.way_s(robot.place, dock) + charging_s, max(rates.full_wh, charge_wh), dock
        place, driven_s, stays_s = robot.place, 0.0, 0.0
        for number, stop in enumerate(job.record.stops[job.stop :]):
            worked_s = now_s - job.there_s if number == 0 and math.isfinite(job.there_s) else 0.0
            driven_s += self.way_s(place, stop.place) if number or not math.isfinite(job.there_s) else 0.0
            stays_s += max(stop.stay_s - worked_s, 0.0)
            place = stop.place
        early_s = job.record.request.earliest_start_s - now_s if job.stop == 0 else 0.0
        free_s = now_s + max(driven_s, early_s) + stays_s
        used_wh = (driven_s * rates.driving_w + stays_s * rates.standing_w) / 3600.0
        return free_s, max(charge_wh - used_wh, 0.0), place

    def assigned(self, robots: Sequence[RobotRecord], records: Sequence[TaskRecord], now_s: float) -> TaskRoutes:
        """Return routes of robots for tasks."""
        return TaskRoutes(self.problem(robots, records, now_s))

    def energy(self, robot: RobotRecord, record: TaskRecord, *, full: bool = False) -> Energy:
        """Return the energy for a task from where a robot is, with its charge or a full one."""
        problem = self.problem([robot], [record], 0.0)
        have_wh = max(self.rates.full_wh, robot.charge * self._battery_wh) if full else robot.charge * self._battery_wh
        need_wh = float(task_wh(float(problem.robots.away_m[0, 0]), 0, problem))
        return Energy(need_wh, have_wh, float(left_wh(0, problem)))

    def problem(self, robots: Sequence[RobotRecord], records: Sequence[TaskRecord], now_s: float) -> RoutingProblem:
        """Return what is to be assigned, from where robots will be free."""
        ends = [self.ends_at(robot, now_s) for robot in robots]
        places = list(dict.fromkeys([each.stops[k].place for each in records for k in (0, -1)]))
        number = {place: k for k, place in enumerate(places)}
        docks = list(self.docks.values())
        between_m = self._table.lengths_m(places + docks, places + docks)
        away_m = self._table.lengths_m([end[2] for end in ends], places + docks)
        stays_s = [sum(stop.stay_s for stop in each.stops) for each in records]
        driven_s = [self._within_s(each) for each in records]
        requests = [each.request for each in records]
        return RoutingProblem(
            FreeRobots(
                np.array([end[0] for end in ends]),
                np.array([end[1] for end in ends]),
                away_m,
                *_nearest(away_m, len(places)),
            ),
            TaskTable(
                np.array([number[each.stops[0].place] for each in records], dtype=np.int64),
                np.array([number[each.stops[-1].place] for each in records], dtype=np.int64),
                np.array(driven_s, dtype=np.float64),
                np.array(stays_s, dtype=np.float64),
                np.array([each.earliest_start_s for each in requests], dtype=np.float64),
                np.array([each.deadline_s for each in records], dtype=np.float64),
                np.array([each.priority for each in requests], dtype=np.int64),
            ),
            WaysBetween(between_m, *_nearest(between_m, len(places))),
            self.rates,
        )

    def _within_s(self, record: TaskRecord) -> float:
        """Return the time of driving from the first place of a task to the last (s)."""
        stops = record.stops
        return sum(self.way_s(one.place, other.place) for one, other in pairwise(stops))


def _nearest(lengths_m: Floats, places: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return the length of the way to the nearest dock, whose places come last, and its place."""
    to_docks = lengths_m[:, places:]
    if not to_docks.shape[1]:
        return np.full(len(lengths_m), math.inf), np.zeros(len(lengths_m), dtype=np.int64)
    return to_docks.min(axis=1), places + to_docks.argmin(axis=1).astype(np.int64)
