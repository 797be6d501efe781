"""Answers to an order to all: acknowledged, refused with a reason, none."""

import pytest

from tests.tui.console import reduced
from tests.tui.fleets import S, robot
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.tui.event_log import ERROR, INFO
from touchline.tui.fleet_orders import FLEET_ORDERS, census, concerned
from touchline.tui.node_health import LIVE_S
from touchline.tui.order_registry import OrderLine
from touchline.tui.protocol import NodeChanged
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots
from touchline.tui.roll_call import SHOWN_S, SILENT_S, Heard, roll_lines

NAMES = ("r1", "r2", "r3", "r4")


def four(state: int = S.RUNNING) -> Robots:
    robots = Robots()
    for number, name in enumerate(NAMES):
        reduced(robot(number, state).poll(), robots.add(name), now_s=0.0)
    return robots


def advance(robots: Robots, now_s: float) -> None:
    """Everybody is still heard."""
    for state in robots.states.values():
        apply_event(state, received(topics.CLOCK, m.Clock()), now_s)


def answer(robots: Robots, name: str, text: str, *, accepted: bool, answered: bool = True) -> None:
    word = OrderLine(INFO if accepted else ERROR, text)
    book, now_s = robots.states[name].orders, robots.states[name].now_s
    book.done("pause", word, accepted=accepted, answered=answered, now_s=now_s)


def test_everybody_is_waited_for_at_first_and_silent_after_a_second():
    robots = four()
    for state in robots.states.values():
        state.orders.place("pause", "Pause", 3, 0.0)
    robots.call_roll("pause", "Pause", NAMES)
    assert {each.heard for each in robots.answers().values()} == {Heard.WAITING}
    answer(robots, "r1", "Pause: done", accepted=True)
    apply_event(robots.states["r1"], received(topics.STATUS, m.TraversalStatus(state=S.PAUSED)), 0.1)
    answer(robots, "r2", "Pause refused: not running", accepted=False)
    advance(robots, SILENT_S + 0.1)
    heard = {name: each.heard for name, each in robots.answers().items()}
    assert heard == {"r1": Heard.ACKNOWLEDGED, "r2": Heard.REFUSED, "r3": Heard.SILENT, "r4": Heard.SILENT}
    answer(robots, "r4", "Pause not answered after 3 tries", accepted=False, answered=False)
    assert robots.answers()["r4"].heard is Heard.SILENT
    answer(robots, "r3", "Pause refused: not running", accepted=False)
    assert robots.roll is not None
    lines = [str(line) for line in roll_lines(robots.roll, robots.answers(), 80, 5)]
    assert "Pause to 4:" in lines[0]
    assert "1 ✓ acknowledged" in lines[0]
    assert "2 ✗ refused" in lines[0]
    assert "r4" in lines[1], "the silent come first"
    assert lines[2].endswith("not running: r2, r3"), "one reason, one line"


def test_a_robot_that_acknowledges_a_pause_and_runs_on_has_not_heard():
    robots = four()
    robots.states["r1"].orders.place("pause", "Pause", 3, 0.0)
    robots.call_roll("pause", "Pause", ["r1"])
    answer(robots, "r1", "Pause: done", accepted=True)
    assert robots.answers()["r1"].heard is Heard.ACKNOWLEDGED
    advance(robots, 1.0)
    assert robots.answers()["r1"].heard is Heard.REFUSED


def test_only_its_status_acknowledges_an_emergency_stop():
    robots = four()
    for state in robots.states.values():
        state.orders.stop.press("id", "robot-1")
    robots.call_roll("estop", "Emergency stop", NAMES)
    robots.states["r1"].orders.stop.answered("id", "done", 0.0)
    apply_event(robots.states["r2"], received(topics.STATUS, m.TraversalStatus(state=S.ESTOPPED)), 0.1)
    apply_event(robots.states["r3"], NodeChanged(topics.ROBOT_SIM, False), 0.1)
    for name in ("r1", "r2", "r4"):
        apply_event(robots.states[name], received(topics.CLOCK, m.Clock()), SILENT_S + 0.1)
    robots.states["r3"].now_s = SILENT_S + 0.1
    found = robots.answers()
    assert found["r1"].heard is Heard.REFUSED
    assert "RUNNING" in found["r1"].reason
    assert found["r2"].heard is Heard.ACKNOWLEDGED
    assert (found["r3"].heard, found["r3"].reason) == (Heard.SILENT, "not on the bus")
    assert found["r4"].heard is Heard.SILENT


def test_a_roll_call_of_which_all_is_well_ends_by_itself():
    robots = four(S.PAUSED)
    robots.call_roll("pause", "Pause", NAMES)
    advance(robots, SHOWN_S - 0.1)
    assert {each.heard for each in robots.answers().values()} == {Heard.ACKNOWLEDGED}, "they pause already"
    advance(robots, SHOWN_S + 0.1)
    assert robots.answers() == {}


def test_more_reasons_than_lines_name_every_robot_that_has_not_acknowledged():
    robots = four()
    for name in NAMES:
        robots.states[name].orders.place("pause", "Pause", 3, 0.0)
        answer(robots, name, f"Pause refused: {name} is busy", accepted=False)
    robots.call_roll("pause", "Pause", NAMES)
    assert robots.roll is not None
    lines = [str(line) for line in roll_lines(robots.roll, robots.answers(), 80, 3)]
    assert len(lines) == 3
    assert all(name in "\n".join(lines[1:]) for name in NAMES)
    (alone,) = roll_lines(robots.roll, robots.answers(), 80, 1)
    assert "4 ✗ refused" in str(alone)


@pytest.mark.parametrize(
    ("order", "state", "silent_too"),
    [("pause", S.RUNNING, True), ("abort", S.PAUSED, True), ("resume", S.PAUSED, False), ("reset", S.ESTOPPED, False)],
)
def test_what_stops_goes_to_the_silent_and_what_sets_in_motion_does_not(order: str, state: int, silent_too: bool):
    robots = four(state)
    (known,) = (each for each in FLEET_ORDERS if each.name == order)
    assert concerned(known, robots.states) == NAMES
    robots.states["r2"].now_s = 2 * LIVE_S
    apply_event(robots.states["r3"], NodeChanged(topics.ROBOT_SIM, False), 0.0)
    assert concerned(known, robots.states) == (("r1", "r2", "r4") if silent_too else ("r1", "r4"))
    assert census(robots.states).count("silent") == 1


def test_a_reset_of_all_leaves_out_those_with_a_stop_under_way():
    robots = four(S.ESTOPPED)
    robots.states["r2"].orders.stop.press("id", "")
    (reset,) = (each for each in FLEET_ORDERS if each.name == "reset")
    assert concerned(reset, robots.states) == ("r1", "r3", "r4")


def test_a_robot_that_does_not_drive_need_not_take_a_pause():
    robots = four(S.DONE)
    apply_event(robots.states["r2"], received(topics.STATUS, m.TraversalStatus(state=S.RUNNING)), 0.0)
    for name in ("r1", "r2"):
        robots.states[name].orders.place("pause", "Pause", 3, 0.0)
        answer(robots, name, "Pause refused: cannot pause while done", accepted=False)
    robots.call_roll("pause", "Pause", ["r1", "r2"])
    assert [each.heard for each in robots.answers().values()] == [Heard.AT_REST, Heard.REFUSED]
