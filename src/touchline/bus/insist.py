"""Urgent orders: repeated over the bus and at the robots' own doors until every robot says that it has obeyed."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Final, Generic, TypeAlias

from touchline.bus.bus import Bus
from touchline.bus.calls import CallError
from touchline.bus.config import BusConfig
from touchline.bus.stop_proof import StopProof, proves
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.topics import Request, Response, Service

#: A robot answers within milliseconds: after this it is told that it has not.
TELL_S: Final = 0.25
_TELL_AGAIN_S: Final = 5.0
#: After which a question is asked anew; at the door by a new session, as the robot behind it may be another.
_AMONG_ALL_S: Final = 2.0
_AT_DOOR_S: Final = 0.3
_PAUSE_S: Final = 0.02
_POLL_S: Final = 0.005
#: Whoever has joined the bus knows all of its robots after this long.
_FOUND_S: Final = 0.5

_Way: TypeAlias = Callable[[], AbstractContextManager[Bus]]


class _DoneError(Exception):
    """The other way was the quicker one."""


@dataclass(frozen=True)
class UrgentOrder(Generic[Request, Response]):
    """What is asked for.

    Attributes:
        service: One of the robots'.
        request: With an id, which makes one order of all repeats.
        patience_s: For how long it is repeated.
        everyone: Whether it is for every robot on the bus; those of the bus configuration are asked before it is known
            who there is.
    """

    service: Service[Request, Response]
    request: Request
    patience_s: float
    everyone: bool = False


def insist(
    order: UrgentOrder[Request, Response], node: str, config: BusConfig, tell: Callable[[str], None]
) -> Iterator[tuple[str, Response]]:
    """Send an order over the bus and at the robots' own doors at once; each robot's first answer that is proved counts.

    A crowd on the bus, or a frozen process at its meeting point, can hold up the first way but not the second; a robot
    on another machine may be reached by the first alone.

    Args:
        order: What is asked for.
        node: Name of this process on the bus.
        config: Where the bus is, and the robots.
        tell: Called with the reason when there is no answer after `TELL_S`, and every few seconds from then on.

    Yields:
        Robots, by their namespaces, and what they have answered, as the answers come.

    Raises:
        SpecError: The bus configuration cannot be used.
        CallError: Not acknowledged by all of them within the order's patience.
        PayloadError: An answer is not a response of this service.
    """
    asked = _Asked(order, config.namespaces)
    threads = [
        threading.Thread(target=asked.repeat, args=way, name="order", daemon=True)
        for way in _ways(node, config, asked.done.is_set)
    ]
    begun = time.monotonic()
    for thread in threads:
        thread.start()
    try:
        tell_s = TELL_S
        while not asked.finished and (waited_s := time.monotonic() - begun) < order.patience_s:
            if (answer := asked.answer(min(tell_s, order.patience_s) - waited_s)) is not None:
                yield answer
            elif not asked.finished and time.monotonic() - begun >= tell_s:
                tell(asked.problem)
                tell_s += _TELL_AGAIN_S
        if not asked.finished:
            raise CallError(f"{order.service.name}: NOT ACKNOWLEDGED within {order.patience_s:g} s: {asked.problem}")
    finally:
        asked.done.set()  # the threads leave by themselves: whoever gave the order waits for its answers alone


def _ways(node: str, config: BusConfig, stop: Callable[[], bool]) -> Iterable[tuple[_Way, float, bool]]:
    """The ways to the robots, how long one question takes at most, and whether by that way all robots are met."""
    config = config.of(config.namespaces[0])
    yield lambda: Bus.open(node, config, stop), _AMONG_ALL_S, True
    if config.at_door() is not None:
        yield lambda: Bus.open_at_door(node, config, stop), _AT_DOOR_S, False


class _Asked(Generic[Request, Response]):
    """One order under way.

    Attributes:
        done: Set when no more is to be asked.
    """

    def __init__(self, order: UrgentOrder[Request, Response], robots: Iterable[str]) -> None:
        self.done = threading.Event()
        self._order = order
        self._lock = threading.Lock()
        self._wanted = set(robots)
        self._answered: set[str] = set()
        self._all_found = not order.everyone
        self._problem = ""
        self._answers: SimpleQueue[tuple[str, Response] | PayloadError] = SimpleQueue()

    @property
    def problem(self) -> str:
        """Why there is no answer yet, as far as is known."""
        missing = sorted(self._missing())
        if self._problem:
            return self._problem
        if not missing:
            return "who else is on the bus has not been found out yet"
        whose = f" of {', '.join(missing)}" if len(self._wanted) > 1 else ""
        return f"{self._order.service.server}{whose} has not answered"

    @property
    def finished(self) -> bool:
        """Whether there is nobody left to ask, and all answers have been taken."""
        return self._all_found and not self._missing() and self._answers.empty()

    def answer(self, timeout_s: float) -> tuple[str, Response] | None:
        """The next answer; ``None`` if it takes longer, or there is nobody left to give one."""
        deadline = time.monotonic() + timeout_s
        while True:
            try:
                answer = self._answers.get(timeout=max(0.0, min(_PAUSE_S, deadline - time.monotonic())))
            except Empty:
                if self.finished or time.monotonic() >= deadline:
                    return None
                continue
            if isinstance(answer, PayloadError):
                raise answer
            return answer

    def repeat(self, way: _Way, attempt_s: float, meets_all: bool) -> None:
        """Ask by one way until everybody has answered, or it is done."""
        while not self.done.is_set():
            try:
                with way() as bus:
                    self._ask(bus, attempt_s, meets_all)
            except TouchlineError as error:
                if meets_all:
                    self._problem = str(error)
            except (_DoneError, KeyboardInterrupt):
                return
            self.done.wait(_PAUSE_S)

    def _ask(self, bus: Bus, attempt_s: float, meets_all: bool) -> None:
        """Ask everybody who has not answered, and those who are found meanwhile, side by side."""
        roster, begun = bus.roster(), time.monotonic()
        buses, asking = {bus.namespace: bus}, dict[str, threading.Thread]()
        while not self.done.is_set() and (missing := self._missing() or not self._all_found):
            if self._order.everyone:
                roster.poll()
                self._find(
                    roster.robots({topics.ROBOT_SIM, topics.REPLAY}), meets_all and roster.counted_s > begun + _FOUND_S
                )
            for robot in self._missing() - asking.keys():
                buses[robot] = buses.get(robot) or bus.of(robot)
                asking[robot] = threading.Thread(
                    target=self._call, args=(buses[robot], attempt_s, meets_all), name="order", daemon=True
                )
                asking[robot].start()
            if missing and not any(thread.is_alive() for thread in asking.values()):
                if time.monotonic() - begun > attempt_s:
                    break
                asking = {robot: thread for robot, thread in asking.items() if robot not in self._missing()}
            time.sleep(_POLL_S)
        for thread in asking.values():
            thread.join()

    def _call(self, bus: Bus, attempt_s: float, telling: bool) -> None:
        robot, proof = bus.namespace, StopProof(bus, at_door=not telling)
        try:
            answer = bus.call(self._order.service, self._order.request, attempt_s, lambda: self._go_on(robot))
            if problem := self._doubt(bus, answer, attempt_s, proof):
                raise CallError(problem)
        except PayloadError as error:
            self._answers.put(error)
        except TouchlineError as error:
            if telling:
                self._problem = str(error)
        except _DoneError:
            pass
        else:
            with self._lock:
                if robot not in self._answered:
                    self._answered.add(robot)
                    self._problem = ""
                    self._answers.put((robot, answer))

    def _doubt(self, bus: Bus, answer: Response, attempt_s: float, proof: StopProof) -> str:
        """Why an answer is not the robot's word that it has done as ordered; "" if it is."""
        name, server = self._order.service.name, self._order.service.server
        refused, robots = not getattr(answer, "success", True), len(bus.sessions(server))
        replayed = robots == 0 and bool(bus.sessions(topics.REPLAY))
        may_refuse = replayed or (robots < 2 and name != topics.ESTOP.name)  # no robot refuses an emergency stop
        if not proves(name) or (refused and may_refuse):
            return ""
        return proof.lacking(name, attempt_s)

    def _find(self, robots: Iterable[str], all_found: bool) -> None:
        """Take up robots that are on the bus; when all are known, those that are not are not waited for."""
        with self._lock:
            self._wanted |= set(robots)
            if all_found and robots:
                self._wanted &= {*robots, *self._answered}
                self._all_found = True

    def _missing(self) -> set[str]:
        with self._lock:
            return self._wanted - self._answered

    def _go_on(self, robot: str) -> None:
        if self.done.is_set() or robot not in self._missing():
            raise _DoneError
