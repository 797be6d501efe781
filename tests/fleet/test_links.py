"""Half of all messages lost, the rest up to a second late, robots that freeze: no two ever come too near."""

import math
from itertools import combinations

import numpy as np
import pytest
import shapely

from tests.fleet.kinematic import corner_grid, names_of, on_circle, poses, square
from tests.fleet.lossy import LossyTeam, Weather
from touchline.services.fleet.cells import BufferedCell, SegmentsMeet
from touchline.services.fleet.hub import Hub
from touchline.services.fleet.links import NumberedCell, RobotEnd, Whereabouts
from touchline.services.fleet.lloyd import deployment, settled
from touchline.services.fleet.tasks import Deploy, GoalLists, swap

APART_M = 0.4
AT_REST = np.array((1.0, 1.0, 1.0, 1.0))


def half_plane(x_most: float) -> BufferedCell:
    """All that lies left of a line."""
    corners = np.array([(-9.0, -9.0), (x_most, -9.0), (x_most, 9.0), (-9.0, 9.0)])
    return BufferedCell(np.array([(1.0, 0.0, x_most)]), corners)


def told(number: int, x_most: float, echo_s: float = 0.0) -> NumberedCell:
    return NumberedCell("tb01", number, half_plane(x_most), (0.0, 0.0), echo_s)


def swapping(robots: int, weather: Weather, seed: int) -> tuple[LossyTeam, np.ndarray]:
    states = on_circle(robots, 1.5, 2.5, seed)
    task = swap({name: (pose.x_m, pose.y_m) for name, pose in poses(states).items()})
    goals = 2.0 * states[:, :2].mean(axis=0) - states[:, :2]
    return LossyTeam(states, square(5.0), task, weather, seed), goals


def missing(team: LossyTeam, goals: np.ndarray) -> set[str]:
    off = np.hypot(*(team.states[:, :2] - goals).T)
    return {name for name, each in zip(team.names, off, strict=True) if each > 0.1}


def nearest_cells_m(team: LossyTeam) -> float:
    """The least distance of the cells that two robots keep to which may drive both."""
    driving = [end.kept for end in team.ends.values() if end.may_drive(team.now_s)]
    shapes = [shapely.Polygon(each.cell.corners) for each in driving if each and len(each.cell.corners) > 2]
    return min((one.distance(other) for one, other in combinations(shapes, 2)), default=math.inf)


def test_a_robot_adopts_a_newer_cell_that_it_is_in_and_no_other() -> None:
    end = RobotEnd("tb01", 3.0)
    assert end.say(0.0, AT_REST)[3:] == (0, 0)
    end.receive(told(2, 1.5), AT_REST)
    end.receive(told(1, 9.0), AT_REST)
    assert end.say(0.1, AT_REST)[3:] == (2, 2)
    end.receive(told(4, 0.9), AT_REST)
    assert end.say(0.2, AT_REST)[3:] == (2, 4)
    end.receive(told(4, 0.9), np.zeros(4))
    end.receive(told(3, 9.0), np.zeros(4))
    assert end.say(0.3, AT_REST)[3:] == (2, 4)
    assert end.kept is not None
    assert end.kept.number == 2


def test_a_robot_drives_only_while_it_knows_that_it_is_heard() -> None:
    end = RobotEnd("tb01", 3.0)
    assert not end.may_drive(0.0)
    end.receive(told(1, 9.0, echo_s=2.0), AT_REST)
    end.receive(told(1, 9.0, echo_s=1.0), AT_REST)
    assert end.may_drive(5.0)
    assert not end.may_drive(5.1)
    end.receive(told(1, 9.0, echo_s=4.0), AT_REST)
    assert end.may_drive(7.0)


def test_a_team_that_loses_nothing_changes_places() -> None:
    team, goals = swapping(8, Weather(lost=0.0, delay_s=0.0), 1)
    team.run(40.0)
    assert not missing(team, goals)
    assert team.closest_m >= APART_M - 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_cells_that_are_kept_to_lie_apart_whatever_is_lost(seed: int) -> None:
    team, _ = swapping(6, Weather(frozen=(("tb02", 8.0, 16.0),)), seed)
    nearest = math.inf
    for update in range(1, 100):
        team.run(0.4 * update)
        nearest = min(nearest, nearest_cells_m(team))
    assert nearest >= APART_M - 1e-9
    assert team.closest_m >= APART_M - 1e-9


