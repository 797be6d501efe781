"""Stops come first: before other requests, whatever is being loaded, and whoever asks for what."""

import re
import time

import pytest

from tests.robot_sim.bus_rig import PLAN, TEMPLATE, ask, process, turn_until
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import CommandRequest, TraversalStatus
from touchline.services.robot_sim.command_handlers import REPLACING_BYTES
from touchline.services.robot_sim.guards import RESET_AFTER_S, WATCHDOG_S, LatchGuard, Watchdog


def load(request_id="load"):
    return encode(m.LoadRequest(request_id=request_id, trajectory=PLAN, template_json=TEMPLATE.model_dump_json()))


def answers(robot, *questions):
    """The questions' answers in the order in which they come."""
    found, waiting, deadline = [], list(questions), time.monotonic() + 100.0
    while waiting:
        assert time.monotonic() < deadline, "no answer"
        robot.turn()
        for pair in waiting[:]:
            if (answer := pair[1].poll()) is not None:
                found.append((pair[0], answer))
                waiting.remove(pair)
    return found


def test_a_stop_is_answered_before_a_load_that_came_first(bus, operator):
    robot = process(bus)
    ask(operator, robot, topics.PAUSE)  # they have met
    loads = [(f"load {i}", operator.ask(topics.LOAD, load(str(i)), 60.0)) for i in range(3)]
    stop = ("stop", operator.ask(topics.ESTOP, encode(CommandRequest(request_id="stop")), 60.0))
    time.sleep(0.2)  # all of them wait when the robot turns next
    found = dict(answers(robot, *loads, stop))
    assert decode(m.CommandResponse, found.pop("stop").payload).success
    refusals = [decode(m.LoadResponse, answer.payload).message for answer in found.values()]
    assert all("cannot load while emergency-stopped" in text for text in refusals), refusals


def test_a_load_too_large_to_replace_is_refused_unread_while_the_robot_drives(bus, operator):
    robot = process(bus, speed=0.0)
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json="").success
    assert ask(operator, robot, topics.START).success
    junk = b"\x00\x01\x00\x00" + bytes(REPLACING_BYTES)
    ((_, answer),) = answers(robot, ("junk", operator.ask(topics.LOAD, junk, 60.0)))
    response = decode(m.LoadResponse, answer.payload)
    assert not response.success
    assert "cannot load while running" in response.message


def test_more_loads_than_can_wait_are_told_to_come_back(bus, operator):
    robot = process(bus)
    ask(operator, robot, topics.PAUSE)
    found = answers(robot, *((str(i), operator.ask(topics.LOAD, load(str(i)), 60.0)) for i in range(8)))
    refusals = [answer.refusal for _, answer in found if answer.refusal]
    assert len(found) == 8
    assert all("try again" in refusal for refusal in refusals)


def test_a_loop_that_missed_its_turns_in_real_time_has_stopped_the_actuators(bus, operator):
    robot = process(bus, speed=1.0)
    status, pauses = (operator.inbox([topic], keep="latest") for topic in (topics.STATUS, topics.PAUSE_STATUS))
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json="").success
    assert ask(operator, robot, topics.START).success
    time.sleep(2.0 * WATCHDOG_S)
    latest, paused = [], []

    def has_paused():
        latest.extend(message for _, message in status.messages())
        paused.extend(message for _, message in pauses.messages())
        return paused and latest and latest[-1].state == TraversalStatus.PAUSED

    turn_until(robot, has_paused)
    assert re.fullmatch(r"the control loop did not turn for \d+\.\d\d s; resume to go on", latest[-1].reason)
    assert (paused[0].cause, paused[0].source) == (m.PauseStatus.WATCHDOG, "watchdog")
    assert not paused[0].ends_by_itself
    assert ask(operator, robot, topics.RESUME).success


def test_the_watchdog_counts_from_turn_to_turn():
    watchdog = Watchdog()
    assert [watchdog.missed_s(now_s) for now_s in (100.0, 100.01, 100.51)] == pytest.approx([0.0, 0.01, 0.5])


def test_a_reset_that_comes_late_does_not_undo_a_stop():
    now_s, done = 100.0, []
    guard = LatchGuard(lambda: now_s)
    stop, reset = guard.stop(lambda request: done.append("stop")), guard.reset(lambda request: done.append("reset"))
    reset(None)
    stop(None)
    now_s += 0.9 * RESET_AFTER_S
    assert "reset again" in reset(None).message
    now_s += RESET_AFTER_S
    reset(None)
    assert done == ["reset", "stop", "reset"]


def test_an_order_to_all_services_at_once_is_refused(bus, operator, bus_config):
    import zenoh

    robot = process(bus)
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json="").success
    with zenoh.open(bus_config.zenoh()) as stranger:
        said, deadline = [], time.monotonic() + 60.0
        while not said:
            assert time.monotonic() < deadline, "nobody answers"
            replies = stranger.get(
                bus.key("traversal/*"), zenoh.handlers.FifoChannel(64), payload=encode(CommandRequest(request_id="all"))
            )
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                robot.turn()
            said = [reply.err.payload.to_string() if reply.err else "accepted" for reply in replies]
    assert all("by its own key" in text for text in said)
    status = operator.inbox([topics.STATUS], keep="latest")
    turn_until(robot, lambda: any(message.state == TraversalStatus.READY for _, message in status.messages()))
