"""Urgent orders: repeated over the bus and at the robots' own doors until every robot proves that it has obeyed."""

import math
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue
from typing import Final, Generic

from touchline.bus.bus import Bus
from touchline.bus.calls import AccessError, CallError
from touchline.bus.config import BusConfig, Door
from touchline.bus.identity_check import check_identity
from touchline.bus.stop_proof import StopProof
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.topics import Request, Response, Service

#: Time after which a missing answer is reported: a robot answers within milliseconds.
REPORT_AFTER_S: Final = 0.25
_TELL_AGAIN_S: Final = 5.0
#: Time after which a query is repeated; at the door by a new session, as the robot behind it may be another.
_AMONG_ALL_S: Final = 2.0
_AT_DOOR_S: Final = 0.3
_PAUSE_S: Final = 0.02
_POLL_S: Final = 0.005
#: Time in which a newcomer on the bus learns of all of its robots.
_FOUND_S: Final = 0.5


class _DoneError(Exception):
    """The other path was quicker."""


@dataclass(frozen=True)
class UrgentOrder(Generic[Request, Response]):
    """Order to send.

    Attributes:
        service: A service of the robots.
        request: Request with an id, which makes one order of all repeats.
        patience_s: Time for which it is repeated.
        everyone: Whether it is for every robot on the bus; those of the bus configuration are asked before the others
            are known.
    """

    service: Service[Request, Response]
    request: Request
    patience_s: float
    everyone: bool = False


def repeat_until_acknowledged(
    order: UrgentOrder[Request, Response], node: str, config: BusConfig, report: Callable[[str], None]
) -> Iterator[tuple[str, Response]]:
    """Send an order over the bus and at the robots' own doors at once; each robot's first proved answer counts.

    A crowd on the bus, or a hung process at its meeting point, can hold up the first path but not the second; a robot
    on another machine may be reached by the first alone.

    Args:
        order: The order.
        node: Name of this process on the bus.
        config: Bus configuration with the robots.
        report: Called with the reason when there is no answer after `REPORT_AFTER_S`, then every few seconds.

    Yields:
        Robots, by their namespaces, and their answers, as these come.

    Raises:
        SpecError: The bus configuration cannot be used.
        AccessError: One of them refuses it to this role.
        CallError: Not acknowledged by all of them within the order's patience.
        PayloadError: An answer is not a response of this service.
    """
    check_identity(node, config)
    doors = config.doors()
    asked = _Asked(order, config.namespaces, {door.namespace for door in doors if door.namespace}, threading.Event())
    threads = [
        threading.Thread(target=asked.repeat, args=(path,), name="order", daemon=True)
        for path in _paths(order, node, config, doors, asked.done.is_set)
    ]
    begun = time.monotonic()
    for thread in threads:
        thread.start()
    try:
        tell_s = REPORT_AFTER_S
        while not asked.finished and (waited_s := time.monotonic() - begun) < order.patience_s:
            if (answer := asked.answer(min(tell_s, order.patience_s) - waited_s)) is not None:
                yield answer
            elif not asked.finished and time.monotonic() - begun >= tell_s:
                report(asked.problem)
                tell_s += _TELL_AGAIN_S
        if not asked.finished:
            raise CallError(f"{order.service.name}: NOT ACKNOWLEDGED within {order.patience_s:g} s: {asked.problem}")
    finally:
        asked.done.set()  # the threads leave by themselves: the caller waits for the answers only


def repeat_at_door(
    service: Service[Request, Response], request: Request, node: str, config: BusConfig, called_off: threading.Event
) -> None:
    """Send an order to one robot at its own door, again and again until it is proved there.

    For those who are on the bus and send it there, too. Where there is no door this does nothing.

    Args:
        service: A service of the robot.
        request: Request with the id of the order on the bus.
        node: Name of this process on the bus.
        config: Bus configuration of the robot.
        called_off: Set by whoever calls the order off.

    Raises:
        SpecError: The bus configuration cannot be used.
    """
    asked = _Asked(UrgentOrder(service, request, math.inf), config.namespaces, set(), called_off)
    for path in _door_paths(node, config, config.doors(), called_off.is_set):
        if path.leads_to({config.namespace}):
            asked.repeat(path)


@dataclass(frozen=True)
class _Path:
    """Path to robots.

    Attributes:
        join: Joins the bus by this path.
        attempt_s: Longest duration of a query.
        door: The robot's own door to which it leads; None if it meets all robots.
    """

    join: Callable[[], AbstractContextManager[Bus]]
    attempt_s: float
    door: Door | None = None

    def leads_to(self, robots: set[str]) -> set[str]:
        """Return those of the robots that may be met by this path."""
        return robots & {self.door.namespace} if self.door is not None and self.door.namespace else robots


def _paths(
    order: UrgentOrder[Request, Response],
    node: str,
    config: BusConfig,
    doors: Iterable[Door],
    stop: Callable[[], bool],
) -> Iterable[_Path]:
    wanted, config = set(config.namespaces), config.of(config.namespaces[0])
    yield _Path(lambda: Bus.open(node, config, stop), _AMONG_ALL_S)
    for path in _door_paths(node, config, doors, stop):
        if order.everyone or path.leads_to(wanted):
            yield path


