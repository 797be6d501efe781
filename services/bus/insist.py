"""An order that cannot wait: asked for by two ways at once, again and again, until it is acknowledged."""

import threading
import time
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from queue import Empty, SimpleQueue
from typing import Final, Generic, TypeAlias

from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.topics import Request, Response, Service
from touchline.services.bus.bus import Bus
from touchline.services.bus.calls import CallError
from touchline.services.bus.config import BusConfig

#: A robot answers within milliseconds: after this it is told that it has not.
TELL_S: Final = 0.25
_TELL_AGAIN_S: Final = 5.0
#: After which a question is asked anew; at the door by a new session, as the robot behind it may be another.
_AMONG_ALL_S: Final = 2.0
_AT_DOOR_S: Final = 0.3
_PAUSE_S: Final = 0.02

_Way: TypeAlias = Callable[[], AbstractContextManager[Bus]]


class _DoneError(Exception):
    """The other way was the quicker one."""


def insist(
    service: Service[Request, Response],
    request: Request,
    node: str,
    config: BusConfig,
    patience_s: float,
    tell: Callable[[str], None],
) -> Response:
    """Ask `service` as a peer of everybody and at the robot's own door at once; the first answer counts.

    The request's id makes one order of all repeats. A crowd on the bus, or a frozen process at its meeting point, can
    hold up the first way but not the second; a robot on another machine may be reached by the first alone.

    Args:
        service: One of the robot's.
        request: What is asked for, with an id.
        node: Name of this process on the bus.
        config: Where the bus is.
        patience_s: For how long it is repeated.
        tell: Called with the reason when there is no answer after `TELL_S`, and every few seconds from then on.

    Raises:
        SpecError: The bus configuration cannot be used.
        CallError: Not acknowledged within `patience_s`.
        PayloadError: The answer is not a response of this service.
    """
    asked = _Asked(service, request)
    threads = [
        threading.Thread(target=asked.repeat, args=way, name="order", daemon=True)
        for way in _ways(node, config, asked.done.is_set)
    ]
    begun = time.monotonic()
    for thread in threads:
        thread.start()
    try:
        tell_s = TELL_S
        while (waited_s := time.monotonic() - begun) < patience_s:
            if (answer := asked.answer(min(tell_s, patience_s) - waited_s)) is not None:
                return answer
            if time.monotonic() - begun >= tell_s:
                tell(asked.problem)
                tell_s += _TELL_AGAIN_S
        raise CallError(f"{service.name}: NOT ACKNOWLEDGED within {patience_s:g} s: {asked.problem}")
    finally:
        asked.done.set()  # the threads leave by themselves: whoever gave the order waits for its answer alone


def _ways(node: str, config: BusConfig, stop: Callable[[], bool]) -> Iterable[tuple[_Way, float, bool]]:
    """The ways to the robot, how long one question takes at most, and whether it is told what goes wrong with it."""
    yield lambda: Bus.open(node, config, stop), _AMONG_ALL_S, True
    if config.at_door() is not None:
        yield lambda: Bus.open_at_door(node, config, stop), _AT_DOOR_S, False


class _Asked(Generic[Request, Response]):
    """One order under way.

    Attributes:
        done: Set when no more is to be asked.
        problem: Why there is no answer yet, as far as is known.
    """

    def __init__(self, service: Service[Request, Response], request: Request) -> None:
        self.done = threading.Event()
        self.problem = f"{service.server} has not answered"
        self._service, self._request = service, request
        self._answers: SimpleQueue[Response | PayloadError] = SimpleQueue()

    def answer(self, timeout_s: float) -> Response | None:
        """What was answered; ``None`` if that takes longer."""
        try:
            answer = self._answers.get(timeout=max(0.0, timeout_s))
        except Empty:
            return None
        if isinstance(answer, PayloadError):
            raise answer
        return answer

    def repeat(self, way: _Way, attempt_s: float, telling: bool) -> None:
        """Ask by one way until somebody answers, or it is done."""
        while not self.done.is_set():
            try:
                with way() as bus:
                    self._answers.put(bus.call(self._service, self._request, attempt_s, self._go_on))
                    return
            except PayloadError as error:
                self._answers.put(error)
                return
            except TouchlineError as error:
                if telling:
                    self.problem = str(error)
            except (_DoneError, KeyboardInterrupt):
                return
            self.done.wait(_PAUSE_S)

    def _go_on(self) -> None:
        if self.done.is_set():
            raise _DoneError
