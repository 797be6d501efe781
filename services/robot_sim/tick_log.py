"""Tick log: one row of numbers per tick, kept until it is published, whichever code ran the tick."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import interface
from touchline.schemas import topics
from touchline.schemas.topics import Topic
from touchline.services.robot_sim.sensors import position_report
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.physics import HeldCommand

TICK: Final = 0
MEASURED: Final = 1  # tick in which the newest sample of each of `SAMPLED` was measured; −1: none arrived
ESTIMATE: Final = MEASURED + len(interface.SAMPLED)  # east, north, heading, speed, yaw rate
SPEED: Final = ESTIMATE + 3
COVARIANCE: Final = ESTIMATE + 5  # of east, north, heading, row by row
TWIST_COVARIANCE: Final = COVARIANCE + 9  # of speed and yaw rate, row by row
TRUTH: Final = TWIST_COVARIANCE + 4  # east, north, heading, speed, yaw rate
SPRAYER: Final = TRUTH + 5  # valve commanded, open, disc commanded, down (0 or 1 each), flow [l/s]
FLOW_LPS: Final = SPRAYER + 4
TANK_L: Final = SPRAYER + 5
BATTERY_WH: Final = TANK_L + 1
POWER_W: Final = BATTERY_WH + 1
CONSISTENCY: Final = POWER_W + 1  # as `Consistency`, every ESTIMATOR_TICKS
ELAPSED_S: Final = CONSISTENCY + len(interface.Consistency._fields)  # in the traversal: nominal ticks when guided only
STOP: Final = ELAPSED_S + 1  # east, north of its stopping point: as ELAPSED_S, every WHEREABOUTS_TICKS
PROGRESS: Final = STOP + 2  # arc length, believed errors of nozzle and heading, reference speed, state
FIXES: Final = PROGRESS + 5  # position reports that arrived: 0 or 1
REPORT: Final = FIXES + 1  # the report, as in `position_report`
READINGS: Final = REPORT + position_report.COLUMNS  # of the three sensors, as in `interface`, then the commands

Rows = NDArray[np.float64]


def commanded(actuators: int) -> slice:
    """Return the columns of the commands of a drive's actuators, in their order and units."""
    first = READINGS + interface.ANGLES + actuators
    return slice(first, first + actuators)


def columns(actuators: int) -> int:
    """Return the number of columns for a drive with so many actuators."""
    return READINGS + interface.ANGLES + 2 * actuators


def period(topic: Topic) -> int:
    """Return the ticks between two messages of a periodic topic."""
    return round(100 / topic.rate_hz)


ODOMETRY_TICKS: Final = period(topics.ODOMETRY)
"""Ticks between two messages of estimate and truth."""
ESTIMATOR_TICKS: Final = period(topics.ESTIMATOR)
WHEREABOUTS_TICKS: Final = period(topics.WHEREABOUTS)


@kernel
def note(
    row: NDArray[np.float64],
    tick: int,
    states: Sequence[BodyState],
    readings: NDArray[np.float64],
    command: HeldCommand,
) -> None:
    """Fill in a tick, except for the onboard computer's data and the position report; every sample is of this tick.

    Args:
        row: (`columns`,) filled: SI units, map frame, but readings in the body's.
        tick: This tick.
        states: (1,) state of the body at its end.
        readings: (interface.READINGS,) of the sensors.
        command: Command in force from then on.
    """
    state = states[0]
    row[TICK] = row[MEASURED] = row[MEASURED + 1] = row[MEASURED + 2] = tick
    for column in range(len(readings)):
        row[READINGS + column] = readings[column]
    for actuator in range(len(command.actuators)):
        row[READINGS + len(readings) + actuator] = command.actuators[actuator]
    row[TRUTH], row[TRUTH + 1], row[TRUTH + 2] = state.east_m, state.north_m, state.heading_rad
    row[TRUTH + 3], row[TRUTH + 4] = state.speed_mps, state.yaw_rate_radps
    row[SPRAYER], row[SPRAYER + 1] = 1.0 if command.valve else 0.0, 1.0 if state.valve_open else 0.0
    row[SPRAYER + 2], row[SPRAYER + 3] = 1.0 if command.disc else 0.0, 1.0 if state.disc_down else 0.0
    row[FLOW_LPS], row[TANK_L] = state.flow_lps, state.tank_l
    row[BATTERY_WH], row[POWER_W] = state.battery_wh, state.power_w
    row[FIXES] = 0.0