def _door_paths(node: str, config: BusConfig, doors: Iterable[Door], stop: Callable[[], bool]) -> Iterator[_Path]:
    for door in doors:
        yield _Path(partial(Bus.open_at_door, node, config, door, stop), _AT_DOOR_S, door)


class _Asked(Generic[Request, Response]):
    """Order in progress.

    Attributes:
        done: Set when no more queries are to be sent.

    Args:
        order: The order.
        robots: The robots that are asked first.
        everybody: All robots that may join the bus, if that is known: none can be missing when they have answered.
        done: As the attribute.
    """

    def __init__(
        self,
        order: UrgentOrder[Request, Response],
        robots: Iterable[str],
        everybody: set[str],
        done: threading.Event,
    ) -> None:
        self.done = done
        self._order = order
        self._lock = threading.Lock()
        self._wanted = set(robots)
        self._answered: set[str] = set()
        self._all_found = not order.everyone
        self._everybody = everybody
        self._problem = ""
        self._answers: SimpleQueue[tuple[str, Response] | AccessError | PayloadError] = SimpleQueue()

    @property
    def problem(self) -> str:
        """Reason why there is no answer yet, as far as is known."""
        missing = sorted(self._missing())
        if self._problem:
            return self._problem
        if not missing:
            return "the other robots on the bus are not known yet"
        whose = f" of {', '.join(missing)}" if len(self._wanted) > 1 else ""
        return f"{self._order.service.server}{whose} has not answered"

    @property
    def finished(self) -> bool:
        """True if all have answered, and all answers have been taken."""
        return self._all_answered() and self._answers.empty()

    def answer(self, timeout_s: float) -> tuple[str, Response] | None:
        """Return the next answer; ``None`` if it takes longer, or all have answered."""
        deadline = time.monotonic() + timeout_s
        while True:
            try:
                answer = self._answers.get(timeout=max(0.0, min(_PAUSE_S, deadline - time.monotonic())))
            except Empty:
                if self.finished or time.monotonic() >= deadline:
                    return None
                continue
            if isinstance(answer, AccessError | PayloadError):
                raise answer
            return answer

    def repeat(self, path: _Path) -> None:
        """Ask by one path until everybody has answered, or it is done."""
        while not self.done.is_set() and not self._all_answered():
            try:
                with path.join() as bus:
                    self._ask(bus, path)
            except TouchlineError as error:
                if path.door is None:
                    self._problem = str(error)
            except (_DoneError, KeyboardInterrupt):
                return
            self.done.wait(_PAUSE_S)

    def _ask(self, bus: Bus, path: _Path) -> None:
        """Ask all robots that have not answered, and those found meanwhile, side by side."""
        roster, begun = bus.roster(), time.monotonic()
        buses, asking = {bus.namespace: bus}, dict[str, threading.Thread]()
        while not self.done.is_set() and (missing := self._missing() or not self._all_found):
            if self._order.everyone:
                roster.poll()
                all_found = path.door is None and roster.counted_s > begun + _FOUND_S
                self._find(roster.robots({topics.ROBOT_SIM, topics.REPLAY}), all_found)
            for robot in path.leads_to(self._missing()) - asking.keys():
                buses[robot] = buses.get(robot) or bus.of(robot)
                asking[robot] = threading.Thread(
                    target=self._call, args=(buses[robot], path), name="order", daemon=True
                )
                asking[robot].start()
            if missing and not any(thread.is_alive() for thread in asking.values()):
                if time.monotonic() - begun > path.attempt_s:
                    break
                asking = {robot: thread for robot, thread in asking.items() if robot not in self._missing()}
            time.sleep(_POLL_S)
        for thread in asking.values():
            thread.join()

    def _call(self, bus: Bus, path: _Path) -> None:
        robot, proof = bus.namespace, StopProof(bus, at_door=path.door is not None)
        try:
            answer = proof.call(self._order.service, self._order.request, path.attempt_s, lambda: self._go_on(robot))
        except (AccessError, PayloadError) as error:
            self._answers.put(error)
        except TouchlineError as error:
            if path.door is None:
                self._problem = str(error)
        except _DoneError:
            pass
        else:
            with self._lock:
                if robot not in self._answered:
                    self._answered.add(robot)
                    self._problem = ""
                    self._answers.put((robot, answer))

    def _find(self, robots: Iterable[str], all_found: bool) -> None:
        """Add robots that are on the bus; once all are known, absent ones are no longer waited for."""
        with self._lock:
            self._wanted |= set(robots)
            if all_found and robots:
                self._wanted &= {*robots, *self._answered}
                self._all_found = True

    def _all_answered(self) -> bool:
        with self._lock:
            everybody = bool(self._everybody) and self._everybody <= self._answered
            return everybody or (self._all_found and not self._wanted - self._answered)

    def _missing(self) -> set[str]:
        with self._lock:
            return self._wanted - self._answered

    def _go_on(self, robot: str) -> None:
        if self.done.is_set() or robot not in self._missing():
            raise _DoneError
