"""Sensor transport model: delay, duplication, reordering and loss.

A 100 Hz sensor's newest arrival replaces what the computer had of it, even if it is older: that is what a driver
without a look at the stamps does, and why frames say how old a sample is. GNSS fixes are all handed over.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.core.random import STREAM_TRANSPORT, uniform
from touchline.services.robot_sim.world import effects as e

LONGEST_TICKS: Final = 2000
HISTORY: Final = 2048
"""Ticks of 100 Hz samples kept; more than the longest way."""
PENDING: Final = 1024
"""GNSS messages under way at most."""
ARRIVALS: Final = 64
"""GNSS messages that can arrive in one tick; more wait for the next."""

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def way(effects: Floats, sensor: int, seed: int, tick: int) -> tuple[int, int]:
    """Ticks after `tick` in which the message arrives and arrives again; −1 for never."""
    row = e.MESSAGES + e.PER_SENSOR * sensor
    if effects[row + e.LOST_SHARE] > 0.0 and (
        uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor) < effects[row + e.LOST_SHARE]
    ):
        return -1, -1
    delay = effects[row + e.LATE_TICKS]
    if effects[row + e.SPREAD_TICKS] > 0.0:
        delay += (effects[row + e.SPREAD_TICKS] + 1.0) * uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor + 1)
    first = min(int(delay), LONGEST_TICKS)
    if effects[row + e.AGAIN_SHARE] > 0.0 and (
        uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor + 2) < effects[row + e.AGAIN_SHARE]
    ):
        return first, min(first + int(effects[row + e.AGAIN_TICKS]), LONGEST_TICKS)
    return first, -1


@kernel
def carry(
    effects: Floats,
    sensor: int,
    first: int,
    last: int,
    history: Floats,
    schedule: Integers,
    measured_tick: Integers,
    seed: int,
    tick: int,
    readings: Floats,
) -> bool:
    """Send this tick's sample of a 100 Hz sensor on its way and take in what arrives; whether something did.

    Args:
        effects: (effects.SIZE,) what faults do.
        sensor: Index in `effects.SENSORS`; row `sensor - 1` of `schedule` and `measured_tick` is its own.
        first: Column of `history` and `readings` where its values begin.
        last: One beyond their end.
        history: (HISTORY, READINGS) samples by tick; this tick's is already there.
        schedule: (3, HISTORY) the tick of the sample that arrives in a tick, or −1.
        measured_tick: (3,) when the sample in `readings` was measured, updated.
        seed: Of the scenario.
        tick: This tick.
        readings: (READINGS,) what the computer has, updated.
    """
    row = sensor - 1
    delay, again = way(effects, sensor, seed, tick)
    if delay >= 0:
        schedule[row, (tick + delay) % HISTORY] = tick
    if again >= 0:
        schedule[row, (tick + again) % HISTORY] = tick
    sample = schedule[row, tick % HISTORY]
    if sample < 0:
        return False
    schedule[row, tick % HISTORY] = -1
    measured_tick[row] = sample
    for column in range(first, last):
        readings[column] = history[sample % HISTORY, column]
    return True


@kernel
def post(pending: Floats, counts: Integers, message: Floats, arrival_tick: int) -> None:
    """Put a GNSS message under way; it is lost if there are far too many."""
    if counts[0] >= PENDING:
        return
    row = pending[counts[0]]
    row[0] = arrival_tick
    for column in range(len(message)):
        row[column + 1] = message[column]
    counts[0] += 1


@kernel
def collect(pending: Floats, counts: Integers, tick: int, arrivals: Floats) -> int:
    """Move the GNSS messages that are due into `arrivals` (ARRIVALS, …), oldest sent first; their number."""
    arrived, kept = 0, 0
    for index in range(counts[0]):
        if pending[index, 0] <= tick and arrived < ARRIVALS:
            for column in range(arrivals.shape[1]):
                arrivals[arrived, column] = pending[index, column + 1]
            arrived += 1
        else:
            if kept != index:
                for column in range(pending.shape[1]):
                    pending[kept, column] = pending[index, column]
            kept += 1
    counts[0] = kept
    return arrived
