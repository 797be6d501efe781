"""Sensor transport model: delay, duplication, reordering and loss.

A 100 Hz sensor's newest arrival replaces what the computer had of it, even if it is older: that is what a driver
without a look at the stamps does, and why frames say how old a sample is. Positions, of a receiver or a camera, are all
handed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.core.random import STREAM_TRANSPORT, uniform
from touchline.core.records import Record
from touchline.onboard.interface import ANGLES, GYRO, MAG, READINGS
from touchline.schemas.plugins import SENSORS
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.position_report import COLUMNS

LONGEST_TICKS: Final = 2000
HISTORY: Final = 2048
"""Ticks of 100 Hz samples kept; more than the longest delay."""
PENDING: Final = 1024
"""Position reports under way at most."""
ARRIVALS: Final = 64
"""Position reports that can arrive in one tick; more wait for the next."""

_FIRST_FAST: Final = SENSORS.number("imu")
"""Number of the first 100 Hz sensor; magnetometer and encoders are the next."""
_FIRST: Final = (GYRO, MAG, ANGLES)  # of each 100 Hz sensor's readings, up to the next one's

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Transport(Record):
    """What is under way from the sensors to the computer, and what has arrived.

    An array of three has IMU, magnetometer, encoders.
    """

    history: Annotated[Floats, HISTORY, READINGS]
    """What the 100 Hz sensors measured, by tick, laid out as in `interface`."""
    schedule: Annotated[Integers, 3, HISTORY]
    """The tick of the sample that arrives in a tick, or −1."""
    pending: Annotated[Floats, PENDING, 1 + COLUMNS]
    """Position reports, each after the tick in which it arrives."""
    pending_count: int
    readings: Annotated[Floats, READINGS]
    """What the computer has of the 100 Hz sensors."""
    measured_tick: Annotated[Integers, 3]
    """When that was measured."""
    arrived: Annotated[Integers, 3]
    """Whether something of that sensor arrived in the last tick."""
    arrivals: Annotated[Floats, ARRIVALS, COLUMNS]
    """Reports that arrived in it."""


@kernel
def latency_ticks(moment: Moment, sensor: int) -> tuple[int, int]:
    """Ticks after the moment's in which the message of a sensor arrives and arrives again; −1 for never.

    Args:
        moment: When it is sent.
        sensor: Number of it in `SENSORS`.
    """
    seed, tick, effects = moment.seed, moment.tick, moment.effects[0].messages
    lost, spread, again = effects.lost_share[sensor], effects.spread_ticks[sensor], effects.again_share[sensor]
    if lost > 0.0 and uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor) < lost:
        return -1, -1
    delay = effects.late_ticks[sensor]
    if spread > 0.0:
        delay += (spread + 1.0) * uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor + 1)
    first = min(int(delay), LONGEST_TICKS)
    if again > 0.0 and uniform(seed, STREAM_TRANSPORT, tick, 3 * sensor + 2) < again:
        return first, min(first + int(effects.again_ticks[sensor]), LONGEST_TICKS)
    return first, -1


@kernel
def carry(moment: Moment, sensor: int, transport: Sequence[Transport]) -> None:
    """Send the moment's sample of a 100 Hz sensor off and take in what arrives.

    Args:
        moment: The end of this tick.
        sensor: 0 IMU, 1 magnetometer, 2 encoders.
        transport: (1,) with the sample in its `history`; all else of that sensor is updated.
    """
    t, tick = transport[0], moment.tick
    delay, again = latency_ticks(moment, _FIRST_FAST + sensor)
    if delay >= 0:
        t.schedule[sensor, (tick + delay) % HISTORY] = tick
    if again >= 0:
        t.schedule[sensor, (tick + again) % HISTORY] = tick
    sample = t.schedule[sensor, tick % HISTORY]
    t.arrived[sensor] = sample >= 0
    if sample < 0:
        return
    t.schedule[sensor, tick % HISTORY] = -1
    t.measured_tick[sensor] = sample
    end = _FIRST[sensor + 1] if sensor + 1 < len(_FIRST) else len(t.readings)
    for column in range(_FIRST[sensor], end):
        t.readings[column] = t.history[sample % HISTORY, column]


@kernel
def post(transport: Sequence[Transport], report: Floats, arrival_tick: int) -> None:
    """Put a position report under way; it is lost if there are far too many.

    Args:
        transport: (1,) its `pending` are appended to.
        report: (COLUMNS,) of `position_report`.
        arrival_tick: In which it arrives.
    """
    t = transport[0]
    if t.pending_count >= PENDING:
        return
    row = t.pending[t.pending_count]
    row[0] = arrival_tick
    copy(report, row[1:])
    t.pending_count += 1


@kernel
def collect(transport: Sequence[Transport], tick: int) -> int:
    """Move the reports that are due from `pending` into `arrivals`, oldest sent first; returns their number.

    Args:
        transport: (1,) updated.
        tick: In which they arrive.
    """
    t, arrived, kept = transport[0], 0, 0
    for index in range(t.pending_count):
        row = t.pending[index]
        if row[0] <= tick and arrived < ARRIVALS:
            copy(row[1:], t.arrivals[arrived])
            arrived += 1
        else:
            if kept != index:
                copy(row, t.pending[kept])
            kept += 1
    t.pending_count = kept
    return arrived
