"""The robot's process with an external follower over a real bus: it can be stopped in the middle of a question."""

import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

from examples.external_follower import serve
from tests.meeting import caught_up
from tests.robot_sim.bus_rig import PLAN, alone, ask, hash_in, process, session, turn_until
from touchline.bus import Bus
from touchline.onboard.control import PurePursuitFollower
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.messages import SetSpeedResponse, TraversalStatus
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim import lockstep
from touchline.services.robot_sim.lockstep import NOW_FIELDS

PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
SOME_STEPS = 150


class Controller:
    """Pure pursuit, which may be held up: it then says so and answers when it is told to."""

    def __init__(self, held_at):
        self.inner, self.held_at = PurePursuitFollower(Vehicle()), held_at
        self.serving, self.held, self.release, self.stop = (threading.Event() for _ in range(4))

    def ended(self):
        self.serving.set()
        return self.stop.is_set()

    def steer(self, request):
        if request.step == self.held_at:
            self.held.set()
            self.release.wait()
        if request.first:
            self.inner.reset()
        now = np.array([getattr(request, name) for name in NOW_FIELDS])
        return self.inner.step(now, np.column_stack((request.ahead_speed_mps, request.ahead_yaw_rate_radps)))[:2]


@contextmanager
def controller(robot_bus, *, held_at=None):
    """A controller that the robot knows of, served as the example serves one."""
    one = Controller(held_at)
    with Bus.open("follower", robot_bus.config) as bus:
        thread = threading.Thread(target=serve, args=(bus, one.steer, one.ended))
        thread.start()
        try:
            assert one.serving.wait(60.0)
            caught_up(robot_bus, bus)
            yield one
        finally:
            one.stop.set()
            one.release.set()
            thread.join()


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Set how long an answer is waited for, s: at first longer than any machine takes for one."""

    def wait_for(timeout_s):
        monkeypatch.setattr(lockstep, "TIMEOUT_S", timeout_s)

    wait_for(60.0)
    return wait_for


def begin(robot, operator):
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN).success
    assert ask(operator, robot, topics.START).success


@pytest.mark.parametrize(
    ("service", "state"),
    [
        (topics.ESTOP, TraversalStatus.ESTOPPED),
        (topics.PAUSE, TraversalStatus.PAUSED),
    ],
    ids=["estop", "pause"],
)
def test_it_is_stopped_while_it_waits_for_an_answer(bus, operator, service, state):
    robot = process(bus, follower="external")
    emulator, answers = robot._emulator, []

    with controller(bus, held_at=SOME_STEPS) as follower:

        def stop_it():
            follower.held.wait()
            request = service.request(request_id="stop")
            answers.append(operator.call(service, request, timeout_s=30.0))  # less than an answer is waited for

        begin(robot, operator)
        stopper = threading.Thread(target=stop_it, daemon=True)
        stopper.start()
        while not follower.held.is_set():
            emulator.tick()
        assert emulator.onboard.state == TraversalStatus.RUNNING and emulator.onboard.estimate.speed_mps > 0.3
        turn_until(robot, lambda: answers)
        stopper.join()
        assert emulator.onboard.state == state
    (answer,) = answers
    assert answer.success, answer.message
    assert emulator.onboard.state == state
    assert not emulator.command.valve
    turn_until(robot, lambda: abs(emulator.onboard.estimate.speed_mps) < 0.01)
    assert emulator.onboard.status.follower_fallbacks > 0, "pure pursuit brakes, it is not asked again"


def test_one_that_dies_makes_the_robot_brake_and_pause(bus, operator, patience):
    robot = process(bus, follower="external")
    emulator = robot._emulator
    with controller(bus):
        begin(robot, operator)
        turn_until(robot, lambda: emulator.onboard.spraying)
    patience(0.5)
    turn_until(robot, lambda: emulator.onboard.state == PAUSED)
    assert "external follower does not answer" in emulator.onboard.status.reason
    assert not emulator.command.valve
    turn_until(robot, lambda: abs(emulator.onboard.estimate.speed_mps) < 0.01)
    assert emulator.onboard.status.follower_fallbacks > 10, "pure pursuit brakes"
    patience(60.0)
    with controller(bus):
        assert ask(operator, robot, topics.RESUME).success
        turn_until(robot, lambda: not robot.active)
    assert emulator.onboard.state == DONE


def test_whoever_does_not_want_to_stop_it_waits(bus, operator):
    """The answer is waited for all the same, and they are answered after it."""
    robot, answers, waited_in_vain = process(bus, follower="external"), [], []

    with controller(bus, held_at=SOME_STEPS) as follower:

        def ask_meanwhile():
            follower.held.wait()
            request = topics.SET_SPEED.request(request_id="pace", factor=-1.0)
            question = operator.ask(topics.SET_SPEED, encode(request), 30.0)
            end_s = time.monotonic() + 0.3
            while time.monotonic() < end_s:
                waited_in_vain.append(question.poll() is None)
            follower.release.set()
            while (answer := question.poll()) is None:
                time.sleep(0.001)
            answers.append(answer)

        begin(robot, operator)
        asking = threading.Thread(target=ask_meanwhile, daemon=True)
        asking.start()
        turn_until(robot, lambda: not robot.active and answers)
    assert waited_in_vain and all(waited_in_vain)
    assert decode(SetSpeedResponse, answers[0].payload).success
    assert robot._emulator.onboard.state == DONE
    assert robot._emulator.onboard.status.follower_fallbacks == 0


def test_the_same_controller_gives_the_same_session_at_any_pace(bus, operator):
    with controller(bus):
        heard = session(bus, process(bus, speed=20.0, seed=5, follower="external"), operator)
    reports = [(topics.REPORT, payload) for payload in heard[topics.REPORT.name]]
    assert hash_in(reports) == hash_in(alone(seed=5, follower="pure-pursuit"))
