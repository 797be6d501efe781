"""Teams of unicycles under the coordinator: they spread as points do, and change places, and never touch."""

import math

import numpy as np
import pytest

from tests.fleet.kinematic import Driven, corner_grid, driven, names_of, on_circle, poses, square
from touchline.services.fleet.cells import SegmentsMeet, buffered_cells
from touchline.services.fleet.coordinator import Coordinator, RobotPose, TeamSettings
from touchline.services.fleet.deadlock import PATIENCE_UPDATES, RightHand, rightmost
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.lloyd import deployment, settled, square_cost
from touchline.services.fleet.tasks import Deploy, GoalLists, swap

BODY_M = 0.354
APART_M = 0.4


@pytest.mark.parametrize(("robots", "within_s", "driven_m"), [(10, 20.0, 3.5), (20, 25.0, 4.5)])
def test_a_team_spreads_as_well_as_points_do(robots: int, within_s: float, driven_m: float) -> None:
    side = math.sqrt(2.5 * robots)
    area, start = square(side), corner_grid(robots)
    soon, late = (driven(start, area, Deploy(area), until_s) for until_s in (within_s, 120.0))
    costs = [deployment(np.ascontiguousarray(each.states[:, :2]), area).cost for each in (soon, late)]
    of_points = deployment(settled(start[:, :2].copy(), area), area).cost
    assert late.closest_m > BODY_M + 0.01
    assert costs[1] < 1.015 * of_points
    assert costs[0] < 1.05 * costs[1]
    assert late.driven_m.mean() < driven_m
    assert costs[1] / square_cost(robots, area.area_m2) < 1.03


def changed_places(robots: int, seed: int) -> tuple[Driven, int]:
    """A team that has changed places on a circle, 0.8 m apart at least, and how many have not arrived."""
    radius = max(1.5, 0.8 * robots / math.tau)
    states = on_circle(robots, radius, radius + 1.0, seed)
    goals = 2.0 * states[:, :2].mean(axis=0) - states[:, :2]
    task = swap({name: (pose.x_m, pose.y_m) for name, pose in poses(states).items()})
    found = driven(states, square(2.0 * radius + 2.0), task, 90.0, goals)
    return found, int((np.hypot(*(found.states[:, :2] - goals).T) >= 0.1).sum())


@pytest.mark.parametrize("robots", [4, 8, 12, 20])
@pytest.mark.parametrize("seed", range(3))
def test_a_team_changes_places_across_a_circle(robots: int, seed: int) -> None:
    found, missing = changed_places(robots, seed)
    assert missing == 0
    assert found.time_s <= 45.0
    assert found.closest_m >= APART_M - 1e-6


def test_the_order_in_which_robots_are_listed_changes_nothing() -> None:
    area = square(5.0)
    told = {name: RobotPose(*row) for name, row in zip(names_of(8), on_circle(8, 1.5, 2.5, 4).tolist(), strict=True)}
    turned = dict(reversed(told.items()))
    one, other = (Coordinator(area, Deploy(area)).update(0.0, each) for each in (told, turned))
    assert list(one) == list(other)
    for name, aim in one.items():
        assert aim.target_m == other[name].target_m
        assert aim.cell.half_planes.tobytes() == other[name].cell.half_planes.tobytes()


def test_cells_are_made_anew_every_period_and_not_before() -> None:
    area = square(5.0)
    coordinator = Coordinator(area, GoalLists({}), TeamSettings(period_s=0.4))
    first = coordinator.update(0.0, {"a": RobotPose(1.0, 1.0, 0.0, 0.0)})
    assert first["a"].target_m == (1.0, 1.0)
    assert coordinator.update(0.39, {"a": RobotPose(2.0, 1.0, 0.0, 0.0)}) is first
    assert coordinator.update(0.4, {"a": RobotPose(2.0, 1.0, 0.0, 0.0)})["a"].target_m == (2.0, 1.0)
    assert coordinator.update(0.8, {}) == {}


def test_robots_that_overlap_are_told_of_by_name() -> None:
    with pytest.raises(SegmentsMeet, match="robot tb1 is about to run into tb2"):
        Coordinator(square(5.0), GoalLists({})).update(0.0, dict.fromkeys(("tb2", "tb1"), RobotPose(1, 1, 0, 0)))


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