class NewestOnly(Hub):
    """Goes on to the newest plane of two robots without caring which cell the other may still be using."""

    def _planes_of(self, name, new):
        found = super()._planes_of(name, new)
        return {other: [max(planes, key=lambda plane: plane.number)] for other, planes in found.items()}


def test_going_on_to_the_newest_plane_alone_is_not_safe(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test above finds what it looks for."""
    monkeypatch.setattr("tests.fleet.lossy.Hub", NewestOnly)
    team, _ = swapping(6, Weather(), 0)
    nearest = math.inf
    for update in range(1, 100):
        team.run(0.4 * update)
        nearest = min(nearest, nearest_cells_m(team))
    assert nearest < APART_M - 0.05


@pytest.mark.parametrize("seed", range(2))
def test_a_team_spreads_with_half_of_its_messages(seed: int) -> None:
    area, start = square(5.0), corner_grid(10)
    team = LossyTeam(start, area, Deploy(area), Weather(), seed)
    team.run(90.0)
    of_points = deployment(settled(start[:, :2].copy(), area), area).cost
    assert team.closest_m >= APART_M - 1e-6
    assert deployment(np.ascontiguousarray(team.states[:, :2]), area).cost < 1.03 * of_points


@pytest.mark.parametrize("seed", range(2))
def test_others_go_round_a_frozen_robot_and_it_goes_on_when_it_wakes(seed: int) -> None:
    team, goals = swapping(6, Weather(frozen=(("tb03", 10.0, 70.0),)), seed)
    team.run(16.0)
    assert team.hub.resting == {"tb03"}
    before = team.states[:, :2].copy()
    team.run(21.0)
    moved = np.hypot(*(team.states[:, :2] - before).T)
    assert moved[2] == 0.0
    assert sorted(moved)[3] > 0.05
    team.run(150.0)
    assert not team.hub.resting
    assert not missing(team, goals)
    assert team.closest_m >= APART_M - 1e-6


def test_a_robot_that_begins_anew_is_not_listened_to() -> None:
    starts = [
        Whereabouts(name, 0.0, np.array((x, 1.0, x, 1.0))) for name, x in zip(names_of(2), (1.0, 3.0), strict=True)
    ]
    hub = Hub(square(4.0), GoalLists({"tb01": [(3.0, 3.0)]}), starts)
    hub.update(0.4)
    (first, _) = hub.say()
    hub.receive(Whereabouts("tb01", 0.5, starts[0].segment, first.number, first.number), 0.5)
    hub.receive(Whereabouts("tb01", 0.6, starts[0].segment, 0, 0), 0.6)
    assert hub.say()[0].echo_s == 0.5
    hub.receive(Whereabouts("tb01", 0.4, starts[0].segment, first.number, first.number), 0.7)
    assert hub.say()[0].echo_s == 0.5
    hub.update(4.6)
    assert hub.resting == {"tb01", "tb02"}


def test_a_message_from_before_a_robot_came_to_rest_says_not_where_it_rests() -> None:
    starts = [Whereabouts("tb01", 0.0, AT_REST)]
    hub = Hub(square(4.0), GoalLists({}), starts)
    hub.update(3.4)
    assert hub.resting == {"tb01"}
    number = hub.say()[0].number
    hub.receive(Whereabouts("tb01", 3.3, AT_REST), 3.5)
    hub.update(3.8)
    assert hub.say()[0].number == number
    hub.receive(Whereabouts("tb01", 3.5, AT_REST), 3.9)
    hub.update(4.2)
    new = hub.say()[0]
    assert new.number > number
    assert new.echo_s == 0.0
    hub.receive(Whereabouts("tb01", 5.0, AT_REST, new.number, new.number), 5.0)
    assert not hub.resting
    assert hub.say()[0].echo_s == 5.0


def test_robots_at_one_place_are_refused() -> None:
    with pytest.raises(SegmentsMeet, match="robot a is about to run into b"):
        Hub(square(4.0), GoalLists({}), [Whereabouts("b", 0.0, AT_REST), Whereabouts("a", 0.0, AT_REST)])
