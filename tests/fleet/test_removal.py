"""Robots that are taken out of a team: only such as cannot drive, and for as long as nobody admits them again."""

import pytest

from tests.fleet.teams import whereabouts
from touchline.coordination.coordination import Coordination
from touchline.coordination.start_poses import free_area
from touchline.schemas.errors import SpecError
from touchline.schemas.team import TeamScenario

PLACES = {"a": (1.0, 1.0), "b": (2.0, 1.0), "c": (3.0, 1.0)}
TEAM = {
    "places": {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in PLACES.items()},
    "area": {"outline": [(0, 0), (4, 0), (4, 4), (0, 4)]},
}


def says(team: Coordination, name: str, now_s: float) -> None:
    """The robot, which stands, has adopted what it was told."""
    number = team.guidance()[name].number if name in team.guidance() else 0
    team.hear(name, whereabouts(PLACES[name], stamp_s=now_s, adopted=number, decided=number), now_s)


def run(team: Coordination, names: str, since_s: float, until_s: float) -> None:
    """These robots are heard, ten times a second."""
    for tick in range(round(10 * since_s), round(10 * until_s)):
        for name in names:
            says(team, name, tick / 10.0)
        if tick % 4 == 0:
            team.update(tick / 10.0)


@pytest.fixture
def team() -> Coordination:
    scenario = TeamScenario.model_validate({**TEAM, "task": {"kind": "goals", "goals": {}}})
    found = Coordination(scenario, free_area(scenario))
    run(found, "abc", 0.0, 4.0)
    return found


def test_who_may_drive_is_taken_out_only_if_somebody_answers_for_it(team: Coordination) -> None:
    with pytest.raises(SpecError, match="c sends messages, or did a moment ago: it may drive"):
        team.check_removal("c", forced=False)
    team.check_removal("c", forced=True)
    run(team, "ab", 4.0, 6.0)
    with pytest.raises(SpecError, match="may drive"):
        team.check_removal("c", forced=False)
    run(team, "ab", 6.0, 8.0)
    team.check_removal("c", forced=False)


def test_who_is_no_robot_of_the_team_or_all_of_it_is_not_taken_out(team: Coordination) -> None:
    with pytest.raises(SpecError, match="d is not in the team"):
        team.check_removal("d", forced=True)
    team.remove("b")
    with pytest.raises(SpecError, match="b is not in the team"):
        team.check_removal("b", forced=True)
    team.remove("c")
    with pytest.raises(SpecError, match="a is the only robot of the team"):
        team.check_removal("a", forced=True)


def test_who_is_out_is_neither_told_nor_taken_in_before_it_is_admitted(team: Coordination) -> None:
    team.remove("c")
    assert team.out == {"c"}
    run(team, "abc", 4.0, 8.0)
    assert set(team.guidance()) == {"a", "b"}
    assert [cell.name for cell in team.cells()] == ["a", "b"]
    team.admit("c")
    assert team.out == frozenset()
    run(team, "abc", 8.0, 14.0)
    assert set(team.guidance()) == {"a", "b", "c"}
    assert team.hub is not None
    assert not team.hub.resting
    assert team.guidance()["c"].number > 0


def test_another_coordinator_begins_with_those_that_are_left_and_goes_on_with_their_tasks() -> None:
    requests = [{"category": "go_to_place", "place": (3.0, 3.0)}]
    scenario = TeamScenario.model_validate({**TEAM, "task": {"kind": "dispatch", "requests": requests}})
    team = Coordination(scenario, free_area(scenario))
    run(team, "abc", 10.0, 14.0)
    kept = team.dispatch_memory
    assert kept is not None
    other = Coordination(scenario, free_area(scenario))
    other.expect("ab")
    other.go_on(kept)
    run(other, "ac", 1.0, 2.0)
    assert other.waits_for == ("b",)
    run(other, "abc", 2.0, 6.0)
    assert set(other.guidance()) == {"a", "b"}
    assert other.out == {"c"}
    assert (now := other.dispatch_memory) is not None
    assert now.time_s == pytest.approx(kept.time_s + 3.6)  # though its clock is another
    assert [(each.id, each.state, each.robot) for each in now.tasks] == [
        (each.id, each.state, each.robot) for each in kept.tasks
    ]
