"""Drive of a plan that stops wherever the robot's computer asks its follower, and goes on with the answer."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import Onboard
from touchline.onboard.control.follower import Asking, BodyTwist, FollowerInput
from touchline.onboard.interface import TICKS_PER_S, SensorFrame
from touchline.onboard.tracking_state import COMMAND
from touchline.onboard.trajectory.path_projection import AHEAD_COLUMNS
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.robot_sim.accounting.area_account import area_account
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner
from touchline.services.robot_sim.loaded_job import ledger_of

PATIENCE_TICKS: Final = 180 * TICKS_PER_S
"""Ticks without a question after which the robot is taken to wait for something that does not come."""
_MOST_TICKS: Final = 1000


class AskedFollower:
    """Place of a follower, whose questions the caller of `SteppedDrive` answers."""

    name = "asked"
    can_fail = False
    timed = False
    problem = ""
    fallbacks = 0

    def __init__(self, ahead_rows: int, fine_rows: int) -> None:
        """Ask for this many rows of the path ahead, the first of them a tick apart; see `Follower`."""
        self.ahead_rows, self.fine_rows = ahead_rows, fine_rows

    def reset(self) -> None:
        """Do nothing: it remembers nothing."""

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """Refuse to answer."""
        raise RuntimeError("the caller of the stepped drive answers")


class SteppedDrive:
    """Drive of a plan, one answer of the follower at a time.

    A session has the same bits as with a follower that gives the same answers.

    Attributes:
        emulator: The robot; another one after each `restart`.
        over: True once nothing more is asked.
        asked: Inputs for the follower, which has to answer; of the last question once the drive is over.
        stopped: Reason why it is over before the end of the plan, or empty.
    """

    def __init__(self, setup: Setup, trajectory: Trajectory, template: Template, rows: tuple[int, int]) -> None:
        """Begin a drive.

        Args:
            setup: The robot and its world.
            trajectory: The plan.
            template: Template to evaluate the work by.
            rows: Number of rows of the path ahead, and of those that are a tick apart; see `Follower`.

        Raises:
            CommandRefused: The robot does not take the plan.
        """
        self._setup, self._follower = setup, AskedFollower(*rows)
        self._trajectory, self._template = trajectory, template
        self._job = self._robot().prepare(trajectory, template)
        self.restart(setup.scenario.seed)

    def restart(self, seed: int) -> None:
        """Begin anew with a robot that has just been switched on.

        Args:
            seed: Seed of all noise, 0 or more.
        """
        scenario = self._setup.scenario.model_copy(update={"seed": seed})
        self._setup = self._setup.model_copy(update={"scenario": scenario})
        self.emulator = emulator = self._robot()
        template, vehicle = self._template, self._setup.vehicle
        ledger = ledger_of(self._job.ledger.targets, template, vehicle.tool)
        account = area_account(template, self._trajectory, vehicle)
        emulator.take(self._job._replace(ledger=ledger, account=account))
        emulator.start()
        self._runner = FastRunner(emulator)
        self._asked_tick, self.stopped = 0, ""
        self._asking, self.over = self._drive(), False
        self.asked = FollowerInput(np.zeros(COMMAND), np.zeros((self._follower.ahead_rows, AHEAD_COLUMNS)))
        self._go_on(None)

    def _robot(self) -> Emulator:
        vehicle, onboard, scenario = self._setup.vehicle, self._setup.onboard, self._setup.scenario
        return Emulator(vehicle, scenario, onboard, Onboard(vehicle, onboard, follower=self._follower))

    def answer(self, twist: BodyTwist) -> None:
        """Go on until the next question, with the answer to the present one, of a follower that is within limits."""
        self._go_on(twist)

    def answered(self) -> None:
        """Go on after the caller has run the kernel of the question, whose progress is not at ASKING any more."""
        self._go_on(None)

    def _go_on(self, twist: BodyTwist | None) -> None:
        try:
            self.asked = self._asking.send(twist)
            self._asked_tick = self.tick
        except StopIteration:
            self.over = True

    def _drive(self) -> Asking[None]:
        emulator = self.emulator
        while emulator.active and not self.stopped:
            yield from self._runner.asking_step(_MOST_TICKS, UNLOGGED)
            self.stopped = self._stopped()

    def _stopped(self) -> str:
        """Return the reason why the robot will not go on by itself, empty if it will."""
        if self.tick - self._asked_tick > PATIENCE_TICKS:
            return f"it has waited for {PATIENCE_TICKS // TICKS_PER_S} s: {self.emulator.onboard.status.reason}"
        if self.emulator.onboard.state == TraversalStatus.RUNNING:
            return ""
        status = self.emulator.onboard.status
        if status.state in (TraversalStatus.ABORTED, TraversalStatus.ESTOPPED):
            return status.reason
        return status.reason if status.pause is not None and not status.pause.ends_by_itself else ""

    @property
    def tick(self) -> int:
        """Present tick, also one in which the follower is asked."""
        return max(self.emulator.tick_count, self.emulator.onboard.estimator.times.tick)

    @property
    def frame(self) -> SensorFrame:
        """Sensor frame of the present tick."""
        return self._runner.frame(self.tick)
