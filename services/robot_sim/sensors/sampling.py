"""All of a tick's sensing in one kernel: measure, take a position when it is time, and carry the messages over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.arrays import copy
from touchline.services.core.jit import kernel
from touchline.services.core.random import STREAM_RECEIVER, uniform
from touchline.services.onboard.interface import TICKS_PER_S
from touchline.services.robot_sim.sensors.fast import FastSensors, measure
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.receiver import Receiver, take
from touchline.services.robot_sim.sensors.transport import (
    HISTORY,
    Transport,
    carry,
    collect,
    latency_ticks,
    post,
)
from touchline.services.robot_sim.sensors.zones import Zones

Floats = NDArray[np.float64]


class Sensing(NamedTuple):
    """All that the sensors of a robot keep and read; records as (1,) arrays."""

    fast: Sequence[FastSensors]
    receiver: Sequence[Receiver]
    transport: Sequence[Transport]
    steel: Zones
    """Of `SteelPlace`."""
    sky: Zones
    """Of `SkyPlace`."""


@kernel
def sense(moment: Moment, sensing: Sensing) -> int:
    """Sense the world at the end of a tick.

    Args:
        moment: That end.
        sensing: Of the robot, updated.

    Returns:
        How many reports of the receiver arrived.
    """
    tick, receiver, transport = moment.tick, sensing.receiver, sensing.transport
    history, f = transport[0].history, receiver[0].figures
    readings = history[tick % HISTORY]
    copy(history[(tick - 1) % HISTORY], readings)
    measure(moment, sensing.fast, sensing.steel, readings)
    for sensor in range(3):
        carry(moment, sensor, transport)
    if tick % f.period_ticks == 0:
        take(moment, receiver, sensing.sky)
        delay, again = latency_ticks(moment, 0)
        # Between ticks nothing arrives: the latency is rounded up, and jitter is that of whole ticks.
        arrival = tick + math.ceil(f.latency_s * TICKS_PER_S - 1e-7)
        arrival += int((f.jitter_s * TICKS_PER_S + 1.0) * uniform(moment.seed, STREAM_RECEIVER, tick, 3))
        if delay >= 0:
            post(transport, receiver[0].report, arrival + delay)
        if again >= 0:
            post(transport, receiver[0].report, arrival + again)
    count: int = collect(transport, tick)
    return count


@kernel
def stand_by(moment: Moment, last_tick: int, sensing: Sensing) -> None:
    """Let the sensors live through ticks in which the robot stands and nobody listens.

    Args:
        moment: The end of the first of them.
        last_tick: The last one.
        sensing: Of the robot, updated.
    """
    for tick in range(moment.tick, last_tick + 1):
        sense(Moment(moment.state, moment.effects, moment.seed, tick), sensing)
