"""Half of all messages lost, the rest up to a second late, robots that freeze: no two ever come too near."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely

from tests.fleet.teams import (
    FOUL,
    TEAM_LIMITS,
    Team,
    Weather,
    corner_grid,
    corners_of,
    names_of,
    on_circle,
    seeds,
    square,
    swapped,
    whereabouts,
)
from touchline.coordination.hub import Hub
from touchline.coordination.lloyd import deployment, settled
from touchline.coordination.tasks import Deploy, GoalLists
from touchline.onboard.executive.cell_keeper import CellKeeper
from touchline.schemas.messages import Guidance

APART_M = 0.4
AT_REST = (1.0, 1.0)
HERE, NEARER = (1 + 1j, 1 + 1j), (0j, 0j)


def told(number: int, x_most: float, echo_s: float = 0.0, target_x_m: float = 0.0) -> Guidance:
    """To keep to what lies left of a line."""
    rows = np.array((1.0, 0.0, x_most))
    return Guidance(number=number, echo_s=echo_s, half_planes=rows, target_x_m=target_x_m)


def swapping(robots: int, weather: Weather, seed: int) -> tuple[Team, np.ndarray]:
    states = on_circle(robots, 1.5, 2.5, seed)
    task, goals = swapped(states)
    return Team(states, square(5.0), task, weather, seed), goals


def missing(team: Team, goals: np.ndarray) -> set[str]:
    off = np.hypot(*(team.states[:, :2] - goals).T)
    return {name for name, each in zip(team.names, off, strict=True) if each > 0.1}


def nearest_cells_m(team: Team) -> float:
    """The least distance of the cells that two robots keep to whose leases both hold."""
    keepers = [keeper for keeper in team.keepers.values() if team.now_s <= keeper.until_s]
    corners = [corners_of(keeper.half_planes) for keeper in keepers if len(keeper.half_planes)]
    shapes = [shapely.Polygon(each) for each in corners if len(each) > 2]
    return min((one.distance(other) for one, other in combinations(shapes, 2)), default=math.inf)


def test_a_robot_adopts_a_newer_cell_that_it_is_in_and_no_other() -> None:
    keeper = CellKeeper(TEAM_LIMITS)

    def receive(guidance: Guidance, segment: tuple[complex, complex]) -> tuple[int, int, float]:
        keeper.receive(guidance, segment)
        said = keeper.report(0.5, segment)
        assert (said.stamp_s, said.x_m, said.stop_y_m) == (0.5, segment[0].real, segment[1].imag)
        return said.adopted, said.decided, keeper.target_m.real

    assert (keeper.report(0.0, HERE).adopted, keeper.report(0.0, HERE).decided) == (0, 0)
    assert receive(told(2, 1.5, target_x_m=0.2), HERE) == (2, 2, 0.2)
    assert receive(told(1, 9.0, target_x_m=0.1), HERE) == (2, 2, 0.2)
    assert receive(told(4, 0.9, target_x_m=0.4), HERE) == (2, 4, 0.2)
    assert receive(told(4, 0.9, target_x_m=0.4), NEARER) == (2, 4, 0.2)
    assert receive(told(3, 9.0, target_x_m=0.3), NEARER) == (2, 4, 0.2)
    assert receive(told(5, 1.2, target_x_m=0.5), (1 + 1j, 1.3 + 1j)) == (2, 5, 0.2)
    assert keeper.half_planes.tolist() == [[1.0, 0.0, 1.5]]


def test_a_robot_may_believe_itself_a_little_outside_of_a_cell_that_it_takes() -> None:
    keeper = CellKeeper(TEAM_LIMITS.model_copy(update={"doubt_m": 0.005}))
    keeper.receive(told(1, 0.994), HERE)
    assert keeper.report(0.0, HERE).adopted == 0
    keeper.receive(told(2, 0.996), HERE)
    assert keeper.report(0.0, HERE).adopted == 2


@pytest.mark.parametrize(
    "changed",
    [
        {"half_planes": np.array((1.0, 0.0))},
        {"half_planes": np.array((1.0, 0.0, math.nan))},
        {"target_x_m": math.inf},
        {"echo_s": math.nan},
    ],
    ids=["not three numbers", "no offset", "no target", "no echo"],
)
def test_a_robot_passes_over_what_is_no_guidance(changed: dict[str, object]) -> None:
    keeper = CellKeeper(TEAM_LIMITS)
    keeper.receive(told(1, 9.0, echo_s=7.0).model_copy(update=changed), HERE)
    assert keeper.until_s == -math.inf
    assert keeper.report(0.0, HERE).decided == 0


def test_a_robot_drives_only_while_it_knows_that_it_is_heard() -> None:
    keeper = CellKeeper(TEAM_LIMITS)
    assert keeper.until_s == -math.inf
    keeper.receive(told(1, 9.0, echo_s=2.0), HERE)
    keeper.receive(told(1, 9.0, echo_s=1.0), HERE)
    assert keeper.until_s == 2.0 + TEAM_LIMITS.lease_s
    keeper.receive(told(1, 9.0, echo_s=4.0), HERE)
    assert keeper.until_s == 4.0 + TEAM_LIMITS.lease_s


@seeds(4)
def test_cells_that_are_kept_to_lie_apart_whatever_is_lost(seed: int) -> None:
    team, _ = swapping(6, replace(FOUL, frozen=(("tb02", 8.0, 16.0),)), seed)
    nearest = math.inf
    for update in range(1, 100):
        team.run(0.4 * update)
        nearest = min(nearest, nearest_cells_m(team))
    assert nearest >= APART_M - 1e-9
    assert team.closest_m >= APART_M - 1e-9


@seeds(2)
def test_a_team_spreads_with_half_of_its_messages(seed: int) -> None:
    area, start = square(5.0), corner_grid(10)
    team = Team(start, area, Deploy(area), FOUL, seed)
    of_points = deployment(settled(start[:, :2].copy(), area), area).cost
    team.run_until(lambda: deployment(np.ascontiguousarray(team.states[:, :2]), area).cost < 1.03 * of_points, 90.0)
    assert team.closest_m >= APART_M - 1e-6


@seeds(2)
def test_others_go_round_a_frozen_robot_and_it_goes_on_when_it_wakes(seed: int) -> None:
    team, goals = swapping(6, replace(FOUL, frozen=(("tb03", 10.0, 70.0),)), seed)
    team.run(16.0)
    assert team.hub.resting == {"tb03"}
    before = team.states[:, :2].copy()
    team.run(21.0)
    moved = np.hypot(*(team.states[:, :2] - before).T)
    assert moved[2] == 0.0
    assert sorted(moved)[3] > 0.05
    team.run_until(lambda: not team.hub.resting and not missing(team, goals), 150.0)
    assert team.closest_m >= APART_M - 1e-6


def test_a_robot_that_begins_anew_is_not_listened_to() -> None:
    places = dict(zip(names_of(2), ((1.0, 1.0), (3.0, 1.0)), strict=True))
    hub = Hub(square(4.0), GoalLists({"tb01": [(3.0, 3.0)]}), {name: whereabouts(at) for name, at in places.items()})
    hub.update(0.4)
    first = hub.guidance()["tb01"].number
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=0.5, adopted=first, decided=first), 0.5)
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=0.6), 0.6)
    assert hub.guidance()["tb01"].echo_s == 0.5
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=0.4, adopted=first, decided=first), 0.7)
    assert hub.guidance()["tb01"].echo_s == 0.5
    hub.update(4.6)
    assert hub.resting == {"tb01", "tb02"}


def test_a_message_from_before_a_robot_came_to_rest_says_not_where_it_rests() -> None:
    hub = Hub(square(4.0), GoalLists({}), {"tb01": whereabouts(AT_REST)})
    hub.update(3.4)
    assert hub.resting == {"tb01"}
    number = hub.guidance()["tb01"].number
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=3.3), 3.5)
    hub.update(3.8)
    assert hub.guidance()["tb01"].number == number
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=3.5), 3.9)
    hub.update(4.2)
    new = hub.guidance()["tb01"]
    assert new.number > number
    assert new.echo_s == 0.0
    hub.receive("tb01", whereabouts(AT_REST, stamp_s=5.0, adopted=new.number, decided=new.number), 5.0)
    assert not hub.resting
    assert hub.guidance()["tb01"].echo_s == 5.0
