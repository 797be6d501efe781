"""Lead of the feed-forward, which compensates the lag of the actuators."""

from __future__ import annotations

from touchline.onboard.interface import TICK_S

MAX_LEAD_TICKS = 25


def lead_ticks(lag_s: float) -> int:
    """Return the lead of the feed-forward in ticks for actuators of this time constant [s].

    A first-order actuator follows a steadily changing command late by its time constant. Holding a command for a tick
    needs no lead of its own: the command is the mean of the reference over its tick, not the value at the start.
    """
    return min(round(lag_s / TICK_S), MAX_LEAD_TICKS)
