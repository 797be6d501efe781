"""Robots that join a team while it drives, and such as leave it."""

import numpy as np
import pytest
import shapely

from tests.fleet.teams import (
    FAIR,
    FOUL,
    MESSAGES_PER_UPDATE,
    TICKS_PER_MESSAGE,
    Team,
    Weather,
    corner_grid,
    corners_of,
    on_circle,
    seeds,
    square,
    swapped,
    whereabouts,
)
from touchline.coordination.hub import Hub
from touchline.coordination.lloyd import deployment
from touchline.coordination.tasks import Deploy, GoalLists
from touchline.schemas.messages.team_messages import NOTHING_HEARD_S

APART_M = 0.4
NEW = "tb99"
WEATHERS = pytest.mark.parametrize("weather", [FAIR, FOUL], ids=["fair", "foul"])


def nearest_cell_m(team: Team, place: np.ndarray) -> float:
    """The least distance of a place from any cell that a robot but the new one keeps to or is being sent."""
    cells = [each for name in team.names if name != NEW for each in team.cells_in_use(name)]
    shapes = [shapely.Polygon(corners) for corners in map(corners_of, cells) if len(corners) > 2]
    return float(min(shape.distance(shapely.Point(place)) for shape in shapes))


def arrived(team: Team, goals: np.ndarray) -> bool:
    """Return whether all are at their goals, and nobody is taken for one that does not drive."""
    return bool(np.hypot(*(team.states[:, :2] - goals).T).max() < 0.1) and not team.hub.resting


@WEATHERS
@seeds(3)
def test_a_robot_that_joins_gets_no_cell_before_all_others_keep_off_it(weather: Weather, seed: int) -> None:
    """It stands in cells that are in use, though far from everybody."""
    area = square(5.0)
    team = Team(corner_grid(10), area, Deploy(area), weather, seed)
    rng = np.random.default_rng(seed)
    team.run(rng.uniform(0.0, 3.0))
    place = rng.uniform(4.2, 4.7, 2)
    team.join(NEW, np.array((*place, rng.uniform(0.0, 6.0), 0.0)))
    covered = nearest_cell_m(team, place)
    while not team.may_drive(NEW):
        assert team.states[-1, :2].tolist() == place.tolist()
        team.run(team.now_s + 0.02)
        if any(len(rows) for rows in team.cells_in_use(NEW)):
            assert nearest_cell_m(team, place) >= APART_M - 1e-6
        else:
            covered = min(covered, nearest_cell_m(team, place))
        assert team.now_s < 60.0
    assert covered == 0.0
    within_m, longest_s = (0.05, 60.0) if weather is FAIR else (0.2, 90.0)

    def spread() -> bool:
        places = np.ascontiguousarray(team.states[:, :2])
        off_m = np.hypot(*(deployment(places, area).centroids - places).T).max()
        return bool(not team.hub.resting and team.driven_m[-1] > 0.1 and off_m < within_m)

    team.run_until(spread, team.now_s + longest_s)
    assert team.closest_m >= APART_M - 1e-6


@WEATHERS
@seeds(3)
def test_a_robot_joins_from_outside_while_others_change_places(weather: Weather, seed: int) -> None:
    states = on_circle(6, 1.5, 2.5, seed)
    _, goals = swapped(states)
    rng = np.random.default_rng(seed)
    goal = np.array((2.5, 2.5))
    all_goals = {f"tb{k:02}": [(x, y)] for k, (x, y) in enumerate(goals.tolist(), start=1)}
    task = GoalLists(all_goals | {NEW: [(2.5, 2.5)]})
    team = Team(states, square(5.0), task, weather, seed)
    team.run(rng.uniform(0.0, 12.0))
    team.join(NEW, np.array((rng.uniform(1.0, 4.0), -0.2, np.pi / 2, 0.0)))
    assert team.hub.names[-1] == NEW
    assert NEW in team.hub.resting
    team.run_until(lambda: arrived(team, np.vstack((goals, goal))), 60.0 if weather is FAIR else 200.0)
    assert team.closest_m >= APART_M - 1e-6


