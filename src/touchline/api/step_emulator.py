"""Step interface: `Emulator`, a robot that stops wherever its computer asks for a command."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from touchline.api.function_follower import AHEAD_TICKS, FollowerAhead, FollowerState, follower_ahead, follower_state
from touchline.api.given_arguments import checked, setup_of
from touchline.api.planned import Plan
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.interface import TICKS_PER_S, SensorFrame
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import TraversalReport
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.services.robot_sim.stepped_drive import SteppedDrive
from touchline.services.robot_sim.telemetry import Telemetry


class Motion(NamedTuple):
    """Pose and motion of the robot's origin, map frame: x east, y north, heading counter-clockwise from east.

    Attributes:
        x_m: Its place.
        y_m: Its place.
        heading_rad: Its heading.
        speed_mps: Forward speed.
        yaw_rate_radps: Yaw rate, counter-clockwise.
    """

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    yaw_rate_radps: float


class Emulator:
    """Emulated robot on a plan, whose path follower is the caller: one command a step.

    The rest of the robot works as in `touchline.simulate`: sensors, estimator, executive and monitors. A caller that
    gives the commands of a follower gets the bits of `touchline.simulate` with that follower.

    A command answers one question of the robot's computer. It asks once a tick (10 ms) while it is to move, and once
    more in the tick in which a leg of the path ends; it does not ask while the robot stands and waits, which then
    passes within the step.
    """

    def __init__(
        self,
        plan: Plan,
        /,
        *,
        scenario: Scenario | None = None,
        seed: int | None = None,
        onboard: OnboardConfig | None = None,
    ) -> None:
        """Put a robot at the start of a plan, up to the first question.

        Args:
            plan: The plan.
            scenario: World of the robot, as for `simulate`.
            seed: Seed of all noise; None: the scenario's.
            onboard: Configuration of the robot's computer; None: the one that is shipped with the vehicle.

        Raises:
            SpecError: An argument cannot be used.
            CommandRefused: The robot does not take the plan.
        """
        self._plan = plan
        setup = setup_of(plan.vehicle, scenario, onboard, seed, None).at(plan.template.origin)
        self._drive = SteppedDrive(setup, plan.trajectory, plan.template, (AHEAD_TICKS, AHEAD_TICKS))

    def reset(self, *, seed: int | None = None) -> SensorFrame:
        """Begin anew with a robot that has just been switched on; return its sensor frame at the first question.

        Args:
            seed: Seed of all noise; None: as before.

        Raises:
            SpecError: It is not a whole number from 0 on.
        """
        self._drive.restart(self.seed if seed is None else checked(Scenario, {"seed": seed}, "Emulator.reset").seed)
        return self.frame

    def step(self, command: Sequence[float], /, *, actuators: bool = False, ticks: int = 1) -> SensorFrame:
        """Answer with a command, and go on to the next question; return the sensor frame then.

        Args:
            command: Wanted speed (m/s, negative backward) and yaw rate (rad/s, counter-clockwise).
            actuators: True if `command` holds the commands of the drive's actuators instead, in the order and units of
                `vehicle.drive.actuators`.
            ticks: Number of questions that it answers.

        Raises:
            SpecError: The command cannot be used, or the drive is over.
        """
        answer = self._of_actuators(command) if actuators else _of_twist(command)
        if ticks < 1:
            raise SpecError("Emulator.step", "ticks", f"is {ticks}", "give 1 or more")
        if self.done:
            raise SpecError("Emulator.step", "command", "comes after the end of the drive", "call reset first")
        for _ in range(ticks):
            self._drive.answer(answer)
            if self._drive.over:
                break
        return self.frame

    def _of_actuators(self, command: Sequence[float]) -> BodyTwist:
        """Answer that holds commands of the actuators."""
        drive = self._plan.vehicle.drive.actuators
        values = _numbers(command, [actuator.name for actuator in drive])
        for actuator, value in zip(drive, values, strict=True):
            if abs(value) > actuator.limit:
                problem = f"has {value:g} {actuator.unit} for the actuator {actuator.name!r}"
                remedy = f"give {-actuator.limit:g} to {actuator.limit:g}"
                raise SpecError("Emulator.step", "command", problem, remedy)
        return BodyTwist(0.0, 0.0, values)

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self._plan

    @property
    def seed(self) -> int:
        """Seed of all noise."""
        return self._drive.emulator.scenario.seed

    @property
    def time_s(self) -> float:
        """Sim time since the robot was switched on."""
        return self._drive.tick / TICKS_PER_S

    @property
    def done(self) -> bool:
        """True once the drive is over: the robot is at the end and at rest, has given up, or waits for a person."""
        return self._drive.over

    @property
    def reason(self) -> str:
        """Reason why the robot stopped before the end of the plan, or empty."""
        return self._drive.stopped

    @property
    def state(self) -> FollowerState:
        """Tracking errors and motion, as the robot's computer gives them with its question; at the end the last."""
        return follower_state(self._drive.asked.now)

    @property
    def ahead(self) -> FollowerAhead:
        """Reference in the time to come, as the robot's computer gives it with its question; at the end the last."""
        return follower_ahead(self._drive.asked.ahead.copy())

    @property
    def frame(self) -> SensorFrame:
        """Readings of the robot's sensors in the present tick."""
        return self._drive.frame

    @property
    def truth(self) -> Motion:
        """True pose and motion."""
        state = self._drive.emulator.world.state
        return Motion(state.east_m, state.north_m, state.heading_rad, state.speed_mps, state.yaw_rate_radps)

    @property
    def estimate(self) -> Motion:
        """Pose and motion as the robot estimates them."""
        return Motion(*self._drive.emulator.onboard.estimate[:5])

    @property
    def report(self) -> TraversalReport:
        """Figures of the drive so far, which take a moment; final once it is done."""
        return Telemetry(self._drive.emulator).reports().traversal


def _of_twist(command: Sequence[float]) -> BodyTwist:
    speed_mps, yaw_rate_radps = _numbers(command, ("speed", "yaw rate"))
    return BodyTwist(speed_mps, yaw_rate_radps)


def _numbers(command: Sequence[float], names: Sequence[str]) -> tuple[float, ...]:
    """The values of a command, one for each name."""
    try:
        values = tuple(map(float, command))
    except (TypeError, ValueError):
        values = ()
    if len(values) != len(names) or not all(map(math.isfinite, values)):
        remedy = f"give {len(names)} finite numbers: {', '.join(names)}"
        raise SpecError("Emulator.step", "command", f"is {command!r}", remedy)
    return values
