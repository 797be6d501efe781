"""A coordinator's report of a task that has ended."""

import numpy as np
import pytest

from tests.fleet.teams import whereabouts
from touchline.coordination.coordination import Coordination
from touchline.coordination.start_poses import free_area
from touchline.coordination.task_statistics import TaskStatistics
from touchline.schemas.team import TeamScenario

PLACES = {"a": (1.0, 1.0), "b": (2.0, 1.0), "c": (3.5, 1.0)}
GOALS = {"a": [(1.0, 1.05)], "b": [(2.0, 3.0)], "c": [(3.5, 3.0)]}


def run(team: Coordination, books: TaskStatistics, names: str, since_s: float, until_s: float) -> None:
    """These robots are heard ten times a second; they stand, `a` but nearly."""
    for tick in range(round(10 * since_s), round(10 * until_s)):
        for name in names:
            x, y = PLACES[name]
            number = team.guidance()[name].number if name in team.guidance() else 0
            stops = np.array((x, y, x + 0.1 * (name == "a"), y))
            team.hear(name, whereabouts(stops, stamp_s=tick / 10.0, adopted=number, decided=number), tick / 10.0)
        books.count(len(names), len(team.guidance()))
        if tick % 4 == 0:
            team.update(tick / 10.0)
            books.update(tick / 10.0)


def test_a_report_tells_who_has_not_arrived_and_why() -> None:
    places = {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in PLACES.items()}
    area = {"outline": [(0, 0), (4, 0), (4, 4), (0, 4)]}
    scenario = TeamScenario.model_validate({"places": places, "area": area, "task": {"kind": "goals", "goals": GOALS}})
    team = Coordination(scenario, free_area(scenario))
    books = TaskStatistics(team, "goals")
    assert books.report(finished=False) is None
    run(team, books, "abc", 10.0, 12.0)
    run(team, books, "ab", 12.0, 20.0)
    report = books.report(finished=True)
    assert report is not None
    assert (report.task, report.finished, report.robots, report.arrived) == ("goals", True, ("a", "b", "c"), 1)
    assert report.missing == ("b: its task ended before it arrived", "c: it is silent")
    assert (report.updates, report.heard, report.told) == (25, 220, 300)
    assert report.time_s == pytest.approx(9.6)
    assert report.nearest_m == pytest.approx(0.9)
