"""Lead of the feed-forward, which makes up for the lag of the actuators."""

from __future__ import annotations

from touchline.onboard.interface import TICK_S

MAX_LEAD_TICKS = 25


def lead_ticks(lag_s: float) -> int:
    """By how many ticks the feed-forward is to be ahead for actuators of this time constant [s].

    A first-order actuator follows a steadily changing command late by its time constant. That a command is held for a
    tick needs no lead of its own: it is the mean of the reference over its tick, not the value at the start.
    """
    return min(round(lag_s / TICK_S), MAX_LEAD_TICKS)
