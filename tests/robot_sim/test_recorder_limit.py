"""Sim time that passes faster than real time waits for the recorder, and for nobody who is gone."""

import time
from collections.abc import Callable

import pytest

from tests.meeting import caught_up
from tests.robot_sim.bus_rig import LONG_PLAN, ask, process, turn_until
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.messages import Clock, Time
from touchline.services.robot_sim import recorder_limit
from touchline.services.robot_sim.robot_process import RobotProcess

LIMIT_S = 2.0


class Rig:
    """A robot that drives for 12 s, and a recorder that says how far it may."""

    def __init__(self, bus: Bus, operator: Bus, speed: float) -> None:
        self.robot: RobotProcess = process(bus, speed=speed, noise="none")
        self._clocks = operator.inbox([topics.CLOCK])
        self._limit = operator.publisher(topics.RECORDER_LIMIT)
        self.time_s = 0.0
        caught_up(bus, operator)
        assert ask(operator, self.robot, topics.LOAD, trajectory=LONG_PLAN).success
        self.say(LIMIT_S)
        caught_up(bus, operator)
        assert ask(operator, self.robot, topics.START).success

    def say(self, limit_s: float) -> None:
        self._limit.send(Clock(clock=Time.of_ns(round(1e9 * limit_s))))

    def turn_until(self, condition: Callable[[], bool], limit_s: float | None = LIMIT_S) -> None:
        def met() -> bool:
            if limit_s is not None:
                self.say(limit_s)
            for _, message in self._clocks.messages():
                assert isinstance(message, Clock)
                self.time_s = message.clock.seconds
            return condition()

        turn_until(self.robot, met)


def after(seconds: float) -> Callable[[], bool]:
    until_s = time.monotonic() + seconds
    return lambda: time.monotonic() > until_s


def test_a_robot_in_a_hurry_waits_for_the_recorder_and_goes_on_when_it_may(
    bus: Bus, operator: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_limit, "FRESH_S", 1e3)  # a busy machine is no recorder that is gone
    rig = Rig(bus, operator, speed=20.0)
    rig.turn_until(lambda: rig.time_s >= LIMIT_S)
    reached_s = rig.time_s
    rig.turn_until(after(0.5))
    assert rig.time_s <= reached_s + 0.4  # no more than was on its way
    reached_s = rig.time_s
    rig.turn_until(after(0.5))
    assert rig.time_s == reached_s
    rig.turn_until(lambda: rig.time_s > 10.0, limit_s=100.0)


def test_it_does_not_wait_for_a_recorder_that_is_gone(bus: Bus, operator: Bus) -> None:
    rig = Rig(bus, operator, speed=20.0)
    rig.turn_until(lambda: rig.time_s >= LIMIT_S)
    held_s = time.monotonic()
    rig.turn_until(lambda: rig.time_s > 10.0, limit_s=None)
    assert time.monotonic() - held_s > 0.9 * recorder_limit.FRESH_S


def test_a_robot_that_is_stopped_comes_to_rest_beyond_the_limit(bus: Bus, operator: Bus) -> None:
    rig = Rig(bus, operator, speed=20.0)
    rig.turn_until(lambda: rig.time_s >= LIMIT_S)
    assert ask(operator, rig.robot, topics.PAUSE).success
    rig.turn_until(lambda: not rig.robot._emulator.world.state.speed_mps)


def test_at_real_time_nothing_is_held(bus: Bus, operator: Bus) -> None:
    rig = Rig(bus, operator, speed=1.0)
    rig.turn_until(lambda: rig.time_s > LIMIT_S + 0.5)
