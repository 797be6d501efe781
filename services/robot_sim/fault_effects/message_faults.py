"""Faults of one sensor's messages in transit."""

from __future__ import annotations

from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas import faults as f
from touchline.schemas.plugins import SENSORS
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def messages_late(fault: f.MessagesLate, effects: Effects, _acting: Acting) -> None:
    """Delay messages: delays add up; see `ApplyFault`."""
    effects.messages.late_ticks[SENSORS.number(fault.sensor)] += _ticks(fault.delay_s)


def messages_reordered(fault: f.MessagesReordered, effects: Effects, _acting: Acting) -> None:
    """Delay messages at random: the longest spread counts; see `ApplyFault`."""
    sensor, spread = SENSORS.number(fault.sensor), effects.messages.spread_ticks
    spread[sensor] = max(spread[sensor], _ticks(fault.spread_s))


def messages_lost(fault: f.MessagesLost, effects: Effects, _acting: Acting) -> None:
    """Lose messages: the largest share counts; see `ApplyFault`."""
    sensor, lost = SENSORS.number(fault.sensor), effects.messages.lost_share
    lost[sensor] = max(lost[sensor], fault.share)


def messages_duplicated(fault: f.MessagesDuplicated, effects: Effects, _acting: Acting) -> None:
    """Repeat messages: the largest share counts, and the longest time; see `ApplyFault`."""
    messages, sensor = effects.messages, SENSORS.number(fault.sensor)
    messages.again_share[sensor] = max(messages.again_share[sensor], fault.share)
    messages.again_ticks[sensor] = max(messages.again_ticks[sensor], _ticks(fault.after_s))


def _ticks(seconds: float) -> float:
    """Return whole ticks, at least one for anything above zero."""
    return float(max(round(seconds * TICKS_PER_S), 1)) if seconds > 0.0 else 0.0
