"""The robot's process with an external follower over a real bus: it can be stopped in the middle of a question."""

import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

from schemas import topics
from schemas.messages import FollowerStepResponse, TraversalStatus
from schemas.vehicle import Vehicle
from services.bus import Bus
from services.robot_sim import lockstep
from services.robot_sim.lockstep import NOW_FIELDS
from services.robot_sim.onboard.followers import PurePursuitFollower
from tests.robot_sim.bus_rig import PLAN, alone, ask, hash_in, process, session, turn_until

PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
SOME_STEPS = 150


@pytest.fixture
def robot_bus(bus_config):
    with Bus.open(topics.ROBOT_SIM, bus_config) as bus:
        yield bus


@pytest.fixture
def operator(bus_config, robot_bus):
    with Bus.open(topics.OPERATOR, bus_config) as operator:
        yield operator


@contextmanager
def controller(bus_config, *, silent_after=None, unanswered=None, late_at=None, late_s=0.0):
    """Pure pursuit in a session of its own; it may be late once, or fall silent and say so."""
    stop, inner = threading.Event(), PurePursuitFollower(Vehicle())

    def serve():
        with Bus.open("follower", bus_config) as bus:
            server, held = bus.serve(topics.FOLLOWER_STEP), []
            while not stop.is_set():
                call = server.wait(0.05)
                if call is None:
                    continue
                request = call.request
                if silent_after is not None and request.step > silent_after:
                    held.append(call)  # a query that is dropped would be answered by that
                    unanswered.set()
                    continue
                if request.step == late_at:
                    time.sleep(late_s)
                if request.first:
                    inner.reset()
                now = np.array([getattr(request, name) for name in NOW_FIELDS])
                ahead = np.column_stack((request.ahead_speed_mps, request.ahead_yaw_rate_radps))
                left, right = inner.step(now, ahead)
                call.reply(FollowerStepResponse(step=request.step, left_radps=left, right_radps=right))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield stop
    finally:
        stop.set()
        thread.join()


def begin(robot, operator):
    assert ask(operator, robot, topics.LOAD, trajectory=PLAN).success
    assert ask(operator, robot, topics.START).success


@pytest.mark.parametrize(
    ("service", "state"),
    [
        (topics.ESTOP, TraversalStatus.ESTOPPED),
        (topics.PAUSE, TraversalStatus.PAUSED),
        (topics.ABORT, TraversalStatus.ABORTED),
    ],
    ids=["estop", "pause", "abort"],
)
def test_it_is_stopped_while_it_waits_for_an_answer(bus_config, robot_bus, operator, monkeypatch, service, state):
    monkeypatch.setattr(lockstep, "TIMEOUT_S", 60.0)  # longer than the operator waits
    robot = process(robot_bus, follower="external")
    emulator, unanswered, answers = robot._emulator, threading.Event(), []

    def stop_it():
        unanswered.wait()
        request = service.request(request_id="stop")
        answers.append(operator.call(service, request, timeout_s=30.0))

    with controller(bus_config, silent_after=SOME_STEPS, unanswered=unanswered):
        begin(robot, operator)
        stopper = threading.Thread(target=stop_it)
        stopper.start()
        while not unanswered.is_set():
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


def test_one_that_dies_makes_the_robot_brake_and_pause(bus_config, robot_bus, operator, monkeypatch):
    monkeypatch.setattr(lockstep, "TIMEOUT_S", 0.5)
    robot = process(robot_bus, follower="external")
    with controller(bus_config) as leave:
        begin(robot, operator)
        turn_until(robot, lambda: robot._emulator.onboard.spraying)
        leave.set()
        turn_until(robot, lambda: robot._emulator.onboard.state == PAUSED)
    emulator = robot._emulator
    assert "external follower does not answer" in emulator.onboard.status.reason
    assert not emulator.command.valve
    turn_until(robot, lambda: abs(emulator.onboard.estimate.speed_mps) < 0.01)
    assert emulator.onboard.status.follower_fallbacks > 10, "pure pursuit brakes"
    with controller(bus_config):
        time.sleep(0.3)
        assert ask(operator, robot, topics.RESUME).success
        turn_until(robot, lambda: not robot.active)
    assert emulator.onboard.state == DONE


def test_one_that_is_late_is_not_believed(bus_config, robot_bus, operator, monkeypatch):
    monkeypatch.setattr(lockstep, "TIMEOUT_S", 0.5)
    robot = process(robot_bus, follower="external")
    with controller(bus_config, late_at=SOME_STEPS, late_s=1.0):
        begin(robot, operator)
        turn_until(robot, lambda: robot._emulator.onboard.state == PAUSED)
        assert "external follower does not answer" in robot._emulator.onboard.status.reason
        turn_until(robot, lambda: abs(robot._emulator.onboard.estimate.speed_mps) < 0.01)
        time.sleep(0.8)
        assert ask(operator, robot, topics.RESUME).success
        turn_until(robot, lambda: not robot.active)
    assert robot._emulator.onboard.state == DONE, robot._emulator.onboard.status


def test_whoever_does_not_want_to_stop_it_waits(bus_config, robot_bus, operator):
    """The answer is waited for all the same, and they are answered after it."""
    robot, answers = process(robot_bus, follower="external"), []

    def ask_and_ask():
        for number in range(12):
            request = topics.SET_SPEED.request(request_id=f"pace {number}", factor=-1.0)
            answers.append(operator.call(topics.SET_SPEED, request, timeout_s=30.0))
            time.sleep(0.05)

    with controller(bus_config, late_at=SOME_STEPS, late_s=0.6):
        begin(robot, operator)
        asking = threading.Thread(target=ask_and_ask)
        turn_until(robot, lambda: robot._emulator.tick_count > SOME_STEPS // 2)
        asking.start()
        turn_until(robot, lambda: not robot.active and len(answers) == 12)
        asking.join()
    assert all(answer.success for answer in answers)
    assert robot._emulator.onboard.state == DONE
    assert robot._emulator.onboard.status.follower_fallbacks == 0


def test_the_same_controller_gives_the_same_session_as_often_as_you_like(bus_config):
    hashes = []
    for speed in (-1.0, 20.0):
        with (
            Bus.open(topics.ROBOT_SIM, bus_config) as bus,
            Bus.open(topics.OPERATOR, bus_config) as operator,
            controller(bus_config),
        ):
            heard = session(process(bus, speed=speed, seed=5, follower="external"), operator)
        hashes.append(hash_in([(topics.REPORT, payload) for payload in heard[topics.REPORT.name]]))
    assert hashes == [hash_in(alone(seed=5, follower="pure-pursuit"))] * 2