def test_a_robot_that_joins_may_drive_when_it_keeps_to_a_cell_that_all_others_keep_off() -> None:
    hub = Hub(square(6.0), GoalLists({NEW: [(5.0, 1.0)]}), {"tb01": whereabouts((1.0, 1.0))})
    hub.update(0.0)
    hub.receive("tb01", whereabouts((1.0, 1.0), stamp_s=0.1, adopted=1, decided=1), 0.1)
    hub.join(NEW, whereabouts((3.0, 1.0), stamp_s=50.0), 0.2)
    assert hub.guidance()[NEW].half_planes.tolist() == []
    assert hub.cells["tb01"].excess_m(np.array((3.0, 1.0, 3.0, 1.0))) < 0.0
    hub.receive(NEW, whereabouts((3.0, 1.0), stamp_s=53.0), 3.2)
    hub.update(3.3)
    assert hub.guidance()[NEW].number == 0
    assert hub.cells["tb01"].excess_m(np.array((3.0, 1.0, 3.0, 1.0))) < 0.0

    def team_says(now_s: float, adopted: int) -> None:
        hub.receive(NEW, whereabouts((3.0, 1.0), stamp_s=now_s + 49.8), now_s)
        hub.receive("tb01", whereabouts((1.0, 1.0), stamp_s=now_s, adopted=adopted, decided=adopted), now_s)

    team_says(4.0, 1)
    hub.update(4.1)
    assert hub.cells["tb01"].excess_m(np.array((3.0, 1.0, 3.0, 1.0))) == pytest.approx(APART_M)
    team_says(4.4, 1)
    hub.update(4.5)
    assert hub.guidance()[NEW].number == 0
    team_says(4.8, hub.guidance()["tb01"].number)
    hub.update(4.9)
    new = hub.guidance()[NEW]
    assert new.number > 0
    assert new.echo_s == NOTHING_HEARD_S
    assert new.target_x_m == pytest.approx(5.0)
    hub.receive(NEW, whereabouts((3.0, 1.0), stamp_s=55.0, adopted=new.number, decided=new.number), 5.0)
    assert hub.guidance()[NEW].echo_s == 55.0


@WEATHERS
def test_who_leaves_is_not_kept_off_any_more(weather: Weather) -> None:
    states = np.array([(1.0, 1.0, 0.0, 0.0), (2.5, 1.0, 0.0, 0.0), (4.0, 4.0, 0.0, 0.0)])
    team = Team(states, square(5.0), GoalLists({"tb01": [(2.5, 1.0)]}), weather)
    team.run(20.0)
    assert np.hypot(*(team.states[0, :2] - (2.5, 1.0))) > APART_M - 1e-6
    team.leave("tb02")
    assert team.hub.names == ("tb01", "tb03")
    team.run(team.now_s + 2 * MESSAGES_PER_UPDATE * TICKS_PER_MESSAGE * 0.02)
    assert team.hub.cells["tb01"].excess_m(np.array((2.5, 1.0, 2.5, 1.0))) < 0.0
    team.run_until(lambda: bool(np.hypot(*(team.states[0, :2] - (2.5, 1.0))) < 0.1), 50.0)
    assert team.closest_m >= APART_M - 1e-6


@WEATHERS
@seeds(3)
def test_a_team_drives_on_when_one_of_it_leaves(weather: Weather, seed: int) -> None:
    states = on_circle(6, 1.5, 2.5, seed)
    task, goals = swapped(states)
    team = Team(states, square(5.0), task, weather, seed)
    team.run(8.0)
    team.leave("tb04")
    team.run_until(lambda: arrived(team, np.delete(goals, 3, axis=0)), 40.0 if weather is FAIR else 150.0)
    assert team.closest_m >= APART_M - 1e-6


def test_who_is_carried_elsewhere_gets_no_cell_before_all_others_keep_off_its_new_place() -> None:
    there, elsewhere = (3.0, 1.0), (1.0, 3.0)
    hub = Hub(square(6.0), GoalLists({}), {"tb01": whereabouts((1.0, 1.0)), NEW: whereabouts(there)})
    hub.update(0.0)
    hub.receive("tb01", whereabouts((1.0, 1.0), stamp_s=0.1, adopted=1, decided=1), 0.1)
    hub.leave(NEW)
    hub.join(NEW, whereabouts(elsewhere, stamp_s=50.0), 0.2)
    hub.receive(NEW, whereabouts(elsewhere, stamp_s=53.1), 3.3)
    hub.receive("tb01", whereabouts((1.0, 1.0), stamp_s=3.3, adopted=1, decided=1), 3.3)
    hub.update(3.4)
    assert hub.guidance()[NEW].number == 0
    hub.receive(NEW, whereabouts(elsewhere, stamp_s=53.6), 3.7)
    number = hub.guidance()["tb01"].number
    hub.receive("tb01", whereabouts((1.0, 1.0), stamp_s=3.7, adopted=number, decided=number), 3.7)
    assert hub.cells["tb01"].excess_m(np.array((*elsewhere, *elsewhere))) == pytest.approx(APART_M)
    hub.update(3.8)
    assert hub.guidance()[NEW].number > number
