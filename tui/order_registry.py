"""Registry of the operator's orders and latch of the emergency stop, without screen, bus or clock.

An order is sent, then accepted, refused or unanswered. An emergency stop stays in force until the robot's status
confirms it, since an answer may come from anybody, or from a robot process that dies next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui.event_log import ERROR, INFO, WARN

ESTOP_TRIES = 6
"""Tries after which the console shows that the stop is not acknowledged; it continues to send it."""
DOUBT_S = 0.5
"""Time for which the status may contradict the answer to an order."""
SHOWN_S = {INFO: 6.0, WARN: 10.0, ERROR: 20.0}
"""Time for which the outcome of an order is shown."""
STOPPING = ("pause", "abort")
"""Orders after which the robot must not report RUNNING any more."""


class Phase(Enum):
    """Phase of an emergency stop."""

    OFF = "off"
    SENT = "sent"
    """Sent, and repeated until the robot reports that it is stopped."""
    HELD = "held"
    """Confirmed by the robot, and not reset since."""


class Change(Enum):
    """Change of the emergency stop by a status."""

    ACKNOWLEDGED = "acknowledged"
    RELEASED = "released"
    RESTARTED = "restarted"
    """Another robot process is there, without the stop, which has to be sent again."""


@dataclass(frozen=True)
class OrderLine:
    """Line about orders: severity, text, and whether it is about an unacknowledged emergency stop."""

    severity: int
    text: str
    loud: bool = False


@dataclass
class StopLatch:
    """Latch of the emergency stop, which only the robot's status or the operator ends."""

    phase: Phase = Phase.OFF
    request_id: str = ""
    tries: int = 0
    answer: str = ""
    changes: list[Change] = field(default_factory=list)
    """Changes that the operator has yet to process."""
    _answered_s: float = 0.0
    _robot: str = ""

    def press(self, request_id: str, robot: str) -> str:
        """Begin a stop; return its request id, the old one while nobody has answered it.

        The robot executes each request id once. If it was answered and the robot does not report a stop, the robot may
        have stopped and been reset by somebody else: another press is another stop. `robot` identifies the run of the
        robot's process that reports its status now, "" if none does.
        """
        if self.phase is not Phase.SENT or self.answer:
            self.begin(request_id)
            self._robot = robot or self._robot
        return self.request_id

    def begin(self, request_id: str) -> None:
        """Send the stop with this request id from now on."""
        self.phase, self.request_id, self.tries, self.answer = Phase.SENT, request_id, 0, ""

    def tried(self, request_id: str, tries: int) -> None:
        """Note another try."""
        if request_id == self.request_id:
            self.tries = max(self.tries, tries)

    def answered(self, request_id: str, answer: str, now_s: float) -> bool:
        """Note an answer; true if it is the first one."""
        if request_id != self.request_id or self.answer:
            return False
        self.answer, self._answered_s = answer, now_s
        return True

    def status(self, state: int, robot: str) -> None:
        """Process a status; `robot` identifies the run of the robot's process."""
        if self.phase is Phase.OFF:
            return
        another, self._robot = self._robot not in ("", robot), robot
        if state == TraversalStatus.ESTOPPED:
            if self.phase is Phase.SENT:
                self.phase = Phase.HELD
                self.changes.append(Change.ACKNOWLEDGED)
        elif another:
            self.phase = Phase.SENT
            self.changes.append(Change.RESTARTED)
        elif self.phase is Phase.HELD:
            self.phase = Phase.OFF
            self.changes.append(Change.RELEASED)

    def withdraw(self) -> None:
        """Withdraw the stop."""
        self.phase = Phase.OFF
        self.changes.clear()

    def line(self, now_s: float, state: str) -> OrderLine | None:
        """Line about the stop; `state` is the robot's as shown, "" if there is none."""
        if self.phase is Phase.HELD:
            return OrderLine(ERROR, "E-STOP ACCEPTED")
        if self.phase is Phase.OFF:
            return None
        if self.answer and state and now_s - self._answered_s > DOUBT_S:
            return OrderLine(ERROR, f"E-STOP ANSWERED BUT {state} – repeating ({self.tries})", loud=True)
        if self.tries <= ESTOP_TRIES:
            return OrderLine(ERROR, f"E-STOP SENT {max(self.tries, 1)}/{ESTOP_TRIES}", loud=True)
        return OrderLine(ERROR, f"E-STOP NOT ACKNOWLEDGED – repeating ({self.tries})", loud=True)


