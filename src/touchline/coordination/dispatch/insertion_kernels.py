"""Kernels: assignment of tasks to routes of robots by regret insertion.

In each round every task that is left has a best insertion into each route; the task whose best and second best routes
differ most is inserted. Potvin and Rousseau, "A parallel route building algorithm for the vehicle routing and
scheduling problem with time windows", European Journal of Operational Research 66(3), 1993. After an insertion only
the insertions into that route change.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NOBODY: Final = -1
ONLY: Final = 1e9
"""Regret of a task that only one robot can do."""
_SAME_S: Final = 1e-6


class FreeRobots(NamedTuple):
    """Robots when they are free.

    Attributes:
        ready_s: (r,) time.
        charge_wh: (r,) charge by then.
        away_m: (r, p) length of the way to each place.
        dock_m: (r,) length of the way to the nearest dock; inf: there is none.
        dock: (r,) place of that dock.
    """

    ready_s: Floats
    charge_wh: Floats
    away_m: Floats
    dock_m: Floats
    dock: Ints


class TaskTable(NamedTuple):
    """Tasks, by number.

    Attributes:
        first: (t,) place where each begins.
        last: (t,) place where it ends.
        drive_s: (t,) time for that.
        stay_s: (t,) time at its places.
        earliest_s: (t,) time before which the first place is not worked at.
        deadline_s: (t,) time after which it is late; inf: never.
        priority: (t,)
    """

    first: Ints
    last: Ints
    drive_s: Floats
    stay_s: Floats
    earliest_s: Floats
    deadline_s: Floats
    priority: Ints


class WaysBetween(NamedTuple):
    """Ways between places.

    Attributes:
        between_m: (p, p) length of the way between places.
        dock_m: (p,) length of the way from each to the nearest dock; inf: there is none.
        dock: (p,) place of that dock.
    """

    between_m: Floats
    dock_m: Floats
    dock: Ints


class Rates(NamedTuple):
    """Figures that all robots have in common.

    Attributes:
        speed_mps: Speed on a way.
        leg_s: Time that a way takes beyond its length over the speed.
        driving_w: Power drawn while driving.
        standing_w: Power drawn while standing.
        charging_w: Power into the battery at a dock.
        full_wh: Charge up to which robots charge.
        least_wh: Charge below which a robot charges before its next task.
        reserve_wh: Charge that is to be left at the nearest dock.
        late_weight: Cost of a second of lateness.
    """

    speed_mps: float
    leg_s: float
    driving_w: float
    standing_w: float
    charging_w: float
    full_wh: float
    least_wh: float
    reserve_wh: float
    late_weight: float


class RoutingProblem(NamedTuple):
    """Tasks, robots and ground."""

    robots: FreeRobots
    tasks: TaskTable
    ground: WaysBetween
    rates: Rates


@kernel
def way_s(length_m: float, rates: Rates) -> float:
    """Return the time of a way (s)."""
    return length_m / rates.speed_mps + rates.leg_s if length_m > 0.0 else 0.0


@kernel
def task_wh(length_m: float, task: int, problem: RoutingProblem) -> float:
    """Return the energy of the way to a task, and of the task (Wh)."""
    tasks, rates = problem.tasks, problem.rates
    driven_s = way_s(length_m, rates) + tasks.drive_s[task]
    need_wh: float = (driven_s * rates.driving_w + tasks.stay_s[task] * rates.standing_w) / 3600.0
    return need_wh


@kernel
def left_wh(task: int, problem: RoutingProblem) -> float:
    """Return the charge that is to be left after a task: for the way to the nearest dock, and the reserve (Wh)."""
    if not math.isfinite(problem.ground.dock_m[problem.tasks.last[task]]):
        return problem.rates.reserve_wh
    back_s = way_s(problem.ground.dock_m[problem.tasks.last[task]], problem.rates)
    left: float = problem.rates.reserve_wh + back_s * problem.rates.driving_w / 3600.0
    return left


@kernel
def drive_route(robot: int, route: Ints, count: int, problem: RoutingProblem, finished_s: Floats) -> float:
    """Return the cost of a route: the sum of times until its tasks are finished, and of their lateness.

    Args:
        robot: The robot.
        route: (n,) its tasks.
        count: How many of them count.
        problem: All the rest.
        finished_s: (n,) filled with the time at which each is finished.

    Returns:
        Seconds; inf if the charge does not suffice, even with charging on the way.
    """
    robots, tasks, ground, rates = problem
    now_s, charge_wh, here, cost = robots.ready_s[robot], robots.charge_wh[robot], NOBODY, 0.0
    for k in range(count):
        task = route[k]
        first = tasks.first[task]
        length_m = robots.away_m[robot, first] if here == NOBODY else ground.between_m[here, first]
        need_wh = task_wh(length_m, task, problem)
        if charge_wh < max(need_wh + left_wh(task, problem), rates.least_wh):
            dock_m = robots.dock_m[robot] if here == NOBODY else ground.dock_m[here]
            if not math.isfinite(dock_m):
                return math.inf
            dock = robots.dock[robot] if here == NOBODY else ground.dock[here]
            detour_s = way_s(dock_m, rates)
            charge_wh -= detour_s * rates.driving_w / 3600.0
            if charge_wh < 0.0:
                return math.inf
            now_s += detour_s + max(rates.full_wh - charge_wh, 0.0) * 3600.0 / rates.charging_w
            charge_wh = max(rates.full_wh, charge_wh)
            length_m = ground.between_m[dock, first]
            need_wh = task_wh(length_m, task, problem)
            if charge_wh < need_wh + left_wh(task, problem):
                return math.inf
        arrives_s = now_s + way_s(length_m, rates)
        begun_s = max(arrives_s, tasks.earliest_s[task])
        now_s = begun_s + tasks.drive_s[task] + tasks.stay_s[task]
        charge_wh -= need_wh + (begun_s - arrives_s) * rates.standing_w / 3600.0
        here = tasks.last[task]
        finished_s[k] = now_s
        cost += now_s + rates.late_weight * max(now_s - tasks.deadline_s[task], 0.0)
    return cost


@kernel
def _best_place(task: int, robot: int, route: Ints, problem: RoutingProblem) -> tuple[float, int]:
    """Return the least cost of inserting a task into a route (n,), and before which of its tasks."""
    priority, best, place, count = problem.tasks.priority, math.inf, NOBODY, len(route)
    longer = np.empty(count + 1, dtype=np.int64)
    finished_s, times_s = np.empty(count), np.empty(count + 1)
    before = drive_route(robot, route, count, problem, finished_s)
    for at in range(count + 1):
        longer[:at] = route[:at]
        longer[at] = task
        longer[at + 1 :] = route[at:]
        cost = drive_route(robot, longer, count + 1, problem, times_s) - before
        if not cost < best:
            continue
        delays = False
        for k in range(at, count):
            delays |= priority[route[k]] > priority[task] and times_s[k + 1] > finished_s[k] + _SAME_S
        if not delays:
            best, place = cost, at
    return best, place


@kernel
def insert_all(problem: RoutingProblem, routes: Ints, counts: Ints) -> None:
    """Insert tasks into routes, those of high priority first.

    Args:
        problem: The tasks, robots and ground.
        routes: (r, t) filled with the tasks of each robot in their order.
        counts: (r,) how many each has; 0 at first.
    """
    robot_count, task_count = routes.shape
    priority = problem.tasks.priority
    cost = np.empty((task_count, robot_count))
    place = np.empty((task_count, robot_count), dtype=np.int64)
    left = np.ones(task_count, dtype=np.bool_)
    for task in range(task_count):
        for robot in range(robot_count):
            cost[task, robot], place[task, robot] = _best_place(task, robot, routes[robot, :0], problem)
    while True:
        chosen, robot, most, least = NOBODY, NOBODY, -1.0, math.inf
        for task in range(task_count):
            if not left[task] or (chosen != NOBODY and priority[task] < priority[chosen]):
                continue
            best, second, who = math.inf, math.inf, NOBODY
            for each in range(robot_count):
                if cost[task, each] < best:
                    best, second, who = cost[task, each], best, each
                elif cost[task, each] < second:
                    second = cost[task, each]
            if who == NOBODY:
                continue
            regret = second - best if math.isfinite(second) else ONLY
            higher = chosen == NOBODY or priority[task] > priority[chosen]
            if higher or regret > most + _SAME_S or (abs(regret - most) <= _SAME_S and best < least - _SAME_S):
                chosen, robot, most, least = task, who, regret, best
        if chosen == NOBODY:
            return
        route, at = routes[robot], place[chosen, robot]
        for k in range(counts[robot], at, -1):
            route[k] = route[k - 1]
        route[at] = chosen
        counts[robot] += 1
        left[chosen] = False
        for task in range(task_count):
            if left[task]:
                new = route[: counts[robot]]
                cost[task, robot], place[task, robot] = _best_place(task, robot, new, problem)
