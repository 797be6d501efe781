"""Several robots in one loop: nothing that one does or suffers changes another, or keeps a stop from it."""

import math
import time
from collections import defaultdict
from contextlib import ExitStack

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import LONG_PLAN, PLAN, TEMPLATE, AtOnce, alone, ask, setup, turn_until
from tests.robot_sim.scripted import along_x
from touchline.bus import Bus, HealthReporter
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import CommandRequest, SetSpeedRequest, TraversalStatus
from touchline.services.robot_sim import robot_process
from touchline.services.robot_sim.robot_host import RobotHost
from touchline.services.robot_sim.robot_process import RobotProcess
from touchline.services.robot_sim.together import check_together

ROBOTS = {"r1": {"seed": 1}, "r2": {"seed": 2, "follower": "mpc"}, "club/r3": {"seed": 3}}

ENDLESS_PLAN = along_x(0, 1000, sprayed=[0], speed_mps=0.5)
"""A drive of half an hour, for a robot at full pace: it is still under way when all has been asked."""


class Rig:
    """Three robots in this process, and an operator for each."""

    def __init__(self, stack, config, speed):
        config = config.of(*ROBOTS)
        buses = stack.enter_context(Bus.open_all(topics.ROBOT_SIM, config))
        operators = stack.enter_context(Bus.open_all(topics.OPERATOR, config))
        self.operators = {bus.namespace: bus for bus in operators}
        self.host = RobotHost(
            [
                RobotProcess(bus, HealthReporter(bus), setup(**changes), AtOnce(bus), speed=speed, clock="held")
                for bus, changes in zip(buses, ROBOTS.values(), strict=True)
            ]
        )
        self.inboxes = {name: bus.inbox(topics.RECORDED) for name, bus in self.operators.items()}
        self.latest = {name: bus.inbox([topics.STATUS], keep="latest") for name, bus in self.operators.items()}
        self.states = {}
        for host, operator in zip(buses, operators, strict=True):
            caught_up(host, operator)

    def ask(self, name, service, **fields):
        response = ask(self.operators[name], self.host, service, **fields)
        assert response.success, response.message

    def start(self, name, plan=LONG_PLAN, template_json=""):
        self.ask(name, topics.LOAD, trajectory=plan, template_json=template_json)
        self.ask(name, topics.START)

    def turn_until(self, condition):
        turn_until(self.host, condition)

    def state(self, name):
        for _, message in self.latest[name].messages():
            self.states[name] = message.state
        return self.states.get(name)


@pytest.fixture
def rig(bus_config):
    with ExitStack() as stack:
        yield lambda speed: Rig(stack, bus_config, speed)


def test_each_robot_says_what_it_says_alone(rig):
    here = rig(-1.0)
    heard = defaultdict(list)

    def all_done():
        for name, inbox in here.inboxes.items():
            heard[name] += [(sample.topic, sample.payload) for sample in inbox.drain()]
        return all(any(topic is topics.REPORT for topic, _ in said) for said in heard.values())

    for name in ROBOTS:
        here.start(name, PLAN, TEMPLATE.model_dump_json())
    here.turn_until(all_done)
    for name, changes in ROBOTS.items():
        # The setup is told before the job, and the status of a robot that has none.
        said = [pair for pair in heard[name] if pair[0] is not topics.SETUP]
        expected = [pair for pair in alone(**changes) if pair[0] is not topics.SETUP]
        for topic in set(topics.RECORDED) - {topics.SETUP}:
            ours = [payload for which, payload in said if which is topic]
            theirs = [payload for which, payload in expected if which is topic]
            assert ours[-len(theirs) :] == theirs, (name, topic.name)


def test_stops_of_all_robots_are_looked_for_amid_the_ticks_of_one(rig, monkeypatch):
    """Each turn may take its slice; a stop waits for no more than a part of it."""
    monkeypatch.setattr(robot_process, "BESIDE_EVERY_S", 0.0)
    here = rig(-1.0)
    here.start("r1", ENDLESS_PLAN)
    here.start("club/r3")
    first = here.host._robots[0]
    question = here.operators["club/r3"].ask(topics.ESTOP, encode(CommandRequest(request_id="stop")), 100.0)
    deadline = time.monotonic() + 100.0
    while question.poll() is None:
        assert time.monotonic() < deadline, "nobody answers"
        first.step(0.05)  # a turn of r1 alone
    here.turn_until(lambda: here.state("club/r3") == TraversalStatus.ESTOPPED)
    assert here.state("r1") == TraversalStatus.RUNNING


def test_stops_are_looked_for_though_no_robot_has_its_turn(rig):
    here = rig(1.0)
    here.start("r2")
    here.host._due_s = [math.inf] * len(ROBOTS)
    here.ask("r2", topics.ESTOP)
    here.turn_until(lambda: here.state("r2") == TraversalStatus.ESTOPPED)


def test_a_flood_of_requests_to_one_robot_leaves_the_others_their_pace_and_their_stops(rig, monkeypatch):
    """By the time of this thread's processor: a busy machine may hold it up for longer than the watchdog waits."""
    longest_s = robot_process.WATCHDOG_S
    monkeypatch.setattr(robot_process, "WATCHDOG_S", math.inf)
    here = rig(1.0)
    for name in ROBOTS:
        here.start(name)
    flood = here.operators["r1"]
    slowest_s, begun = 0.0, time.monotonic()
    while time.monotonic() < begun + 0.5:
        for number in range(20):
            flood.ask(
                topics.SET_SPEED, encode(SetSpeedRequest(request_id=f"{time.monotonic()} {number}", factor=1.0)), 0.1
            )
            flood.ask(topics.ESTOP, b"junk", 0.1)
        turn = time.thread_time()
        here.host.turn()
        slowest_s = max(slowest_s, time.thread_time() - turn)
    assert slowest_s < longest_s
    assert {name: here.state(name) for name in ROBOTS} == dict.fromkeys(ROBOTS, TraversalStatus.RUNNING)
    asked = time.thread_time()
    here.ask("r2", topics.ESTOP)
    assert time.thread_time() - asked < 0.3


def test_no_garbage_is_collected_while_any_of_the_robots_drives(rig, monkeypatch):
    collected = []
    monkeypatch.setattr(robot_process, "give_back", lambda: collected.append(time.monotonic()))
    monkeypatch.setattr(robot_process, "TIDY_S", 0.0)
    here = rig(1.0)
    here.turn_until(lambda: collected)
    here.start("r2")
    collected.clear()
    for _ in range(50):
        here.host.turn()
    assert not collected
    here.ask("r2", topics.ABORT)
    here.turn_until(lambda: collected)


def test_what_cannot_be_of_robots_of_one_process_is_told(tmp_path):
    waits = setup(follower="external")
    check_together({"r1": waits})
    with pytest.raises(SpecError, match=r"robot r2: onboard.follower is 'external'.*--apart"):
        check_together({"r1": setup(), "r2": waits})
    check_together({"r1": setup()}, tmp_path / "journal")
    with pytest.raises(SpecError, match="--journal is one file for 2 robots"):
        check_together({"r1": setup(), "r2": setup()}, tmp_path / "journal")
