"""Sim time of a robot by its messages: their arrival times, at any pace and beside any other robots."""

from typing import Final

ANEW_NS: Final = 2_000_000_000
"""A clock that steps back further was restarted."""
_AHEAD_NS: Final = 1_000_000_000
"""A stamp further ahead of the clock is not the robot's."""


class RobotTime:
    """One robot's sim time; see `recorder` for the rule.

    Attributes:
        now_ns: Latest sim time of the clock (of any stamp, while no clock has come).
        latest_ns: Latest of the clock and of the stamps before.
        past_ns: Log time minus sim time: what passed before the clock restarted.
        known: Whether any time has come.
    """

    __slots__ = ("clock_seen", "known", "latest_ns", "now_ns", "past_ns")

    def __init__(self) -> None:
        self.now_ns = self.latest_ns = self.past_ns = 0
        self.known = self.clock_seen = False

    @property
    def log_ns(self) -> int:
        """Log time at the latest sim time."""
        return self.latest_ns + self.past_ns

    def hear(self, stamp_ns: int, is_clock: bool) -> None:
        """Take a stamp, the clock's or another."""
        if is_clock:
            self.clock_seen = True
            self.now_ns = stamp_ns
        elif not self.clock_seen:
            self.now_ns = stamp_ns
        ahead_ns = stamp_ns - self.latest_ns
        if is_clock and ahead_ns < -ANEW_NS:
            self.past_ns -= ahead_ns
            self.latest_ns = stamp_ns
        elif ahead_ns > 0 and (is_clock or not self.clock_seen or ahead_ns <= _AHEAD_NS):
            self.latest_ns = stamp_ns
