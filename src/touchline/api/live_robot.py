"""`connect()` and `Robot`: a robot on the bus, its status, topics and orders."""

from __future__ import annotations

import asyncio
import json
import math
import time
import uuid
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, Literal, Self, TypeVar, cast

from touchline.api.planned import Plan
from touchline.bus import Bus, BusConfig, Inbox, UrgentOrder, repeat_until_acknowledged
from touchline.onboard.executive.traversal_states import NAMES
from touchline.schemas import topics
from touchline.schemas.errors import CommandRefused, SpecError, TouchlineError
from touchline.schemas.faults import Fault, parse_fault
from touchline.schemas.messages import (
    CommandRequest,
    CommandResponse,
    InjectFaultRequest,
    LoadRequest,
    Odometry,
    SetSpeedRequest,
    TraversalStatus,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.near_names import did_you_mean
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.spec import EVERY_FIELD
from touchline.schemas.topics import Service

State = Literal["idle", "ready", "running", "paused", "done", "aborted", "emergency-stopped"]
OVER: tuple[State, ...] = ("done", "aborted", "emergency-stopped")
POLL_S = 0.005
#: Least time for the answer to a plan; longest for a robot to come to rest, and time between two requests meanwhile.
LOAD_S, REST_S, AGAIN_S = 30.0, 3.0, 0.2
T = TypeVar("T")


class RobotUnavailable(TouchlineError, TimeoutError):
    """Error: the robot is not on the bus, or does not answer in time.

    Attributes:
        field: Namespace of the robot.
        remedy: What to do.
    """

    def __init__(self, namespace: str, problem: str, remedy: str) -> None:
        self.field, self.remedy = namespace, remedy
        super().__init__(f"robot {namespace} {problem}; {remedy}")


def connect(namespace: str = "tt2", /, *, endpoint: str | None = None, timeout_s: float = 5.0) -> Robot:
    """Connect to a robot on the bus, as its operator.

    Args:
        namespace: Namespace of the robot.
        endpoint: Zenoh locator where all meet, such as `tcp/127.0.0.1:7461`; None: $TOUCHLINE_ENDPOINT, else the router
            of the identity that $TOUCHLINE_IDENTITY names, else this machine's.
        timeout_s: Wall-clock time to wait for the robot, and for each of its answers.

    Returns:
        The robot; as a context manager it is left at the end.

    Raises:
        RobotUnavailable: It is not there in time.
        SpecError: An argument, the environment or the identity cannot be used.
        TouchlineError: The bus cannot be joined: nobody listens at the endpoint of a router, it does not admit the
            identity, or another program listens there.
    """
    return Robot(namespace, endpoint=endpoint, timeout_s=timeout_s)


class Robot:
    """A robot on the bus; as a context manager it is left at the end. Not for several threads at once.

    Whoever is connected is its operator: a robot that hears neither operator nor planner for 2 s stops by itself.

    Attributes:
        namespace: Its namespace.
    """

    def __init__(self, namespace: str, /, *, endpoint: str | None = None, timeout_s: float = 5.0) -> None:
        """Join the bus; see `connect`."""
        config = BusConfig.from_environment((namespace,))
        self._config = config if endpoint is None else replace(config, endpoint=endpoint)
        self.namespace, self._timeout_s = namespace, timeout_s
        self._open = ExitStack()
        try:
            self._bus = self._open.enter_context(Bus.open(topics.OPERATOR, self._config))
            self._latest = self._bus.inbox([topics.STATUS, topics.ODOMETRY], keep="latest")
            self._last: dict[type[Message], Message] = {}
            self._presence = self._bus.presence()
            deadline = time.monotonic() + timeout_s
            while not self._is_there:
                if time.monotonic() > deadline:
                    problem = f"is not on the bus at {self._config.endpoint}"
                    raise RobotUnavailable(namespace, problem, "start it with `touchline up`, or name another")
                time.sleep(POLL_S)
            self._newest(TraversalStatus)  # which it sends once it takes orders
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the bus; harmless when repeated."""
        self._open.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the bus."""
        self.close()

    def __repr__(self) -> str:
        """One line: namespace and meeting point."""
        return f"Robot({self.namespace!r} at {self._config.endpoint})"

    @property
    def status(self) -> TraversalStatus:
        """Last status of its traversal.

        Raises:
            RobotUnavailable: It has sent none in time.
        """
        return self._newest(TraversalStatus)

    @property
    def state(self) -> State:
        """State of its traversal, as `status` has it."""
        return _name_of(self.status)

    @property
    def estimate(self) -> Odometry:
        """Last estimate of its pose and twist, map frame.

        Raises:
            RobotUnavailable: It has sent none in time: it does not know its pose yet.
        """
        return self._newest(Odometry)

    def load(self, plan: Plan, /) -> float:
        """Load a plan; return its duration (s).

        Raises:
            CommandRefused: The robot does not take it.
        """
        template = plan.template.model_dump_json()
        cause = PlanCause.of(plan.options.message(), plan.report).model_dump_json()
        request = LoadRequest(
            request_id=_new_id(), trajectory=plan.trajectory, template_json=template, cause_json=cause
        )
        return self._load(request)

    def go_on(self) -> None:
        """Load what remains of the job in its journal, after an abort or a restart; `start` drives it.

        Raises:
            CommandRefused: There is none.
        """
        self._load(LoadRequest(request_id=_new_id(), resume=True))

    def start(self) -> None:
        """Start the loaded plan.

        Raises:
            CommandRefused: The robot does not start, and why.
        """
        self._order(topics.START)

    def resume(self) -> None:
        """End a pause.

        Raises:
            CommandRefused: The robot does not go on, and why.
        """
        self._order(topics.RESUME)

    def pause(self) -> None:
        """Stop on the path; repeated until the robot proves that it obeys.

        Raises:
            CommandRefused: There is nothing to pause.
            CallError: It was not acknowledged in time.
        """
        self._insist(topics.PAUSE)

    def abort(self) -> None:
        """Stop for good; repeated as `pause`.

        Raises:
            CommandRefused: There is nothing to abort.
            CallError: It was not acknowledged in time.
        """
        self._insist(topics.ABORT)

    def estop(self) -> None:
        """Emergency stop; repeated as `pause`, over the bus and at the robot's own door.

        Raises:
            CallError: It was not acknowledged in time.
        """
        self._insist(topics.ESTOP)

    def reset(self) -> None:
        """End an emergency stop.

        Raises:
            CommandRefused: Its cause lasts.
        """
        self._order(topics.RESET)

    def refill(self) -> None:
        """Report that the tank was filled.

        Raises:
            CommandRefused: It has none.
        """
        self._order(topics.REFILL_TANK)

    def set_pace(self, factor: float, /) -> None:
        """Set the pace of an emulated robot: seconds of sim time per second; negative: as fast as possible.

        Raises:
            CommandRefused: The factor is not allowed.
        """
        self._ask(topics.SET_SPEED, SetSpeedRequest(request_id=_new_id(), factor=factor))

    def fault(self, fault: Fault | Mapping[str, Any], /) -> None:
        """Inject a fault into an emulated robot; its `start_s` counts from now.

        Args:
            fault: The fault, or its fields with its `kind`.

        Raises:
            SpecError: It is no fault.
            CommandRefused: The robot cannot have it.
        """
        given = fault.model_dump(mode="json", context=EVERY_FIELD) if isinstance(fault, Fault) else dict(fault)
        checked = parse_fault(json.dumps(given))
        self._ask(topics.INJECT_FAULT, InjectFaultRequest(request_id=_new_id(), fault_json=checked.model_dump_json()))

    def wait(self, *states: State, timeout_s: float | None = None) -> TraversalStatus:
        """Wait until the traversal is in one of these states; without any, until it is over.

        Args:
            *states: "ready", "running", "paused", "done", "aborted" or "emergency-stopped".
            timeout_s: Wall-clock time; None: for ever.

        Returns:
            The status then.

        Raises:
            SpecError: There is no such state.
            RobotUnavailable: It takes longer, or the robot has left the bus.
        """
        deadline = _deadline(timeout_s)
        while (status := self._reached(*states, late=time.monotonic() > deadline)) is None:
            time.sleep(POLL_S)
        return status

    def _reached(self, *states: State, late: bool = False) -> TraversalStatus | None:
        """Status if the traversal is in one of these states, or over if none is given; else None.

        Args:
            *states: As of `wait`.
            late: Raise in place of None.

        Raises:
            SpecError: There is no such state.
            RobotUnavailable: It is late, or the robot has left the bus.
        """
        wanted, status = states or OVER, self.status
        for state in wanted:
            if state not in NAMES.values():
                raise SpecError("Robot.wait", "state", f"is {state!r}", f"use one of: {', '.join(NAMES.values())}")
        if _name_of(status) in wanted:
            return status
        if late:
            problem = f"is not {' or '.join(wanted)} in time, but {_name_of(status)}"
            raise RobotUnavailable(self.namespace, problem, status.reason or "wait longer")
        if not self._is_there:
            raise RobotUnavailable(self.namespace, "has left the bus", "start it again; `go_on` continues its job")
        return None

    def subscribe(self, topic: str, /, *, timeout_s: float | None = None) -> Iterator[Message]:
        """Messages of one of its topics, as they come; the last one first, if the topic is latched.

        Args:
            topic: Name of the topic without the namespace, such as "traversal/status"; `touchline topics` lists them.
            timeout_s: Wall-clock time without a message after which it ends; None: never.

        Raises:
            SpecError: There is no such topic.
        """
        return self._messages(self._inbox(topic), timeout_s)

    def _inbox(self, topic: str, /) -> Inbox:
        """Inbox of one of its topics, to be polled; see `subscribe`.

        Raises:
            SpecError: There is no such topic.
        """
        known = topics.TOPIC_BY_NAME
        if topic not in known:
            remedy = did_you_mean(topic, known) or "`touchline topics` lists them"
            raise SpecError("Robot.subscribe", topic, "is not a topic", remedy)
        return self._bus.inbox([known[topic]])

    def _messages(self, inbox: Inbox, timeout_s: float | None) -> Iterator[Message]:
        deadline = _deadline(timeout_s)
        while time.monotonic() < deadline:
            for _, message in inbox.messages():
                yield message
                deadline = _deadline(timeout_s)
            time.sleep(POLL_S)

    @property
    def _is_there(self) -> bool:
        self._presence.poll()
        return topics.ROBOT_SIM in self._presence.alive()

    def _newest(self, kind: type[T]) -> T:
        deadline = time.monotonic() + self._timeout_s
        while True:
            self._last |= {type(message): message for _, message in self._latest.messages()}
            found = next((each for each in self._last.values() if isinstance(each, kind)), None)
            if found is not None:
                return found
            if time.monotonic() > deadline:
                problem = f"has sent no {kind.__name__} for {self._timeout_s:g} s"
                raise RobotUnavailable(self.namespace, problem, "see whether it runs: `touchline status`")
            time.sleep(POLL_S)

    def _load(self, request: LoadRequest) -> float:
        """Load, again and again while a robot that has just ended another job comes to rest."""
        deadline = time.monotonic() + REST_S
        while True:
            answer = self._bus.call(topics.LOAD, request, max(self._timeout_s, LOAD_S))
            if answer.success:
                return answer.total_time
            if self.state not in OVER or time.monotonic() > deadline:
                raise CommandRefused(answer.message)
            time.sleep(AGAIN_S)
            request = request.model_copy(update={"request_id": _new_id()})

    def _order(self, service: Service[CommandRequest, CommandResponse]) -> None:
        self._ask(service, CommandRequest(request_id=_new_id()))

    def _ask(self, service: Service[Any, Any], request: Message) -> None:
        answer = self._bus.call(service, request, self._timeout_s)
        if not answer.success:
            raise CommandRefused(answer.message)

    def _insist(self, service: Service[CommandRequest, CommandResponse]) -> None:
        order = UrgentOrder(service, CommandRequest(request_id=_new_id()), max(self._timeout_s, 5.0))
        for _, answer in repeat_until_acknowledged(order, topics.OPERATOR, self._config, lambda problem: None):
            if not answer.success:
                raise CommandRefused(answer.message)


async def connect_async(
    namespace: str = "tt2", /, *, endpoint: str | None = None, timeout_s: float = 5.0
) -> AsyncRobot:
    """Connect to a robot without holding up the event loop.

    Args:
        namespace: Namespace of the robot.
        endpoint: As of `connect`.
        timeout_s: As of `connect`.

    Returns:
        The robot, whose methods are awaited.

    Raises:
        RobotUnavailable: It is not there in time.
        SpecError: An argument, the environment or the identity cannot be used.
        TouchlineError: The bus cannot be joined.
    """
    return AsyncRobot(await asyncio.to_thread(connect, namespace, endpoint=endpoint, timeout_s=timeout_s))


class AsyncRobot:
    """A `Robot` whose methods are awaited, one after the other; orders that stop it wait for no other."""

    def __init__(self, robot: Robot) -> None:
        """Take a connected robot."""
        self._robot, self._lock = robot, asyncio.Lock()

    async def _call(self, method: Callable[..., T], *arguments: Any, **named: Any) -> T:
        async with self._lock:
            return await asyncio.to_thread(method, *arguments, **named)

    async def status(self) -> TraversalStatus:
        """See `Robot.status`."""
        return await self._call(lambda: self._robot.status)

    async def load(self, plan: Plan, /) -> float:
        """See `Robot.load`."""
        return await self._call(self._robot.load, plan)

    async def order(self, name: Literal["start", "resume", "pause", "abort", "estop", "reset", "go_on"], /) -> None:
        """Give an order: the method of `Robot` of that name."""
        method = getattr(self._robot, name)
        if name in ("pause", "abort", "estop"):  # they have sessions of their own
            await asyncio.to_thread(method)
        else:
            await self._call(method)

    async def wait(self, *states: State, timeout_s: float | None = None) -> TraversalStatus:
        """See `Robot.wait`; orders can be given meanwhile."""
        deadline = _deadline(timeout_s)
        while True:
            status = await self._call(self._robot._reached, *states, late=time.monotonic() > deadline)
            if status is not None:
                return status
            await asyncio.sleep(POLL_S)

    async def subscribe(self, topic: str, /, *, timeout_s: float | None = None) -> AsyncIterator[Message]:
        """See `Robot.subscribe`."""
        inbox, deadline = await self._call(self._robot._inbox, topic), _deadline(timeout_s)
        while time.monotonic() < deadline:
            for _, message in await self._call(lambda: [*inbox.messages()]):
                yield message
                deadline = _deadline(timeout_s)
            await asyncio.sleep(POLL_S)

    async def close(self) -> None:
        """Leave the bus."""
        await self._call(self._robot.close)

    async def __aenter__(self) -> Self:
        """Return itself."""
        return self

    async def __aexit__(self, *_: object) -> None:
        """Leave the bus."""
        await self.close()


def _name_of(status: TraversalStatus) -> State:
    return cast(State, NAMES[status.state])


def _deadline(timeout_s: float | None) -> float:
    """Time (monotonic) at which a timeout is over; None: never."""
    return math.inf if timeout_s is None else time.monotonic() + timeout_s


def _new_id() -> str:
    return uuid.uuid4().hex
