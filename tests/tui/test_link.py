"""The console's link over real Zenoh: who is there, what they say, calls, and the paint that must not be lost."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest

from tests.meeting import caught_up
from tests.tui import scenes
from touchline.bus import Bus, BusConfig
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.tui.link import BusLink, open_links
from touchline.tui.protocol import CallFailed, Incoming, NodeChanged, PaintFetched, Received, Rejected
from touchline.tui.reduction import apply_event
from touchline.tui.state import ConsoleState


@contextmanager
def open_link(config: BusConfig, node: str) -> Iterator[BusLink]:
    """The link to the one robot."""
    with open_links(config, node) as links:
        ((_, link),) = links.found()
        link.attend(closely=True)
        yield link


@pytest.fixture
def link(bus_config: BusConfig) -> Iterator[BusLink]:
    with open_link(bus_config, topics.CONSOLE) as link:
        yield link


class Robot:
    """A robot that says what it is told to and answers some services from a thread."""

    def __init__(self, config: BusConfig) -> None:
        self._stack = ExitStack()
        self.bus = self._stack.enter_context(Bus.open(topics.ROBOT_SIM, config))
        telemetry = self._stack.enter_context(Bus.open(topics.TELEMETRY, config))
        self.strokes: tuple[m.PaintMarks, ...] = ()
        self.tells, self._stop = threading.Event(), threading.Event()
        self.tells.set()
        self._paint, self._start = telemetry.serve(topics.GET_PAINT), self.bus.serve(topics.START)
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()
        self._publishers = {topic: self.bus.publisher(topic) for topic in (topics.STATUS, topics.PAINT, topics.EVENTS)}

    def _serve(self) -> None:
        while not self._stop.wait(0.005):
            while self.tells.is_set() and (call := self._paint.poll()) is not None:
                call.reply(m.GetPaintResponse(strokes=self.strokes))
            while (call := self._start.poll()) is not None:
                call.reply(m.CommandResponse(success=False, message="no plan"))

    def say(self, topic: topics.Topic, message: m.Message) -> None:
        self._publishers[topic].send(message)

    def leave(self) -> None:
        self._stop.set()
        self._thread.join()
        self._stack.close()


@pytest.fixture
def robot(bus_config: BusConfig) -> Iterator[Robot]:
    robot = Robot(bus_config)
    yield robot
    robot.leave()


def collect(link: BusLink, condition: Callable[[list[Incoming]], bool], timeout_s: float = 60.0) -> list[Incoming]:
    events: list[Incoming] = []
    deadline = time.monotonic() + timeout_s
    while not condition(events):
        assert time.monotonic() < deadline, f"only {events}"
        events += link.poll()
        time.sleep(0.01)
    return events


def messages(events: list[Incoming], topic: topics.Topic) -> list[Any]:
    return [event.message for event in events if isinstance(event, Received) and event.topic == topic.name]


def connected(link: BusLink, robot: Robot) -> None:
    """Wait until each end knows what the other has."""
    collect(link, lambda events: NodeChanged(topics.ROBOT_SIM, True) in events)
    caught_up(robot.bus, link._bus)
    caught_up(link._bus, robot.bus)


def test_a_robot_that_was_there_before_tells_its_last_state(bus_config: BusConfig) -> None:
    robot = Robot(bus_config)
    try:
        robot.say(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.READY))
        with open_link(bus_config, topics.CONSOLE) as link:
            came = NodeChanged(topics.ROBOT_SIM, True)
            events = collect(
                link, lambda events: came in events and any(isinstance(event, Received) for event in events)
            )
    finally:
        robot.leave()
    said = next(event for event in events if isinstance(event, Received))
    assert said.topic == topics.STATUS.name
    assert said.message == m.TraversalStatus(state=m.TraversalStatus.READY)
    assert said.publisher


def test_a_robot_that_leaves_and_comes_back(link: BusLink, bus_config: BusConfig) -> None:
    state = ConsoleState()

    def until(condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 60.0
        while not condition():
            assert time.monotonic() < deadline
            for event in link.poll():
                apply_event(state, event, time.monotonic())
            time.sleep(0.01)

    first = Robot(bus_config)
    first.say(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.RUNNING))
    until(lambda: state.traversal == m.TraversalStatus.RUNNING)
    first.leave()
    until(lambda: not state.robot_alive)
    assert state.traversal is None
    second = Robot(bus_config)
    try:
        second.say(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.IDLE))
        until(lambda: state.traversal == m.TraversalStatus.IDLE)
    finally:
        second.leave()
    assert any("robot restarted" in entry.text for entry in state.log.entries)


def test_every_paint_mark_arrives_and_states_are_thinned(link: BusLink, robot: Robot) -> None:
    connected(link, robot)
    for number in range(500):
        robot.say(topics.PAINT, m.PaintMarks(first_index=number, x_m=[number, number + 1], y_m=[0, 0]))
        robot.say(topics.STATUS, m.TraversalStatus(arc_length_m=number))
    caught_up(link._bus, robot.bus)
    events = link.poll()
    assert [marks.first_index for marks in messages(events, topics.PAINT)] == list(range(500))
    assert messages(events, topics.STATUS) == [m.TraversalStatus(arc_length_m=499)]


def test_calls_are_answered_or_fail_with_a_reason(link: BusLink, robot: Robot) -> None:
    connected(link, robot)
    answer = link.call(topics.START, m.CommandRequest(request_id="1"), 3.0)
    assert answer == m.CommandResponse(success=False, message="no plan")
    with pytest.raises(CallFailed, match="nobody answers"):
        link.call(topics.PLAN_SERVICE, m.PlanRequest(request_id="2"), 5.0)


def test_a_request_that_nobody_waits_for_arrives_at_once(link: BusLink, robot: Robot) -> None:
    served = robot.bus.serve(topics.ESTOP)
    caught_up(link._bus, robot.bus)
    link.post(topics.ESTOP, m.CommandRequest(request_id="1"))
    call = served.wait(60.0)
    assert call is not None
    assert call.request_id == "1"


def test_leaving_while_a_call_is_under_way_fails_it_and_telling_later_is_no_error(bus_config: BusConfig) -> None:
    outcomes: list[object] = []

    def ask(link: BusLink) -> None:
        try:
            outcomes.append(link.call(topics.PLAN_SERVICE, m.PlanRequest(request_id="1"), 5.0))
        except CallFailed as failure:
            outcomes.append(failure)

    with open_link(bus_config, topics.CONSOLE) as link:
        thread = threading.Thread(target=ask, args=(link,))
        thread.start()
        time.sleep(0.2)
    thread.join(60.0)
    assert [type(outcome) for outcome in outcomes] == [CallFailed]
    link.post(topics.ESTOP, m.CommandRequest(request_id="1"))


def test_paint_is_fetched_off_the_caller_s_thread_and_none_if_nobody_tells(
    link: BusLink, bus_config: BusConfig
) -> None:
    def fetched(events: list[Incoming]) -> bool:
        return any(isinstance(event, PaintFetched) for event in events)

    link.fetch_paint()
    assert PaintFetched(None) in collect(link, fetched)
    robot = Robot(bus_config)
    try:
        robot.strokes = tuple(scenes.strokes(scenes.pitch(), 3))
        connected(link, robot)
        robot.tells.clear()
        for _ in range(5):
            link.fetch_paint()
        assert [thread.name for thread in threading.enumerate()].count("fetch-paint") == 1, "it waits elsewhere"
        robot.tells.set()
        assert PaintFetched(robot.strokes) in collect(link, fetched)
    finally:
        robot.leave()


def test_bytes_that_are_no_message_are_reported(link: BusLink, robot: Robot) -> None:
    connected(link, robot)
    publisher = robot.bus.publisher(topics.EVENTS)
    for payload in (b"", b"\x00\x01\x00\x00\xff", b"rubbish" * 1000):
        publisher.send_bytes(payload)
    events = collect(link, lambda events: sum(isinstance(event, Rejected) for event in events) == 3)
    rejected = [event for event in events if isinstance(event, Rejected)]
    assert {event.topic for event in rejected} == {topics.EVENTS.name}
    assert all(event.reason for event in rejected)


def test_of_a_robot_among_others_no_paint_is_sent_until_it_is_attended_closely(bus_config: BusConfig) -> None:
    with open_links(bus_config, topics.CONSOLE) as links:
        ((_, link),) = links.found()
        robot = Robot(bus_config)
        try:
            connected(link, robot)
            robot.say(topics.PAINT, m.PaintMarks(first_index=0))
            robot.say(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.RUNNING))
            events = collect(link, lambda events: bool(messages(events, topics.STATUS)))
            caught_up(robot.bus, link._bus)
            assert not messages(events + link.poll(), topics.PAINT)
            link.attend(closely=True)
            caught_up(robot.bus, link._bus)
            robot.say(topics.PAINT, m.PaintMarks(first_index=7))
            (marks,) = messages(collect(link, lambda events: bool(messages(events, topics.PAINT))), topics.PAINT)
            assert marks.first_index == 7
            link.attend(closely=False)
            robot.say(topics.PAINT, m.PaintMarks(first_index=9))
            robot.say(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.DONE))
            events = collect(link, lambda events: bool(messages(events, topics.STATUS)))
            assert not messages(events, topics.PAINT)
        finally:
            robot.leave()
