"""Waiting of a robot that stands before something: for it to go, for its operator, and then no longer."""

from enum import Enum, auto
from typing import Final, NamedTuple

from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.protection.protector import Blocked


class Patience(NamedTuple):
    """Times for which a robot waits, s."""

    standing_s: float = 2.0
    """Before something that has not moved since."""
    moving_s: float = 5.0
    """After the last motion of something that moves."""
    answer_s: float = 15.0
    """For an answer of the operator, if there is one; without an operator nobody is asked."""


PATIENT: Final = Patience()
GONE_TICKS: Final = 3 * TICKS_PER_S
"""Ticks after which what was in the way has gone: sooner the robot has not moved off, and it may only seem so."""


class WaitingOrder(Enum):
    """Order of an operator to a robot that waits before something."""

    WAIT = auto()
    """Wait until it has gone."""
    GO_ROUND = auto()
    """Go round it now."""
    LEAVE_OUT = auto()
    """Go round it now, and leave out for good what cannot be painted beside it."""


class Waiting:
    """Wait before what is in the way now; one object for all of a job.

    Args:
        patience: The times.
    """

    def __init__(self, patience: Patience) -> None:
        self._patience = patience
        self._begun: int | None = None
        self._moved = self._blocked = 0
        self.answer: WaitingOrder | None = None

    def look(self, tick: int, blocked: Blocked | None, *, attended: bool) -> WaitingOrder | None:
        """Return what to do now: go round, or leave out; None: drive, or wait.

        Args:
            tick: Present tick.
            blocked: Report of the robot; None: nothing is in its way.
            attended: True if an operator can answer.
        """
        if tick > self._blocked + GONE_TICKS:
            self._begun = self.answer = None
        if blocked is None:
            return None
        self._blocked = tick
        if self._begun is None:
            self._begun, self._moved = blocked.since_tick, -1
        if blocked.moving:
            self._moved = tick
        if self.answer is not None:
            return None if self.answer is WaitingOrder.WAIT else self.answer
        return WaitingOrder.GO_ROUND if tick >= self.until_tick(attended=attended) else None

    @property
    def begun_tick(self) -> int:
        """Tick since which it waits; 0 before the first wait."""
        return self._begun or 0

    def until_tick(self, *, attended: bool) -> int:
        """Return the tick at which the robot goes round what it waits for; 0: it waits until that has gone.

        Args:
            attended: True if an operator can answer.
        """
        if self._begun is None or self.answer is WaitingOrder.WAIT:
            return 0
        moved = self._moved >= 0
        since, wait_s = (self._moved, self._patience.moving_s) if moved else (self._begun, self._patience.standing_s)
        answered_s = self._patience.answer_s if attended else 0.0
        return round(max(since + wait_s * TICKS_PER_S, self._begun + answered_s * TICKS_PER_S))
