"""The robot on a real bus."""

import math
import time
from itertools import pairwise

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import LONG_PLAN, PLAN, TEMPLATE, ask, process, session, turn_until
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import Event, GetPaintResponse, PauseStatus, Trajectory, TraversalStatus
from touchline.schemas.paint_history import PaintHistory
from touchline.schemas.scenario import Origin
from touchline.services.robot_sim.guards import LinkWatch


def test_a_template_of_another_place_is_refused(bus, operator):
    robot = process(bus, origin=Origin(latitude_deg=57.0, longitude_deg=10.0, altitude_m=0.0))
    here = TEMPLATE.model_copy(update={"origin": Origin(latitude_deg=57.0, longitude_deg=10.0)})
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json=here.to_json()).success
    there = TEMPLATE.model_copy(update={"origin": Origin(latitude_deg=57.0001, longitude_deg=10.0)})
    answer = ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json=there.to_json())
    assert not answer.success
    assert "--map-origin 57.0,10.0,0.0" in answer.message


def test_a_session_over_the_bus_and_its_paint(bus, operator):
    robot = process(bus)
    said = session(bus, robot, operator)
    special = {topic.name for topic in topics.TOPICS if not topic.general}
    assert {name for name, payloads in said.items() if not payloads} <= special
    history = PaintHistory()
    for payload in said[topics.PAINT.name]:
        history.add(payload)
    (stroke,) = decode(GetPaintResponse, history.answer()).strokes
    assert stroke.segment_id == "line"
    length = sum(math.dist(a, b) for a, b in pairwise(_points(stroke)))
    assert length == pytest.approx(0.6, abs=0.05)
    assert operator.counters.lost == 0


def _points(stroke):
    return list(zip(stroke.x_m, stroke.y_m, strict=True))


def test_every_command_is_answered_with_a_reason(bus, operator):
    robot = process(bus)
    for service in (topics.START, topics.PAUSE, topics.RESUME, topics.ABORT):
        answer = ask(operator, robot, service)
        assert not answer.success
        assert "cannot" in answer.message
    assert ask(operator, robot, topics.ESTOP).success
    turn_until(robot, lambda: ask(operator, robot, topics.RESET).success)  # not at once after the stop
    answer = ask(operator, robot, topics.LOAD, trajectory=Trajectory())
    assert not answer.success
    assert "no segment" in answer.message
    answer = ask(operator, robot, topics.LOAD, trajectory=PLAN, template_json='{"name": "x"}')
    assert not answer.success
    assert "segments" in answer.message
    assert not ask(operator, robot, topics.SET_SPEED, factor=float("nan")).success
    assert not ask(operator, robot, topics.SET_SPEED, factor=1e9).success
    assert ask(operator, robot, topics.SET_SPEED, factor=0.0).success


def test_without_operator_and_planner_the_robot_stops_by_itself_with_its_valve_closed(bus, bus_config):
    # Faster than real time: at that the watchdog would pause it while the test waits for others instead of turning it.
    robot = process(bus, speed=1.1, link_timeout_s=0.3)
    with Bus.open("recorder-of-this-test", bus_config) as listener:
        inbox = listener.inbox([topics.EVENTS, topics.STATUS, topics.SPRAYER, topics.TRUTH])
        caught_up(bus, listener)
        said = []

        def link_lost():
            said.extend(inbox.drain())
            return any(sample.topic is topics.EVENTS and sample.decode().code == "link-lost" for sample in said)

        with Bus.open(topics.OPERATOR, bus_config) as operator:
            ask(operator, robot, topics.START_TRAVERSAL, trajectory=LONG_PLAN)
            begun = time.monotonic()
            turn_until(robot, lambda: time.monotonic() > begun + 0.6)
            caught_up(listener, bus)
            assert not link_lost(), "the operator is there"
        turn_until(robot, link_lost)
        turn_until(robot, lambda: link_lost() and any(_paused(sample) for sample in said))
        turn_until(robot, lambda: link_lost() and abs(_last(said, topics.TRUTH).twist.twist.linear.x) < 0.05)
    assert not _last(said, topics.SPRAYER).valve_open
    assert any(s.topic is topics.EVENTS and s.decode().severity == Event.ERROR for s in said)


class Nodes:
    """A bus with these nodes."""

    linked = True

    def __init__(self, *alive):
        self.now = set(alive)

    def presence(self):
        return self

    def poll(self):
        pass

    def alive(self):
        return self.now


def test_the_link_is_lost_when_the_time_is_over_that_counts_from_the_start_of_driving():
    nodes = Nodes(topics.BRIDGE)
    watch = LinkWatch(nodes, 2.0)
    assert not any(watch.lost(False, now_s) for now_s in (0.0, 5.0, 9.9))
    assert [watch.lost(True, now_s) for now_s in (10.0, 11.8, 12.0)] == [False, False, True]
    for guardian in (topics.CONSOLE, topics.OPERATOR, topics.PLANNER):
        nodes.now.add(guardian)
        assert not watch.lost(True, 20.0)
        nodes.now.discard(guardian)
        assert [watch.lost(True, now_s) for now_s in (21.9, 22.1)] == [False, True]
    nodes.now.add(topics.OPERATOR)
    assert not watch.lost(True, 30.0)
    nodes.linked = False
    assert [watch.lost(True, now_s) for now_s in (31.9, 32.1)] == [False, True]


def _last(said, topic):
    found = [sample for sample in said if sample.topic is topic]
    return found[-1].decode() if found else None


def _paused(sample):
    return sample.topic is topics.STATUS and sample.decode().state == TraversalStatus.PAUSED


def test_ending_the_process_closes_the_valve_and_brakes(bus, operator):
    robot = process(bus, speed=1.1)  # faster than real time, as above
    inbox = operator.inbox([topics.SPRAYER, topics.TRUTH, topics.PAUSE_STATUS])
    caught_up(bus, operator)
    assert ask(operator, robot, topics.START_TRAVERSAL, trajectory=PLAN).total_time == pytest.approx(4.5, abs=1.0)
    assert not ask(operator, robot, topics.START_TRAVERSAL, trajectory=PLAN).success
    said = []

    def last(topic):
        said.extend(inbox.drain())
        return _last(said, topic)

    turn_until(robot, lambda: (state := last(topics.SPRAYER)) is not None and state.valve_open)
    robot.close()
    caught_up(operator, bus)
    assert not last(topics.SPRAYER).valve_open
    assert last(topics.TRUTH).twist.twist.linear.x == pytest.approx(0.0, abs=1e-3)
    causes = {sample.decode().cause for sample in said if sample.topic is topics.PAUSE_STATUS}
    assert causes == {PauseStatus.SHUT_DOWN}, "it is not the operator's pause"
