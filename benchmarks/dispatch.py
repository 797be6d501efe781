"""Dispatch: time of an assignment, and teams that take whichever task is nearest beside it, from the same starts.

`python -m benchmarks dispatch`; `tasks` for `robots` are assigned `times` times; then `team` robots carry out
`deliveries` between random places, emulated, in `seeds` runs from `first` on, by regret insertion and by nearest task.
"""

import time
from unittest import mock

import numpy as np

from benchmarks._settings import Small
from touchline.coordination.dispatch.dispatched_task import dispatched
from touchline.coordination.dispatch.distance_table import DistanceTable
from touchline.coordination.dispatch.insertion_kernels import RoutingProblem
from touchline.coordination.dispatch.robot_records import RobotRecord
from touchline.coordination.dispatch.route_planning import RobotFigures, RoutePlanner
from touchline.coordination.dispatch.task_records import TaskRecord, stops_of
from touchline.coordination.dispatch.task_routes import TaskRoutes
from touchline.coordination.start_poses import free_area
from touchline.jobs.team.team_figures import team_figures
from touchline.jobs.team.team_run import TeamRun
from touchline.schemas.docks import DockSpec
from touchline.schemas.task_requests import DeliveryRequest, DispatchTask, located
from touchline.schemas.team import TeamScenario

SMALL = Small(
    {"robots": 4, "tasks": 8, "times": 3, "team": 2, "deliveries": 3, "seeds": 1},
    (
        "# tasks of # robots, # times: median # ms with distances, # ms without",
        "# deliveries by # robots, # seeds from #",
        "by median of all ended s median of mean end s driven m contacts open",
        "regret # # # # #",
        "nearest # # # # #",
    ),
)


class NearestTasks(TaskRoutes):
    """Each free robot takes the task that begins nearest to it, those that are free first choosing first."""

    def __init__(self, problem: RoutingProblem) -> None:
        robots, tasks = problem.robots, problem.tasks
        self.routes = [[] for _ in robots.ready_s]
        self.finished_s = np.full(len(tasks.first), 1e6)
        left = set(range(len(tasks.first)))
        for robot in np.argsort(robots.ready_s, kind="stable").tolist():
            if left:
                task = min(left, key=lambda each: (robots.away_m[robot, tasks.first[each]], each))
                left.discard(task)
                self.routes[robot] = [task]


def main(
    robots: int = 50, tasks: int = 200, times: int = 50, team: int = 8, deliveries: int = 32, seeds: int = 10,
    first: int = 1,
) -> None:  # fmt: skip
    """Print the time of an assignment, and a row for each rule."""
    _time(robots, tasks, times)
    print(f"{deliveries} deliveries by {team} robots, {seeds} seeds from {first}")
    print("by       median of all ended s  median of mean end s  driven m  contacts  open")
    for name, rule in (("regret", TaskRoutes), ("nearest", NearestTasks)):
        with mock.patch("touchline.coordination.dispatch.route_planning.TaskRoutes", rule):
            rows = np.array([_run(team, deliveries, seed) for seed in range(first, first + seeds)])
        all_s, mean_s, driven_m, contacts, open_tasks = rows.T
        print(
            f"{name:8} {np.median(all_s):21.1f}  {np.median(mean_s):20.1f}  {np.median(driven_m):8.0f}  "
            f"{contacts.sum():8.0f}  {open_tasks.sum():4.0f}",
            flush=True,
        )


def _requests(count: int, side_m: float, seed: int) -> tuple[DeliveryRequest, ...]:
    """Return deliveries between random places of a square."""
    places = np.random.default_rng(seed).uniform(0.8, side_m - 0.8, (count, 2, 2)).round(2).tolist()
    return tuple(DeliveryRequest(category="delivery", pickup=tuple(one), dropoff=tuple(other)) for one, other in places)


def _time(robots: int, tasks: int, times: int) -> None:
    area = free_area(TeamScenario(robots=robots))
    side_m = float(area.hull.max())
    dock = DockSpec(x_m=0.5, y_m=0.5)
    planner = RoutePlanner(
        DispatchTask(docks={"dock": dock}), DistanceTable(area, 0.2), RobotFigures(0.4, 18.0, 12.0, 32.0)
    )
    records = [
        TaskRecord(str(number), each, stops_of(each, located(each, {})), 0.0)
        for number, each in enumerate(_requests(tasks, side_m, 1))
    ]
    at = np.random.default_rng(2).uniform(0.5, side_m, (robots, 2)) @ (1.0, 1j)
    team = [RobotRecord(str(number), place, place, place, 32.0) for number, place in enumerate(at.tolist())]
    problem = planner.problem(team, records, 0.0)
    whole_s, kernel_s = np.zeros(times), np.zeros(times)
    TaskRoutes(problem)
    for k in range(times):
        begun = time.perf_counter()
        planner.assigned(team, records, 0.0)
        whole_s[k], begun = time.perf_counter() - begun, time.perf_counter()
        TaskRoutes(problem)
        kernel_s[k] = time.perf_counter() - begun
    whole_ms, kernel_ms = 1e3 * np.median(whole_s), 1e3 * np.median(kernel_s)
    print(f"{tasks} tasks of {robots} robots, {times} times: median {whole_ms:.1f} ms with distances, ", end="")
    print(f"{kernel_ms:.1f} ms without")


def _run(robots: int, count: int, seed: int) -> tuple[float, ...]:
    """Return when all tasks were done, and each in the mean (s), the way of all (m), contacts, and tasks left open."""
    side_m = float(free_area(TeamScenario(robots=robots)).hull.max())
    task = DispatchTask(requests=_requests(count, side_m, seed))
    world = TeamScenario().world.model_copy(update={"seed": seed})
    run = TeamRun(TeamScenario(robots=robots, task=task, world=world, duration_s=900.0, avoid="plans"))
    run.run()
    assert dispatched(run.task) is not None
    figures = team_figures(run, 1.0)
    told = figures["dispatch"]
    ends_s = [each["finished_s"] for each in told["tasks"] if each["state"] == "completed"]
    return max(ends_s), float(np.mean(ends_s)), told["driven_m"], figures["contacts"], count - len(ends_s)
