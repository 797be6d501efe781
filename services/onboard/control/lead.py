"""How far ahead of time a command has to be given."""

from __future__ import annotations

from touchline.services.onboard.interface import TICK_S

MAX_LEAD_TICKS = 25


def lead_ticks(lag_s: float) -> int:
    """How many ticks ahead of time a steadily changing speed must be commanded to come true: the actuators' lag.

    The mean of that tick, not its start, is what its command stands for: that makes up for the command being held.
    """
    return min(round(lag_s / TICK_S), MAX_LEAD_TICKS)
