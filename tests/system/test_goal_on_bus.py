"""A drive to a goal as its client sees it: the robot on the bus is played by the test, at a given sim time."""

import threading

import pytest

from tests.system.test_shared_run import Silent
from touchline.bus import Bus, BusConfig, ServedCall
from touchline.jobs.goal.goal_on_bus import GoalOnBus
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics
from touchline.schemas.messages import (
    Event,
    GotoRequest,
    GotoResponse,
    PlanOptions,
    PoseGoal,
    TraversalReport,
    WayRound,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.standard import Header, Time

GOAL_TIME = Header(stamp=Time(sec=10))


def report(header: Header, total_time_s: float, *, success: bool = True) -> TraversalReport:
    return TraversalReport(header=header, success=success, total_time_s=total_time_s)


def at(time_s: int) -> Header:
    return Header(stamp=Time(sec=time_s))


def drive(config: BusConfig, told: list[tuple[topics.Topic, Message]]) -> dict[str, object]:
    """Answer to a client by a robot whose last drive ended where it stands now, and that tells this of the next."""
    with Bus.open(topics.ROBOT_SIM, config) as robot, Bus.open(topics.OPERATOR, config) as operator:
        publishers = {topic.name: robot.publisher(topic) for topic in (topics.EVENTS, topics.WAY_ROUND, topics.REPORT)}
        publishers[topics.REPORT.name].send(report(GOAL_TIME, 1.0))  # sim time rests since then
        server, over = robot.serve(topics.GOTO), threading.Event()

        def play() -> None:
            call: ServedCall[GotoRequest, GotoResponse] | None = None
            while call is None and not over.wait(0.005):
                call = server.poll()
            if call is not None:
                call.reply(GotoResponse(success=True, total_time=5.0))
                for topic, message in told:
                    publishers[topic.name].send(message)

        player = threading.Thread(target=play)
        player.start()
        try:
            goal = PoseGoal(x_m=3.0, y_m=1.0, heading_rad=0.0)
            return GoalOnBus(operator, goal, PlanOptions(), Silent()).run()
        finally:
            over.set()
            player.join()


def test_the_report_of_the_drive_before_is_not_taken_for_this_ones(bus_config: BusConfig) -> None:
    begun = Event(header=GOAL_TIME, code="goal")
    told = drive(bus_config, [(topics.EVENTS, begun), (topics.REPORT, report(Header(stamp=Time(sec=15)), 5.0))])
    assert told["arrival"]["time_s"] == {"planned": 5.0, "taken": 5.0}  # type: ignore[index]


def test_another_trajectory_that_takes_over_is_told(bus_config: BusConfig) -> None:
    begun, other = Event(header=GOAL_TIME, code="goal"), Event(header=GOAL_TIME, code="replaced")
    with pytest.raises(JobFailed, match="another trajectory has taken over"):
        drive(bus_config, [(topics.EVENTS, begun), (topics.EVENTS, other)])


def test_ways_round_are_followed_to_the_end_and_told_together(bus_config: BusConfig) -> None:
    """One drive ends before something, another one takes over under way; only the last report ends it."""
    hit = Event(header=at(18), code="contact", severity=Event.WARN)
    told: list[tuple[topics.Topic, Message]] = [
        (topics.EVENTS, Event(header=GOAL_TIME, code="goal")),
        (topics.WAY_ROUND, WayRound(header=GOAL_TIME, drives=1)),
        (topics.WAY_ROUND, WayRound(header=at(12), state=WayRound.PLANS, drives=1, continues=True)),
        (topics.REPORT, report(at(13), 2.0, success=False)),
        (topics.EVENTS, Event(header=at(15), code="ready")),
        (topics.WAY_ROUND, WayRound(header=at(15), drives=2)),
        (topics.WAY_ROUND, WayRound(header=at(17), state=WayRound.PLANS, drives=2, continues=True)),
        (topics.EVENTS, Event(header=at(17), code="replaced")),
        (topics.WAY_ROUND, WayRound(header=at(17), drives=3)),
        (topics.EVENTS, hit),
        (topics.EVENTS, Event(header=at(20), code="done")),
        (topics.REPORT, report(at(21), 3.0)),
    ]
    figures = drive(bus_config, told)
    assert figures["success"] and figures["drives"] == 3
    assert figures["arrival"]["time_s"] == {"planned": 5.0, "taken": 10.0}  # type: ignore[index]
    assert figures["contacts"] == {"while_moving": 0, "at_rest": 1}
