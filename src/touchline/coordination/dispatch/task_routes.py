"""Routes of robots through tasks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.dispatch.insertion_kernels import (
    FreeRobots,
    Rates,
    RoutingProblem,
    TaskTable,
    WaysBetween,
    drive_route,
    insert_all,
    left_wh,
    task_wh,
    way_s,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class TaskRoutes:
    """Routes of all robots.

    Args:
        problem: TaskTable, robots and ground.

    Attributes:
        routes: TaskTable of each robot, in their order.
        finished_s: (t,) time at which each task is finished; nan: nobody can do it.
    """

    def __init__(self, problem: RoutingProblem) -> None:
        count, tasks = len(problem.robots.ready_s), len(problem.tasks.first)
        table, counts = np.zeros((count, tasks), dtype=np.int64), np.zeros(count, dtype=np.int64)
        if count and tasks:
            insert_all(problem, table, counts)
        self.routes: list[list[int]] = [row[:most].tolist() for row, most in zip(table, counts.tolist(), strict=True)]
        self.finished_s: Floats = np.full(tasks, math.nan)
        for robot, route in enumerate(self.routes):
            self.finished_s[route] = route_times(problem, robot, route)[1]


def route_times(problem: RoutingProblem, robot: int, route: list[int]) -> tuple[float, Floats]:
    """Return the cost of a route (s; inf: impossible), and (n,) when its tasks are finished (s)."""
    finished_s = np.full(len(route), math.nan)
    tasks = np.array(route, dtype=np.int64)
    return float(drive_route(robot, tasks, len(route), problem, finished_s)), finished_s


def warm_up_routes() -> None:
    """Compile or load the kernels of routes."""
    ones, zeros, none = np.ones(1), np.zeros(1), np.zeros(1, dtype=np.int64)
    ways = WaysBetween(np.ones((1, 1)), ones, none)
    tasks = TaskTable(none, none, zeros, zeros, zeros, ones, none)
    robots = FreeRobots(zeros, ones, np.ones((1, 1)), ones, none)
    problem = RoutingProblem(robots, tasks, ways, Rates(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0))
    TaskRoutes(problem)
    task_wh(way_s(1.0, problem.rates), 0, problem)
    left_wh(0, problem)
