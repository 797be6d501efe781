"""Inputs of one robot's session in a recording: setup, jobs and orders, with their times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import TICKS_PER_S
from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded
from touchline.recordings.recorder import is_stamped
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError, SpecError, TouchlineError
from touchline.schemas.messages import ActuatorCommand, Header, LeavingTrajectory, RobotOrder, String, Trajectory
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.services.robot_sim.initial_state import DamagedState, InitialState
from touchline.services.robot_sim.recovery_state import restored_from

TICK_NS = 10_000_000
_BEFORE_ALL: Final = ("estop", "reset", "inject-fault", "refill-tank", "replace-battery", "authorize")
"""Orders that a robot may obey before its first job."""
_GIVES_A_JOB: Final = ("load", "begin-guided")
_CLOCK_TICKS: Final = int(TICKS_PER_S / topics.CLOCK.rate_hz)
"""Ticks between two clock messages."""
_LONGEST_TICKS: Final = round(7 * 86_400 * TICKS_PER_S)
_MOST_MISSING_TICKS: Final = round(86_400 * TICKS_PER_S)


class NotRebuilt(TouchlineError):
    """A session that cannot be rebuilt from its recording; the message says why."""


class NothingTold(NotRebuilt):
    """The robot got no orders."""


class GivenJob(NamedTuple):
    """Job given to the robot.

    Attributes:
        trajectory: The plan.
        template: Template against which its paint is evaluated, if there is one.
        cause: Inputs of the plan; None if they are not recorded.
        leaving: The drive that the plan leaves, if it does.
    """

    trajectory: Trajectory
    template: Template | None
    cause: PlanCause | None
    leaving: LeavingTrajectory | None = None

    @property
    def is_plannable(self) -> bool:
        """True if all inputs of the plan are recorded."""
        if self.cause is not None and self.cause.calibration:
            return True
        if self.cause is None or self.cause.goal is None:
            return self.cause is not None and self.template is not None
        return self.leaving is not None or len(self.cause.options.start) > 0


class TimedOrder(NamedTuple):
    """A command that the robot obeyed.

    Attributes:
        tick: The last tick before it.
        name: Name of the command.
        details: Its arguments.
    """

    tick: int
    name: str
    details: Mapping[str, Any]


@dataclass
class RecordedSession:
    """Inputs of a session, and its length.

    Attributes:
        setup: The robot and its world.
        orders: Its orders.
        jobs: One for each order to load, in their order.
        last_tick: The last recorded tick.
        from_ns: Sim time of the first recorded stamp.
        initial: State of the robot at its first job here; None if it had just been switched on.
        since: Number of the message with that state among its kind, from 1: what comes before it is no part of the
            session; 0 if all is.
        amid: Whether the recording begins amid an earlier job.
        shifted: Whether log times differ from sim times, as an earlier process of the robot is in the recording.
        commands: (last_tick + 1, actuators) actuator commands of each tick; NaN where nothing is recorded.
    """

    setup: Setup = field(default_factory=Setup)
    orders: list[TimedOrder] = field(default_factory=list)
    jobs: list[GivenJob] = field(default_factory=list)
    last_tick: int = 0
    from_ns: int = 0
    initial: InitialState | None = None
    since: int = 0
    amid: bool = False
    shifted: bool = False
    commands: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def loaded_ns(self) -> frozenset[int]:
        """Sim times at which a job was loaded; a resumed job keeps that of the earlier process."""
        loads = [order for order in self.orders if order.name == "load"]
        resumed = [int(order.details["checkpoint"]["tick"]) for order in loads if "checkpoint" in order.details]
        return frozenset(TICK_NS * tick for tick in (*(order.tick for order in loads), *resumed))

    @classmethod
    def of(cls, messages: Iterable[Recorded]) -> Self:
        """Create it from all messages of one robot, in recorded order.

        Raises:
            NotRebuilt: Something is missing, or cannot be run again.
        """
        found = _Finder()
        for message in messages:
            found.take(message)
        found.check_length()
        if found.setup is None:
            raise NotRebuilt("its setup is not in the recording: start recording before the first order")
        if not found.orders:
            raise NothingTold("no order is in the recording: it is too old, or begins after the orders")
        since, amid = _beginning(found)
        initial = found.initial(since, len(found.setup.vehicle.drive.actuators))
        found.forget_before(since)
        jobs, orders = found.jobs(), found.orders
        if any(order.details.get("resumed") and "checkpoint" not in order.details for order in orders):
            raise NotRebuilt(
                "the session continues that of a process that died, and the recording is too old to contain its state"
            )
        guided = any(order.name == "begin-guided" for order in orders)
        if guided and not any(order.name == "guidance" for order in orders):
            raise NotRebuilt(
                "the robot was guided by a team's coordinator, whose messages are not among its orders: "
                "the recording is too old, or there were none"
            )
        if len(jobs) != sum(order.name == "load" for order in orders):
            raise NotRebuilt("the recording lacks a plan that was loaded")
        from_ns = found.from_ns or 0 if initial is None else initial.tick * TICK_NS
        return cls(
            found.setup,
            orders,
            jobs,
            found.last_tick,
            from_ns,
            initial,
            since,
            amid,
            found.shifted,
            found.commands(len(found.setup.vehicle.drive.actuators)),
        )


@dataclass(frozen=True)
class _StatePlace:
    """A recorded state, and the number of orders, plans and templates before it."""

    text: str
    orders: int
    plans: int
    templates: int

    @cached_property
    def state(self) -> InitialState:
        """Decoded state.

        Raises:
            NotRebuilt: It cannot be decoded.
        """
        try:
            return InitialState.from_text(self.text)
        except DamagedState as error:
            raise NotRebuilt(str(error)) from error

    def begins(self, orders: Sequence[TimedOrder]) -> bool:
        """Return whether the next order is the one given in this state."""
        following = orders[self.orders : self.orders + 1]
        return any(each.name in _GIVES_A_JOB and each.tick == self.state.tick for each in following)


def _beginning(found: _Finder) -> tuple[int, bool]:
    """Return the number of the session's first state, 0 for switched on; and whether that is amid a recording.

    Raises:
        NotRebuilt: It does not begin with a state or order that can be rebuilt.
    """
    problem = _lack_of_beginning(found)
    if not problem and not (found.states and _lacks_orders(found.states[0], found.orders)):
        return 0, False
    for number, each in enumerate(found.states, 1):
        if each.begins(found.orders):
            return number, bool(each.orders) or found.drove_before
    raise NotRebuilt(problem or "orders that the robot obeyed before its first job are not in the recording")


def _lack_of_beginning(found: _Finder) -> str:
    """Return why the session cannot begin with a robot just switched on; "" if it can."""
    first = next((order for order in found.orders if order.name not in _BEFORE_ALL or order.tick), found.orders[0])
    if first.name not in _GIVES_A_JOB:
        return f"the recording begins amid a session, with the order {first.name}, and no other job follows"
    if found.first_tick > _CLOCK_TICKS and not first.details.get("resumed"):
        return (
            f"the robot had been running for {found.first_tick / TICKS_PER_S:.2f} s of sim time before the "
            "recording begins, and the state of sensors and robot at that time is not in it: the recording is older "
            "than those that contain the robot's state at the start of each job"
        )
    return ""


def _lacks_orders(first: _StatePlace, orders: Sequence[TimedOrder]) -> bool:
    """Return whether the robot had obeyed earlier orders that are not recorded."""
    return first.begins(orders) and first.state.orders != first.orders


def _leaving(cause: PlanCause | None, before: Trajectory | None) -> LeavingTrajectory | None:
    """Return the drive that a plan leaves, of the trajectory before; None if it leaves none."""
    if cause is None or cause.leaves is None or before is None:
        return None
    return LeavingTrajectory(trajectory=before, **cause.leaves.model_dump())


class _Finder:
    """Collector of a session's inputs from messages."""

    def __init__(self) -> None:
        self.setup: Setup | None = None
        self.orders: list[TimedOrder] = []
        self.states: list[_StatePlace] = []
        self.drove_before = self.shifted = False
        self.first_tick = self.last_tick = 0
        self.from_ns: int | None = None
        self._clocks = 0
        self._plans: list[Trajectory] = []
        self._templates: list[Template | None] = []
        self._commands: list[tuple[int, tuple[float, ...]]] = []
        self._takers = {
            topics.SETUP.name: self._take_setup,
            topics.PLAN.name: lambda payload: self._plans.append(decode(Trajectory, payload)),
            topics.TEMPLATE.name: self._take_template,
            topics.ORDERS.name: self._take_order,
            topics.INITIAL_STATE.name: self._take_state,
            topics.ACTUATOR_COMMAND.name: self._take_command,
        }

    def take(self, message: Recorded) -> None:
        """Take a message; others than inputs are ignored."""
        topic = topic_at(message.topic)
        if topic is None:
            return
        if self.from_ns is None and is_stamped(topic):
            self.from_ns = message.publish_time_ns
        if topic is topics.CLOCK:
            tick = message.publish_time_ns // TICK_NS
            if not self.first_tick:
                self.first_tick, self.shifted = tick, message.log_time_ns != message.publish_time_ns
            self.last_tick = max(self.last_tick, tick)
            self._clocks += 1
            self.drove_before |= not self.states
        if (taker := self._takers.get(topic.name)) is None:
            return
        try:
            taker(message.payload)
        except (PayloadError, SpecError) as error:
            raise NotRebuilt(f"{message.topic} cannot be decoded: {error}") from error

    def check_length(self) -> None:
        """Refuse a length that a damaged or forged stamp claims: all its ticks would be run again.

        Raises:
            NotRebuilt: The session is too long, or lacks too much.
        """
        shown = max(self._clocks * _CLOCK_TICKS, len(self._commands))
        if self.last_tick > _LONGEST_TICKS:
            raise NotRebuilt(
                f"it reaches {_hours(self.last_tick)} h of sim time; at most {_hours(_LONGEST_TICKS)} are run"
            )
        if self.last_tick - self.first_tick > shown + _MOST_MISSING_TICKS:
            lasts, most = _hours(self.last_tick - self.first_tick), _hours(_MOST_MISSING_TICKS)
            raise NotRebuilt(f"it lasts {lasts} h, with messages of {_hours(shown)} h; at most {most} h may be missing")

    def forget_before(self, since: int) -> None:
        """Drop messages before a state, by its number from 1; nothing for 0."""
        if since:
            begin = self.states[since - 1]
            self.orders = self.orders[begin.orders :]
            self._plans, self._templates = self._plans[begin.plans :], self._templates[begin.templates :]

    def jobs(self) -> list[GivenJob]:
        """Loaded jobs, each with the inputs of its plan.

        Raises:
            NotRebuilt: These inputs, or the state in which one continues, cannot be read.
        """
        loads = [order.details for order in self.orders if order.name == "load"]
        try:
            causes = [details.get("plan") for details in loads]
            made = [None if cause is None else PlanCause.model_validate(cause) for cause in causes]
            for details in loads:
                restored_from(details)
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            raise NotRebuilt(f"an order to load a job cannot be read: {error}") from error
        left = [None, *self._plans]
        given = zip(self._plans, self._templates, made, left, strict=False)
        return [GivenJob(plan, template, cause, _leaving(cause, before)) for plan, template, cause, before in given]

    def initial(self, since: int, actuators: int) -> InitialState | None:
        """State by its number from 1, None for 0, of a robot whose drive has so many actuators.

        Raises:
            NotRebuilt: It is that of another robot.
        """
        if not since:
            return None
        state = self.states[since - 1].state
        try:
            state.check_actuators(actuators)
        except DamagedState as error:
            raise NotRebuilt(str(error)) from error
        return state

    def commands(self, actuators: int) -> NDArray[np.float64]:
        """Commands as in `RecordedSession`, of a drive with so many actuators.

        Raises:
            NotRebuilt: One has another number of values.
        """
        found = np.full((self.last_tick + 1, actuators), np.nan)
        for tick, values in self._commands:
            if len(values) != actuators:
                problem = f"values has {len(values)} numbers, the vehicle's drive has {actuators} actuators"
                raise NotRebuilt(f"{topics.ACTUATOR_COMMAND.name} of tick {tick}: {problem}")
            if 0 <= tick <= self.last_tick:
                found[tick] = values
        return found

    def _take_setup(self, payload: bytes) -> None:
        self.setup = parse(Setup, decode(String, payload).data, "the recording's setup")

    def _take_template(self, payload: bytes) -> None:
        text = decode(String, payload).data
        self._templates.append(parse(Template, text, "the recording's template") if text else None)

    def _take_state(self, payload: bytes) -> None:
        text = decode(String, payload).data
        self.states.append(_StatePlace(text, len(self.orders), len(self._plans), len(self._templates)))

    def _take_order(self, payload: bytes) -> None:
        order = decode(RobotOrder, payload)
        self.orders.append(TimedOrder(tick_of(order.header), order.name, order.details()))

    def _take_command(self, payload: bytes) -> None:
        command = decode(ActuatorCommand, payload)
        tick = tick_of(command.header)
        self.last_tick = max(self.last_tick, tick)
        self._commands.append((tick, tuple(command.values.tolist())))


def _hours(ticks: int) -> str:
    return f"{ticks / TICKS_PER_S / 3600.0:,.0f}"


def tick_of(header: Header) -> int:
    """Return the tick after which a message was sent."""
    return int(header.stamp.sec * 100 + header.stamp.nanosec // TICK_NS)
