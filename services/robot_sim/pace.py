"""Pace of the ticks by the wall clock: N× real time, as fast as possible, or held."""

from __future__ import annotations

from typing import Final

from touchline.onboard.interface import TICK_S, TICKS_PER_S

LONGEST_SLICE_S: Final = 0.01
"""Interval at which commands are served, also when ticks run as fast as possible."""
SHORTEST_WAIT_S: Final = 0.002
"""Faster than real time several ticks are run at once rather than each when it is due, which costs half as much."""
UNLIMITED: Final = 1 << 30
FORGIVEN_S: Final = 0.25
"""Default lag beyond which a loop that stood still does not catch up."""


class Pacer:
    """Source of ticks by the wall clock; monotonic wall time is an argument, the clock is never read.

    Args:
        factor: Sim time per wall time: N is N× real time, 0 holds, negative is as fast as possible.
        now_s: Monotonic wall time.

    Attributes:
        stride: Ticks are handed out up to multiples of this.
        forgiven_s: Lag beyond which the pace starts anew.
    """

    def __init__(self, factor: float, now_s: float) -> None:
        self.factor, self.stride, self.forgiven_s = factor, 1, FORGIVEN_S
        self._anchor_s = now_s
        self._given = 0

    def set_factor(self, factor: float, now_s: float) -> None:
        """Change the pace from now on; however often that is done, the part of a tick that has passed is kept."""
        begun = max((now_s - self._anchor_s) * self.factor / TICK_S - self._given, 0.0)
        self.factor = factor
        self.restart(now_s)
        if factor > 0.0:
            self._anchor_s -= min(begun, 1.0) * TICK_S / factor

    def restart(self, now_s: float) -> None:
        """Begin to count anew: time until now is not caught up with."""
        self._anchor_s, self._given = now_s, 0

    def due(self, now_s: float, tick: int = 0) -> int:
        """Return the number of ticks that should run now, after `tick` so far; they count as run."""
        if self.factor < 0.0:
            return UNLIMITED
        wanted = int((now_s - self._anchor_s) * self.factor / TICK_S + 1e-6)
        wanted -= (tick + wanted - self._given) % self.stride
        ticks = wanted - self._given
        if ticks <= 0:
            return 0
        if ticks * TICK_S > self.forgiven_s * max(self.factor, 1.0):
            self.restart(now_s)
            return 1
        self._given = wanted
        return ticks

    def give_back(self, ticks: int) -> None:
        """Return ticks that there was no time to run."""
        if self.factor >= 0.0:
            self._given -= ticks

    def wait_s(self, now_s: float, longest_s: float = LONGEST_SLICE_S) -> float:
        """Return the wall time until the next ticks are due, at most `longest_s`."""
        if self.factor < 0.0:
            return 0.0
        if self.factor == 0.0:
            return longest_s
        due_s = self._anchor_s + (self._given + self.stride) * TICK_S / self.factor
        wait_s = due_s - now_s
        if wait_s <= 0.0:
            return 0.0
        return min(max(wait_s, SHORTEST_WAIT_S if self.factor > 1.0 else 0.0), longest_s)


class RateMeter:
    """Meter of sim time per wall time, over about the last second."""

    def __init__(self) -> None:
        """Begin without a measurement."""
        self.real_time_factor = 0.0
        self._since = (0.0, 0)

    def note(self, now_s: float, ticks: int) -> None:
        """Enter the ticks so far, and the monotonic wall time."""
        since_s, since_ticks = self._since
        if now_s - since_s < 1.0:
            return
        if since_s > 0.0:
            self.real_time_factor = (ticks - since_ticks) / TICKS_PER_S / (now_s - since_s)
        self._since = (now_s, ticks)
