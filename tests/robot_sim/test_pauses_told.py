"""Pauses, warnings and what a standing robot knows, as messages: in one process and over the bus."""

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import LONG_PLAN, PLAN, TEMPLATE, alone, ask, drain, process, turn_until
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.faults import parse_fault
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.telemetry import Telemetry


def decoded(said, *wanted):
    return [decode(topic.type, payload) for topic, payload in said if topic in wanted]


def an_outage(duration_s=4.0):
    """A drive whose fix is lost on the line: all that is said until it drives on."""
    emulator = Emulator(Vehicle(), Scenario(noise="none"))
    telemetry = Telemetry(emulator)
    emulator.load(PLAN, TEMPLATE)
    said = telemetry.loaded(PLAN, TEMPLATE)
    emulator.inject_fault(parse_fault(f'{{"kind": "gnss-outage", "start_s": 1.0, "duration_s": {duration_s}}}'))
    emulator.start()
    said += telemetry.news()
    while emulator.active and emulator.time_s < 60.0:
        emulator.tick()
        said += telemetry.after_tick()
    return said


def test_a_pause_that_ends_by_itself_says_so_and_the_robot_warns_before_it_moves_off():
    said = an_outage()
    (began,) = [w for w in decoded(said, topics.ABOUT_TO_MOVE) if w.active and w.reason == "goes on by itself"]
    warned_s, moves_s = began.header.stamp.seconds, began.earliest.sec + began.earliest.nanosec / 1e9
    assert moves_s == pytest.approx(warned_s + 2.0)
    speeds = [(o.header.stamp.seconds, o.twist.twist.linear.x) for o in decoded(said, topics.TRUTH)]
    assert all(abs(speed) < 1e-3 for at_s, speed in speeds if warned_s - 1.0 <= at_s <= moves_s)
    assert any(speed < -0.05 for at_s, speed in speeds if at_s > moves_s), "it goes back to where paint is owed"
    statuses = [s.header.stamp for s in decoded(said, topics.STATUS) if s.state == m.TraversalStatus.PAUSED]
    pauses = decoded(said, topics.PAUSE_STATUS)
    assert [p.header.stamp for p in pauses[:-1]] == statuses, "one with every status, before it"
    assert {(p.cause, p.source, p.ends_by_itself) for p in pauses[:-1]} == {(5, "localization", True)}
    assert (pauses[-1].cause, pauses[-1].ends_by_itself) == (m.PauseStatus.NONE, False)
    assert all(p.earliest.sec + p.earliest.nanosec / 1e9 <= moves_s for p in pauses), "at the earliest"
    ends = decoded(said, topics.ABOUT_TO_MOVE)[-1]
    assert not ends.active, "the job is done"


def test_a_session_without_a_pause_says_nothing_of_pauses():
    said = alone()
    assert decoded(said, topics.PAUSE_STATUS) == []
    assert [w.active for w in decoded(said, topics.ABOUT_TO_MOVE)] == [True, False]


def test_the_watchdogs_pause_is_not_the_operators(bus, operator):
    robot = process(bus, speed=25.0)
    inbox = operator.inbox([topics.PAUSE_STATUS, topics.STATUS])
    caught_up(bus, operator)
    assert ask(operator, robot, topics.LOAD, trajectory=LONG_PLAN).success
    assert ask(operator, robot, topics.START).success
    turn_until(robot, lambda: robot._emulator.onboard.status.arc_length_m > 0.5)
    robot._commands.fail_safe(0.31)
    said = []
    turn_until(robot, lambda: decoded(drain(inbox, said), topics.PAUSE_STATUS))
    pause = decoded(said, topics.PAUSE_STATUS)[0]
    assert (pause.cause, pause.source, pause.ends_by_itself) == (m.PauseStatus.WATCHDOG, "watchdog", False)
    turn_until(robot, lambda: decoded(drain(inbox, said), topics.STATUS)[-1].state == m.TraversalStatus.PAUSED)
    assert decoded(said, topics.STATUS)[-1].reason == "the control loop did not turn for 0.31 s; resume to go on"
    assert ask(operator, robot, topics.RESUME).success


def test_switching_it_off_is_not_the_operators_pause(bus, operator):
    robot = process(bus, speed=25.0)
    inbox = operator.inbox([topics.PAUSE_STATUS])
    caught_up(bus, operator)
    assert ask(operator, robot, topics.LOAD, trajectory=LONG_PLAN).success
    assert ask(operator, robot, topics.START).success
    turn_until(robot, lambda: robot._emulator.onboard.status.arc_length_m > 0.5)
    robot.close()
    caught_up(bus, operator)
    assert {p.cause for p in decoded(drain(inbox, []), topics.PAUSE_STATUS)} == {m.PauseStatus.SHUT_DOWN}
