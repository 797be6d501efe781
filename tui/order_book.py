"""State of the operator's orders and the latch of the emergency stop, without screen, bus or clock.

An order is sent, then accepted, refused or unanswered. An emergency stop is more: it stays in force here until the
robot's own status says that it is stopped, for an answer may be anybody's and may come from a robot that dies next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui.event_log import ERROR, INFO, WARN

ESTOP_TRIES = 6
"""After so many the console says that the stop is not acknowledged; it goes on sending it."""
DOUBT_S = 0.5
"""So long the status may go on saying something else than the answer to an order."""
SHOWN_S = {INFO: 6.0, WARN: 10.0, ERROR: 20.0}
"""How long the last word on an order stays, if no other comes."""
STOPPING = ("pause", "abort")
"""Orders after which the robot must no longer say that it runs."""


class Phase(Enum):
    """How far an emergency stop is."""

    OFF = "off"
    SENT = "sent"
    """Given, and repeated until the robot says that it is stopped."""
    HELD = "held"
    """The robot has said so, and has not been reset since."""


class Change(Enum):
    """What a status means for the emergency stop."""

    ACKNOWLEDGED = "acknowledged"
    RELEASED = "released"
    RESTARTED = "restarted"
    """Another robot process is there, which knows nothing of the stop: it has to be given anew."""


@dataclass(frozen=True)
class OrderLine:
    """What is shown of the orders: how grave it is, and whether it is about an emergency stop still to be heard."""

    severity: int
    text: str
    loud: bool = False


@dataclass
class StopLatch:
    """The emergency stop given here; only the robot's status or the operator ends it."""

    phase: Phase = Phase.OFF
    request_id: str = ""
    tries: int = 0
    answer: str = ""
    changes: list[Change] = field(default_factory=list)
    """What the operator's hand has yet to act on."""
    _answered_s: float = 0.0
    _robot: str = ""

    def press(self, request_id: str, robot: str) -> str:
        """Give a stop; returns the request id to send it with, the old one while nobody has answered it.

        The robot does what is asked with one request id once. If that was answered and the robot does not say that it
        is stopped, it may have stopped and been reset by somebody else: another press is another stop.

        `robot` is the run of the robot's process that tells its status now, "" if none does.
        """
        if self.phase is not Phase.SENT or self.answer:
            self.begin(request_id)
            self._robot = robot or self._robot
        return self.request_id

    def begin(self, request_id: str) -> None:
        """It is sent from now on with this request id."""
        self.phase, self.request_id, self.tries, self.answer = Phase.SENT, request_id, 0, ""

    def tried(self, request_id: str, tries: int) -> None:
        """It was sent once more."""
        if request_id == self.request_id:
            self.tries = max(self.tries, tries)

    def answered(self, request_id: str, answer: str, now_s: float) -> bool:
        """Somebody has answered it; whether this is the first answer."""
        if request_id != self.request_id or self.answer:
            return False
        self.answer, self._answered_s = answer, now_s
        return True

    def status(self, state: int, robot: str) -> None:
        """The robot has told its state; `robot` tells one run of its process from the next."""
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
        """The operator no longer wants it."""
        self.phase = Phase.OFF
        self.changes.clear()

    def line(self, now_s: float, state: str) -> OrderLine | None:
        """How it stands; `state` is the robot's as shown, "" when none is there."""
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
    """An order other than the emergency stop: sent `tries` times of `most`, and what came of it once that is known."""

    name: str
    title: str
    most: int
    at_s: float
    tries: int = 1
    word: OrderLine | None = None
    accepted: bool = False
    answered: bool = False

    def line(self, now_s: float) -> OrderLine:
        """How it stands."""
        if self.word is not None:
            return self.word
        if self.most > 1:
            return OrderLine(INFO, f"{self.title} sent {self.tries}/{self.most}")
        waited_s = math.floor(now_s - self.at_s)
        return OrderLine(INFO, f"{self.title} sent, no answer for {waited_s} s" if waited_s else f"{self.title} sent")


@dataclass
class OrderBook:
    """Every order given here, the last of each name."""

    stop: StopLatch = field(default_factory=StopLatch)
    _orders: dict[str, Placed] = field(default_factory=dict)
    _said: tuple[OrderLine, float] | None = None

    def place(self, name: str, title: str, most: int, now_s: float) -> None:
        """An order goes out; it is sent up to `most` times."""
        self._orders[name] = Placed(name, title, most, now_s)

    def under_way(self, name: str) -> bool:
        """Whether the last order of this name is still without an answer."""
        return name in self._orders and self._orders[name].word is None

    def tried(self, name: str, tries: int) -> None:
        """It was sent for the n-th time."""
        if name in self._orders:
            self._orders[name].tries = tries

    def done(self, name: str, word: OrderLine, *, accepted: bool, answered: bool, now_s: float) -> None:
        """The last word on an order; `answered` tells a refusal from silence."""
        order = self._orders.get(name)
        if order is not None:
            order.word, order.accepted, order.answered, order.at_s = word, accepted, answered, now_s

    def latest(self, name: str) -> Placed | None:
        """The last order of this name."""
        return self._orders.get(name)

    def say(self, severity: int, text: str, now_s: float) -> None:
        """Something about an order that was not sent."""
        self._said = OrderLine(severity, text), now_s

    def accepted_within(self, name: str, seconds: float, now_s: float) -> bool:
        """Whether the last order of this name was accepted so recently that the status may not tell of it yet."""
        order = self._orders.get(name)
        return order is not None and order.accepted and now_s - order.at_s <= seconds

    def line(self, now_s: float, state: str, *, running: bool) -> OrderLine | None:
        """The one line on the orders: the emergency stop first, then a stop under way, then the latest."""
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
