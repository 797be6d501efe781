"""All of a tick's sensing in one kernel: measure, take a position when it is time, and carry the messages over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.core.random import STREAM_CAMERA, STREAM_RECEIVER, uniform
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.plugins import SENSORS
from touchline.services.robot_sim.sensors import camera as overhead
from touchline.services.robot_sim.sensors.camera import Camera
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
    camera: Sequence[Camera]
    transport: Sequence[Transport]
    steel: Zones
    """Of `SteelPlace`."""
    sky: Zones
    """Of `SkyPlace`."""


_OF_RECEIVER = SENSORS.number("gnss")
_OF_CAMERA = SENSORS.number("camera")
_JITTER = 3  # channel of STREAM_RECEIVER


@kernel
def _send(moment: Moment, sensor: int, report: Floats, usual_tick: int, transport: Sequence[Transport]) -> None:
    """Put a report under way that arrives in `usual_tick`, but for what faults do to messages of that sensor."""
    delay, again = latency_ticks(moment, sensor)
    if delay >= 0:
        post(transport, report, usual_tick + delay)
    if again >= 0:
        post(transport, report, usual_tick + again)


@kernel
def _arrival(tick: int, latency_s: float, jitter_s: float, drawn: float) -> int:
    """The tick in which a report of this tick arrives by its latency and a share of its jitter.

    Between ticks nothing arrives: the latency is rounded up, and jitter is that of whole ticks.
    """
    arrival: int = tick + math.ceil(latency_s * TICKS_PER_S - 1e-7) + int((jitter_s * TICKS_PER_S + 1.0) * drawn)
    return arrival


@kernel
def sense(moment: Moment, sensing: Sensing) -> int:
    """Sense the world at the end of a tick.

    Args:
        moment: That end.
        sensing: Of the robot, updated.

    Returns:
        How many position reports arrived.
    """
    seed, tick, transport = moment.seed, moment.tick, sensing.transport
    receiver, camera = sensing.receiver, sensing.camera
    history, f, seen = transport[0].history, receiver[0].figures, camera[0].figures
    readings = history[tick % HISTORY]
    copy(history[(tick - 1) % HISTORY], readings)
    measure(moment, sensing.fast, sensing.steel, readings)
    for sensor in range(3):
        carry(moment, sensor, transport)
    if f.period_ticks > 0 and tick % f.period_ticks == 0:
        take(moment, receiver, sensing.sky)
        arrival = _arrival(tick, f.latency_s, f.jitter_s, uniform(seed, STREAM_RECEIVER, tick, _JITTER))
        _send(moment, _OF_RECEIVER, receiver[0].report, arrival, transport)
    if overhead.due(tick, camera) and overhead.find(moment, camera):
        arrival = _arrival(tick, seen.latency_s, seen.jitter_s, uniform(seed, STREAM_CAMERA, tick, overhead.LATE))
        _send(moment, _OF_CAMERA, camera[0].report, arrival, transport)
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
