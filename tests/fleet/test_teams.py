"""Teams of unicycles under a hub of which no message is lost: they spread as points do, change places, never touch."""

import math

import numpy as np
import pytest

from tests.fleet.all_at_once import buffered_cells, stopping_segments
from tests.fleet.teams import PERIOD_S, Team, corner_grid, driven, names_of, on_circle, square, swapped, whereabouts
from tests.fleet.unicycles import LIMITS
from touchline.coordination.cells import SegmentsMeet
from touchline.coordination.deadlock import PATIENCE_UPDATES, RightHand, rightmost
from touchline.coordination.free_area import FreeArea
from touchline.coordination.hub import Hub
from touchline.coordination.lloyd import deployment, settled, square_cost
from touchline.coordination.tasks import Deploy, GoalLists, swap

BODY_M = 0.354
APART_M = 0.4


@pytest.mark.parametrize(
    ("robots", "within_s", "driven_m"), [(10, 20.0, 3.5), pytest.param(50, 35.0, 6.5, marks=pytest.mark.full)]
)
def test_a_team_spreads_as_well_as_points_do(robots: int, within_s: float, driven_m: float) -> None:
    side = math.sqrt(2.5 * robots)
    area, start = square(side), corner_grid(robots)
    team, costs = Team(start, area, Deploy(area)), []
    for until_s in (within_s, 60.0):
        team.run(until_s)
        costs.append(deployment(np.ascontiguousarray(team.states[:, :2]), area).cost)
    of_points = deployment(settled(start[:, :2].copy(), area), area).cost
    assert team.closest_m > BODY_M + 0.01
    assert costs[1] < 1.015 * of_points
    assert costs[0] < 1.05 * costs[1]
    assert team.driven_m.mean() < driven_m
    assert costs[1] / square_cost(robots, area.area_m2) < 1.03


def changed_places(robots: int, seed: int) -> tuple[Team, int]:
    """A team that has changed places on a circle, 0.8 m apart at least, and how many have not arrived."""
    radius = max(1.5, 0.8 * robots / math.tau)
    states = on_circle(robots, radius, radius + 1.0, seed)
    task, goals = swapped(states)
    found = driven(states, square(2.0 * radius + 2.0), task, 90.0, goals)
    return found, int((np.hypot(*(found.states[:, :2] - goals).T) >= 0.1).sum())


@pytest.mark.parametrize(
    ("robots", "median_s"),
    [(4, 15.0), *(pytest.param(*each, marks=pytest.mark.full) for each in ((8, 21.0), (20, 34.0)))],
)
def test_a_team_changes_places_across_a_circle(robots: int, median_s: float) -> None:
    took_s = []
    for seed in range(5):
        found, missing = changed_places(robots, seed)
        assert missing == 0
        assert found.now_s <= 45.0
        assert found.closest_m >= APART_M - 1e-6
        took_s.append(found.now_s)
    assert np.median(took_s) <= median_s + 1e-9


def test_the_order_in_which_robots_are_listed_changes_nothing() -> None:
    area = square(5.0)
    rows = stopping_segments(on_circle(8, 1.5, 2.5, 4), LIMITS.acceleration_mps2)
    starts = {name: whereabouts(row) for name, row in zip(names_of(8), rows, strict=True)}
    hubs = [Hub(area, Deploy(area), each) for each in (starts, dict(reversed(starts.items())))]
    for hub, names in zip(hubs, (list(starts), list(reversed(starts))), strict=True):
        for now_s in (0.0, PERIOD_S):
            hub.update(now_s)
            for name in names:
                number = hub.guidance()[name].number
                hub.receive(name, starts[name].model_copy(update={"stamp_s": now_s + 0.1, "adopted": number}), now_s)
    one, other = hubs
    assert one.names == other.names == tuple(names_of(8))
    for name, told in one.guidance().items():
        assert (told.number, told.target_x_m, told.target_y_m) == (2, *_target(other, name))
        assert told.half_planes.tobytes() == other.guidance()[name].half_planes.tobytes()
        assert one.cells[name].half_planes.tobytes() == other.cells[name].half_planes.tobytes()


def _target(hub: Hub, name: str) -> tuple[float, float]:
    told = hub.guidance()[name]
    return told.target_x_m, told.target_y_m


