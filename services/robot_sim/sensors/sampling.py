"""All of a tick's sensing in one kernel: measure, take a position when it is time, and carry the messages over."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.core.random import STREAM_RECEIVER, uniform
from touchline.services.onboard.interface import ANGLES, GYRO, MAG, READINGS, TICKS_PER_S
from touchline.services.robot_sim.sensors import receiver, transport
from touchline.services.robot_sim.sensors.fast import measure
from touchline.services.robot_sim.sensors.receiver import take
from touchline.services.robot_sim.sensors.transport import carry, collect, post, way

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def sense(
    world: Floats,
    effects: Floats,
    seed: int,
    tick: int,
    sensor: Floats,
    p: Floats,
    steel: Floats,
    steel_vertices: Floats,
    history: Floats,
    schedule: Integers,
    gnss: Floats,
    r: Floats,
    frame: Floats,
    sky: Floats,
    sky_vertices: Floats,
    pending: Floats,
    counts: Integers,
    readings: Floats,
    measured_tick: Integers,
    arrived: Integers,
    arrivals: Floats,
) -> int:
    """Sense the world at the end of a tick.

    Args:
        world: The truth, as of `body`.
        effects: (effects.SIZE,) what faults do.
        seed: Of the scenario.
        tick: Onboard tick.
        sensor: (fast.STATE_SIZE,) state of the 100 Hz sensors.
        p: (fast.PARAMETER_SIZE,) their figures.
        steel: (n, places.COLUMNS) magnetic places: field [T], reach [m].
        steel_vertices: (m, 2) their outlines [m].
        history: (transport.HISTORY, interface.READINGS) what was measured, by tick.
        schedule: (3, transport.HISTORY) what arrives when.
        gnss: (receiver.STATE_SIZE,) state of the receiver.
        r: (receiver.PARAMETERS,) its figures.
        frame: The map's tangent plane.
        sky: (n, places.COLUMNS) obstructions: best solution, margin [m], noise factor.
        sky_vertices: (m, 2) their outlines [m].
        pending: (transport.PENDING, 1 + receiver.COLUMNS) reports under way.
        counts: (1,) how many.
        readings: (interface.READINGS,) what the computer has of the 100 Hz sensors, updated.
        measured_tick: (3,) when that was measured, updated.
        arrived: (3,) filled: whether something of that sensor arrived in this tick.
        arrivals: (transport.ARRIVALS, receiver.COLUMNS) filled with the reports that arrived.

    Returns:
        How many reports arrived.
    """
    now = history[tick % transport.HISTORY]
    before = history[(tick - 1) % transport.HISTORY]
    for column in range(READINGS):
        now[column] = before[column]
    measure(world, sensor, p, steel, steel_vertices, effects, seed, tick, now)
    bounds = (GYRO, MAG, ANGLES, READINGS)
    for index in range(3):
        arrived[index] = carry(
            effects,
            index + 1,
            bounds[index],
            bounds[index + 1],
            history,
            schedule,
            measured_tick,
            seed,
            tick,
            readings,
        )
    if tick % int(r[receiver.R_PERIOD_TICKS]) == 0:
        report = np.empty(receiver.COLUMNS)
        take(world, gnss, r, frame, sky, sky_vertices, effects, seed, tick, report)
        delay, again = way(effects, 0, seed, tick)
        # Between ticks nothing arrives: the latency is rounded up, and jitter is that of whole ticks.
        arrival = tick + math.ceil(r[receiver.R_LATENCY_S] * TICKS_PER_S - 1e-7)
        arrival += int((r[receiver.R_JITTER_S] * TICKS_PER_S + 1.0) * uniform(seed, STREAM_RECEIVER, tick, 3))
        if delay >= 0:
            post(pending, counts, report, arrival + delay)
        if again >= 0:
            post(pending, counts, report, arrival + again)
    count: int = collect(pending, counts, tick, arrivals)
    return count


@kernel
def stand_by(state: Floats, effects: Floats, seed: int, first_tick: int, last_tick: int, sensing: Any) -> None:
    """Let the sensors live through ticks, first and last included, in which the robot stands and nobody listens.

    Args:
        state: Of the world.
        effects: Of faults.
        seed: Of the scenario.
        first_tick: See above, as `last_tick`.
        last_tick: See `first_tick`.
        sensing: What `sense` is given from the sensors' own.
    """
    for tick in range(first_tick, last_tick + 1):
        sense(state, effects, seed, tick, *sensing)
