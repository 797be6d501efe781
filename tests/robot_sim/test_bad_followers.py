"""Followers that fail: nothing unusable reaches the wheels, the robot brakes, and the pause names who failed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.robot_sim.scripted import along_x
from touchline.onboard.control import MpcFollower, PurePursuitFollower
from touchline.onboard.control.follower import BodyTwist
from touchline.schemas.messages import PauseStatus, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plugins import FOLLOWERS, VERBOSE
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

PLAN = along_x(0, 2, 8, 9, sprayed=[0, 1, 0], speed_mps=0.8)
NAME = "failing"
GOOD_TICKS = 300


class Failing(PurePursuitFollower):
    """Pursuit that fails after a while."""

    name = NAME
    answer: Callable[[], Any]

    def __init__(self, vehicle: Vehicle) -> None:
        super().__init__(vehicle)
        self.asked = 0

    def step(self, now: Any, ahead: Any) -> BodyTwist:
        self.asked += 1
        usual = super().step(now, ahead)
        return usual if self.asked <= GOOD_TICKS else type(self).answer()


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    FOLLOWERS.register(NAME, "fails after a while", lambda vehicle, _ask: Failing(vehicle))
    FOLLOWERS._packages[NAME] = "failing-turns 0.1"
    yield
    FOLLOWERS.forget(NAME)
    del FOLLOWERS._packages[NAME]


def driven(follower: str) -> tuple[Emulator, np.ndarray]:
    """A robot after more than its path takes, and (n, 2) the wheel commands of all ticks [rad/s]."""
    emulator = Emulator(Vehicle(), Scenario(), OnboardConfig(follower=follower))
    emulator.load(PLAN)
    emulator.start()
    commands = []
    runner = FastRunner(emulator)
    for _ in range(1500):
        runner.run(1)
        commands.append(emulator.command.actuators)
    return emulator, np.array(commands)


def raising() -> Any:
    raise ZeroDivisionError("no such gain")


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda: BodyTwist(math.nan, 0.0), "gave a twist that is not finite"),
        (lambda: BodyTwist(0.5, 0.0, (math.nan, 1.0)), "gave an actuator command of nan"),
        (lambda: BodyTwist(0.5, 0.0, (21.0, 1.0)), "gave an actuator command of 21.0; the drive's limit is 20"),
        (lambda: BodyTwist(0.5, 0.0, (1.0,)), "gave 1 actuator commands; the drive takes 2"),
        (lambda: None, "fails with TypeError"),
        (raising, "fails with ZeroDivisionError: no such gain"),
    ],
)
def test_the_robot_brakes_and_names_the_plug_in(
    monkeypatch: pytest.MonkeyPatch, answer: Callable[[], Any], words: str
) -> None:
    monkeypatch.setattr(Failing, "answer", staticmethod(answer), raising=False)
    emulator, commands = driven(NAME)
    status = emulator.onboard.status
    assert status.state == TraversalStatus.PAUSED
    assert status.reason.startswith(f'the follower "{NAME}" of the package failing-turns 0.1 {words}')
    assert np.isfinite(commands).all()
    assert np.abs(commands).max() <= Vehicle().drive.max_wheel_speed_radps
    assert not np.abs(commands[-100:]).any()
    assert abs(emulator.world.state.speed_mps) < 0.001
    assert not emulator.command.valve
    assert emulator.onboard.status.pause.cause == PauseStatus.FOLLOWER


def test_a_shipped_one_is_guarded_in_compiled_ticks_too(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, asked = MpcFollower.step, []

    def step(self: MpcFollower, now: Any, ahead: Any) -> BodyTwist:
        asked.append(None)
        return usual(self, now, ahead) if len(asked) < GOOD_TICKS else BodyTwist(math.nan, 0.0)

    monkeypatch.setattr(MpcFollower, "step", step)
    emulator = Emulator(Vehicle(), Scenario(), OnboardConfig(follower="mpc"))
    emulator.load(PLAN)
    emulator.start()
    FastRunner(emulator).run(1500)
    assert len(asked) == GOOD_TICKS
    assert emulator.onboard.status.state == TraversalStatus.PAUSED
    assert emulator.onboard.status.reason.startswith('the follower "mpc" gave a twist that is not finite')
    assert np.isfinite(emulator.world.pose).all()
    assert abs(emulator.world.state.speed_mps) < 0.001


@pytest.mark.parametrize("wanted", [True, False])
def test_a_traceback_is_shown_on_request(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, wanted: bool
) -> None:
    monkeypatch.setenv(VERBOSE, "1" if wanted else "")
    monkeypatch.setattr(Failing, "answer", staticmethod(raising), raising=False)
    driven(NAME)
    assert ("Traceback" in caplog.text) == wanted