@dataclass
class Placed:
    """Order other than the emergency stop: sent `tries` times of `most`, with its outcome once it is known."""

    name: str
    title: str
    most: int
    at_s: float
    tries: int = 1
    word: OrderLine | None = None
    accepted: bool = False
    answered: bool = False

    def line(self, now_s: float) -> OrderLine:
        """Line about the order."""
        if self.word is not None:
            return self.word
        if self.most > 1:
            return OrderLine(INFO, f"{self.title} sent {self.tries}/{self.most}")
        waited_s = math.floor(now_s - self.at_s)
        return OrderLine(INFO, f"{self.title} sent, no answer for {waited_s} s" if waited_s else f"{self.title} sent")


@dataclass
class OrderRegistry:
    """Registry of the last order of each name."""

    stop: StopLatch = field(default_factory=StopLatch)
    _orders: dict[str, Placed] = field(default_factory=dict)
    _said: tuple[OrderLine, float] | None = None

    def place(self, name: str, title: str, most: int, now_s: float) -> None:
        """Register an order that is sent up to `most` times."""
        self._orders[name] = Placed(name, title, most, now_s)

    def under_way(self, name: str) -> bool:
        """True if the last order of this name is still unanswered."""
        return name in self._orders and self._orders[name].word is None

    def tried(self, name: str, tries: int) -> None:
        """Note the n-th try."""
        if name in self._orders:
            self._orders[name].tries = tries

    def done(self, name: str, word: OrderLine, *, accepted: bool, answered: bool, now_s: float) -> None:
        """Note the outcome of an order; `answered` distinguishes a refusal from silence."""
        order = self._orders.get(name)
        if order is not None:
            order.word, order.accepted, order.answered, order.at_s = word, accepted, answered, now_s

    def latest(self, name: str) -> Placed | None:
        """Return the last order of this name."""
        return self._orders.get(name)

    def say(self, severity: int, text: str, now_s: float) -> None:
        """Show a message about an order that was not sent."""
        self._said = OrderLine(severity, text), now_s

    def accepted_within(self, name: str, seconds: float, now_s: float) -> bool:
        """True if the last order of this name was accepted so recently that the status may not show it yet."""
        order = self._orders.get(name)
        return order is not None and order.accepted and now_s - order.at_s <= seconds

    def line(self, now_s: float, state: str, *, running: bool) -> OrderLine | None:
        """Line about the orders: the emergency stop first, then a pause or abort under way, then the last one."""
        stop, other = self.stop.line(now_s, state), self._other(now_s, running)
        if stop is None or stop.loud or other is None:
            return stop or other
        return OrderLine(max(stop.severity, other.severity), f"{stop.text}   {other.text}")

    def _other(self, now_s: float, running: bool) -> OrderLine | None:
        orders = sorted(self._orders.values(), key=lambda order: order.at_s)
        for order in orders:
            if order.word is None and order.name in STOPPING:
                return order.line(now_s)
        lines = [(order.at_s, self._doubted(order, now_s, running and order is orders[-1])) for order in orders]
        lines += [(self._said[1], self._said[0])] if self._said else []
        under_way = {order.at_s for order in orders if order.word is None}
        fresh = [(at_s, line) for at_s, line in lines if at_s in under_way or now_s - at_s <= SHOWN_S[line.severity]]
        return sorted(fresh, key=lambda entry: entry[0])[-1][1] if fresh else None

    def _doubted(self, order: Placed, now_s: float, running: bool) -> OrderLine:
        if order.name in STOPPING and order.accepted and running and now_s - order.at_s > DOUBT_S:
            return OrderLine(ERROR, f"{order.title} ANSWERED, BUT THE ROBOT SAYS RUNNING")
        return order.line(now_s)
