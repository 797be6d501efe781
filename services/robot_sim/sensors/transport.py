"""Sensor transport model: delay, duplication, reordering and loss.

The newest arrival of a 100 Hz sensor replaces the reading that the computer had, even if it was measured earlier: a
driver that does not look at stamps does the same, so frames say how old a sample is. Position reports, of a GNSS
receiver or a camera, are all handed over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.core.random import STREAM_TRANSPORT, uniform
from touchline.core.records import Record
from touchline.onboard.interface import FIRST_READINGS, READINGS, SAMPLED, TICKS_PER_S
from touchline.schemas.plugins import SENSORS
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.position_report import COLUMNS

LONGEST_TICKS: Final = 2000
"""Longest delay by faults."""
HISTORY: Final = 2048
"""Ticks of 100 Hz samples kept; more than the longest delay."""
PENDING: Final = 1024
"""Position reports under way at most."""
ARRIVALS: Final = 64
"""Position reports that can arrive in one tick; more wait for the next."""

_NUMBERS: Final = tuple(map(SENSORS.number, SAMPLED))
_SENSORS: Final = len(SAMPLED)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Transport(Record):
    """Messages under way from the sensors to the computer, and the readings that have arrived.

    Arrays by sensor are in the order of `interface.SAMPLED`.
    """

    history: Annotated[Floats, HISTORY, READINGS]
    """Readings of the 100 Hz sensors by the tick of measurement, laid out as in `interface`."""
    schedule: Annotated[Integers, _SENSORS, HISTORY]
    """Tick of the sample that arrives in a tick, or −1, by sensor."""
    pending: Annotated[Floats, PENDING, 1 + COLUMNS]
    """Position reports under way: tick of arrival, then columns of `position_report`."""
    pending_count: int
    readings: Annotated[Floats, READINGS]
    """Readings of the 100 Hz sensors that the computer has."""
    measured_tick: Annotated[Integers, _SENSORS]
    """Tick in which those were measured, by sensor."""
    arrived: Annotated[Integers, _SENSORS]
    """1 for a sensor of which a sample arrived in the last tick, else 0."""
    arrivals: Annotated[Floats, ARRIVALS, COLUMNS]
    """Position reports that arrived in the last tick."""


@kernel
def latency_ticks(moment: Moment, sensor: int) -> tuple[int, int]:
    """Return by how many ticks faults delay a message of a sensor, and by how many it arrives again; −1 for never.

    Args:
        moment: End of the tick in which it is sent.
        sensor: Number of the sensor in `SENSORS`.
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
    """Send a sample of a 100 Hz sensor, and receive the one that arrives.

    Args:
        moment: End of the tick.
        sensor: Place of the sensor in `interface.SAMPLED`.
        transport: (1,) state with the sample in its `history`; all else of that sensor is updated.
    """
    t, tick = transport[0], moment.tick
    delay, again = latency_ticks(moment, _NUMBERS[sensor])
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
    end = FIRST_READINGS[sensor + 1] if sensor + 1 < _SENSORS else len(t.readings)
    for column in range(FIRST_READINGS[sensor], end):
        t.readings[column] = t.history[sample % HISTORY, column]


@kernel
def usual_arrival(tick: int, latency_s: float, jitter_s: float, drawn: float) -> int:
    """Return the tick in which a report arrives without faults; the latency is rounded up, and jitter is whole ticks.

    Args:
        tick: Tick in which it is sent.
        latency_s: Latency [s].
        jitter_s: Most that is added to it [s].
        drawn: Share of the jitter, 0…1.
    """
    arrival: int = tick + math.ceil(latency_s * TICKS_PER_S - 1e-7) + int((jitter_s * TICKS_PER_S + 1.0) * drawn)
    return arrival


@kernel
def send(moment: Moment, sensor: int, report: Floats, usual_tick: int, transport: Sequence[Transport]) -> None:
    """Send a position report.

    Args:
        moment: End of the tick in which it is sent.
        sensor: Number of the sensor in `SENSORS`.
        report: (COLUMNS,) numbers of `position_report`.
        usual_tick: Tick in which it arrives without faults.
        transport: (1,) state; `pending` is updated.
    """
    delay, again = latency_ticks(moment, sensor)
    if delay >= 0:
        _post(transport, report, usual_tick + delay)
    if again >= 0:
        _post(transport, report, usual_tick + again)


@kernel
def _post(transport: Sequence[Transport], report: Floats, arrival_tick: int) -> None:
    """Append a report to `pending`; it is lost if there is no room."""
    t = transport[0]
    if t.pending_count >= PENDING:
        return
    row = t.pending[t.pending_count]
    row[0] = arrival_tick
    copy(report, row[1:])
    t.pending_count += 1


@kernel
def collect(transport: Sequence[Transport], tick: int) -> int:
    """Move the position reports that are due from `pending` into `arrivals`, in the order in which they were sent.

    Args:
        transport: (1,) state, updated.
        tick: Tick of arrival.

    Returns:
        Number of reports that arrived.
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
