"""The list of all robots as data: who needs an operator comes first, and nothing is passed over in silence."""

import pytest

from tests.tui import scenes
from tests.tui.console import reduced
from tests.tui.fleets import S, fleet
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.scenario import Origin, Scenario
from touchline.schemas.setup import Setup
from touchline.tui.fleet_rows import FleetRow, Trouble, fleet_rows, name_key, totals
from touchline.tui.node_health import LIVE_S
from touchline.tui.protocol import NodeChanged
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots


def robots_of(count: int, *states: int) -> Robots:
    robots = Robots()
    for name, link in fleet(count, *states).items():
        reduced(link.poll(), robots.add(name), now_s=0.0)
    return robots


def row(robots: Robots, name: str) -> FleetRow:
    return next(row for row in fleet_rows(robots) if row.name == name)


def test_who_needs_an_operator_comes_first_and_names_are_in_order_within_that():
    robots = robots_of(12, S.RUNNING)
    apply_event(robots.states["r11"], NodeChanged(topics.ROBOT_SIM, False), 0.0)
    robots.states["r10"].orders.stop.press("id", "")
    apply_event(robots.states["r05"], received(topics.STATUS, m.TraversalStatus(state=S.ABORTED, reason="bumper")), 0.0)
    for name, state in robots.states.items():
        state.now_s = 2 * LIVE_S if name == "r07" else 0.0
    rows = fleet_rows(robots)
    assert [each.name for each in rows[:5]] == ["r10", "r07", "r11", "r05", "r01"]
    assert [each.trouble for each in rows[:4]] == [
        Trouble.STOP_UNHEARD,
        Trouble.SILENT,
        Trouble.GONE,
        Trouble.HALTED,
    ]
    assert row(robots, "r05").alert == "bumper"
    assert row(robots, "r07").doubtful
    assert "STALE" in row(robots, "r07").alert
    assert [each.name for each in fleet_rows(robots, by_trouble=False)][:2] == ["r01", "r02"]


@pytest.mark.parametrize(("first", "second"), [("r2", "r10"), ("a/r9", "a/r10"), ("r", "r1"), ("club/r1", "r1")])
def test_names_are_sorted_as_people_count(first: str, second: str):
    assert name_key(first) < name_key(second)


def test_figures_are_those_that_the_robot_tells_and_unknown_where_it_tells_none():
    robots = robots_of(2, S.RUNNING)
    apply_event(robots.states["r02"], scenes.uncertain()[0], 0.0)
    known = row(robots, "r02")
    assert (known.battery, known.progress, known.speed_mps) == (0.89, 0.01, 0.5)
    assert known.off_m == pytest.approx(0.9)
    robots.add("r03")
    unknown = row(robots, "r03")
    assert (unknown.battery, unknown.progress, unknown.speed_mps, unknown.off_m) == (None, None, None, None)
    assert unknown.trouble is Trouble.WAITING


def test_a_robot_with_an_alert_comes_before_those_without_and_says_it():
    robots = robots_of(3, S.RUNNING)
    apply_event(robots.states["r03"], received(topics.BATTERY, m.BatteryState(percentage=0.15)), 0.0)
    first = fleet_rows(robots)[0]
    assert (first.name, first.trouble, first.alert, first.grave) == ("r03", Trouble.ALERT, "BATTERY 15 %", False)


def test_the_newest_warning_of_a_robot_is_shown_though_others_say_more():
    robots = robots_of(2, S.RUNNING)
    apply_event(robots.states["r02"], scenes.event(1.0, m.Event.WARN, "position float"), 0.0)
    apply_event(robots.states["r02"], scenes.event(2.0, m.Event.INFO, "position fixed"), 0.0)
    assert row(robots, "r02").alert == "position float"
    assert row(robots, "r01").alert == ""


def test_a_robot_of_another_origin_is_told_apart():
    robots = robots_of(3, S.RUNNING)
    for name, latitude_deg in (("r01", 50.0), ("r02", 50.0), ("r03", 51.0)):
        setup = Setup(scenario=Scenario(origin=Origin(latitude_deg=latitude_deg)))
        apply_event(robots.states[name], received(topics.SETUP, m.String(data=setup.model_dump_json())), 0.0)
    assert [each.name for each in fleet_rows(robots) if each.elsewhere] == ["r03"]
    robots.select("r03")
    assert [each.name for each in fleet_rows(robots) if each.elsewhere] == ["r01", "r02"]


def test_totals_count_every_robot_once_by_what_it_says_now():
    robots = robots_of(10, S.RUNNING, S.RUNNING, S.PAUSED, S.ABORTED, S.ESTOPPED)
    robots.states["r01"].now_s = 2 * LIVE_S
    apply_event(robots.states["r02"], NodeChanged(topics.ROBOT_SIM, False), 0.0)
    found = totals(robots.states)
    assert (found.robots, found.running, found.paused, found.stopped) == (10, 2, 2, 4)
    assert (found.silent, found.gone) == (1, 1)
    assert found.least_battery == (pytest.approx(0.81), "r10")


def test_a_robot_whose_process_ended_amid_its_job_is_trouble_until_it_has_another():
    robots = robots_of(2, S.RUNNING)
    state = robots.states["r02"]
    apply_event(state, NodeChanged(topics.ROBOT_SIM, False), 0.0)
    assert row(robots, "r02").alert == "gone amid its job"
    apply_event(state, NodeChanged(topics.ROBOT_SIM, True), 0.0)
    apply_event(state, received(topics.STATUS, m.TraversalStatus(state=S.IDLE), "robot-2"), 0.0)
    back = fleet_rows(robots)[0]
    assert (back.name, back.trouble) == ("r02", Trouble.HALTED)
    assert "lost" in back.alert
    apply_event(state, received(topics.STATUS, m.TraversalStatus(state=S.READY), "robot-2"), 0.0)
    assert row(robots, "r02").trouble is Trouble.NONE