def test_cells_are_made_anew_by_an_update_and_not_before() -> None:
    hub = Hub(square(5.0), GoalLists({}), {"a": whereabouts((1.0, 1.0))})
    assert (hub.guidance()["a"].number, *_target(hub, "a")) == (0, 1.0, 1.0)
    hub.update(0.0)
    assert (hub.guidance()["a"].number, *_target(hub, "a")) == (1, 1.0, 1.0)
    hub.receive("a", whereabouts((2.0, 1.0), stamp_s=0.3, adopted=1, decided=1), 0.3)
    assert (hub.guidance()["a"].number, *_target(hub, "a")) == (1, 1.0, 1.0)
    assert hub.places.tolist() == [[2.0, 1.0]]
    hub.update(0.4)
    assert (hub.guidance()["a"].number, *_target(hub, "a")) == (2, 2.0, 1.0)
    hub.leave("a")
    hub.update(0.8)
    assert hub.guidance() == {}


def test_another_task_is_gone_on_with() -> None:
    hub = Hub(square(5.0), GoalLists({"a": [(4.0, 1.0)]}), {"a": whereabouts((1.0, 1.0))})
    hub.update(0.0)
    assert _target(hub, "a") == (4.0, 1.0)
    hub.set_task(GoalLists({"a": [(1.0, 4.0)]}))
    hub.update(0.4)
    assert _target(hub, "a") == (1.0, 4.0)


def test_robots_that_overlap_are_told_of_by_name() -> None:
    starts = {"tb2": whereabouts((1.0, 1.0)), "tb1": whereabouts((1.0, 1.0))}
    with pytest.raises(SegmentsMeet, match="robot tb1 is about to run into tb2"):
        Hub(square(5.0), GoalLists({}), starts)
    hub = Hub(square(5.0), GoalLists({}), starts | {"tb1": whereabouts((2.0, 1.0))})
    hub.receive("tb1", whereabouts((1.0, 1.0), stamp_s=0.1), 0.1)
    with pytest.raises(SegmentsMeet, match="robot tb1 is about to run into tb2"):
        hub.update(0.4)


def test_goals_are_taken_in_turn_and_the_last_is_kept() -> None:
    task = GoalLists({"a": [(1.0, 0.0), (2.0, 0.0)]})
    here = np.array([(0.0, 0.0), (5.0, 5.0)])
    assert task.goals(["a", "b"], here).tolist() == [[1.0, 0.0], [5.0, 5.0]]
    assert task.goals(["a", "b"], here + np.array((0.95, 0.0)))[0].tolist() == [2.0, 0.0]
    assert task.goals(["a", "b"], here + np.array((2.0, 0.0)))[0].tolist() == [2.0, 0.0]
    assert swap({"a": (0.0, 1.0), "b": (4.0, 3.0)}).goals(["a", "b"], here).tolist() == [[4.0, 3.0], [0.0, 1.0]]


def test_who_is_stuck_goes_to_the_right_until_it_has_way_or_has_tried_long_enough() -> None:
    area, rule = square(6.0), RightHand()
    goal = np.array((5.0, 3.0))

    def target(x: float, others: tuple[float, float]) -> list[float]:
        rows = np.array([(x, 3.0, x, 3.0), (*others, *others)])
        found = rule.target("a", rows[0, :2], goal, buffered_cells(rows, area, 0.2)[0])
        return [round(value, 6) for value in found.tolist()]

    assert target(2.0, (4.0, 3.0)) == [2.8, 3.0]
    assert not rule.stuck
    assert target(2.78, (3.2, 3.0)) == [2.79, 0.2]
    assert rule.stuck == {"a"}
    for _ in range(PATIENCE_UPDATES):
        assert target(2.78, (3.2, 3.0)) == [2.79, 0.2]
    assert target(2.78, (3.2, 3.0)) == [2.79, 3.0]
    assert target(2.78, (3.2, 3.0)) == [2.79, 0.2]
    assert target(2.78, (4.0, 3.0)) == [3.19, 3.0]
    assert not rule.stuck
    assert target(4.95, (5.5, 3.0)) == [5.0, 3.0]


def test_the_rightmost_corner_is_the_farthest_of_equals() -> None:
    corners = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    assert rightmost(corners, np.array((1.0, 1.0)), np.array((9.0, 1.0))).tolist() == [2.0, 0.0]
    assert rightmost(corners, np.array((1.0, 1.0)), np.array((1.0, 9.0))).tolist() == [2.0, 2.0]


def test_a_team_in_a_room_with_an_obstacle_stays_off_it() -> None:
    pillar = [(2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (2.0, 3.0)]
    area = FreeArea.of([(0, 0), (6, 0), (6, 5), (0, 5)], [pillar])
    start = corner_grid(6)
    found = driven(start, area, Deploy(area), 60.0)
    assert found.closest_m >= APART_M - 1e-6
    beyond = np.maximum(np.abs(found.states[:, :2] - 2.5) - 0.5, 0.0)
    assert np.hypot(*beyond.T).min() >= 0.2 - 1e-6
    before, after = (deployment(np.ascontiguousarray(each[:, :2]), area).cost for each in (start, found.states))
    assert after < 0.5 * before
