"""Interface between the robot's hardware, which is emulated, and its own computer.

In every onboard tick the hardware gives a `SensorFrame` (`robot_sim/sensors`), and `onboard/` answers with a `Command`.
Frames follow REP-103: x forward, y left, z up, angles counter-clockwise positive, SI units. The map frame is
east-north-up about the scenario's origin, heading 0 points east.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import OpenLength
from touchline.schemas.sensor_names import ENCODER, IMU, MAGNETOMETER

TICKS_PER_S: Final = 100
"""Rate of the onboard computer: one `SensorFrame` in, one `Command` out."""
TICK_S: Final = 0.01
"""Period of the onboard computer [s]."""

# Readings of a frame as an array: the values of the samples below, in their order.
GYRO: Final = 0  # x, y, z [rad/s]
ACCEL: Final = 3  # x, y, z [m/s²]
MAG: Final = 6  # x, y, z [T]
ANGLES: Final = 9  # of the drive's actuators [rad]
ACTUATORS: Final = OpenLength()
"""Number of the drive's actuators: the length of arrays in records, which are made by `Record.sized` of that number."""
READINGS: Final = ANGLES + ACTUATORS
SAMPLED: Final = (IMU, MAGNETOMETER, ENCODER)
"""Sensors that are sampled in every tick, in the order of arrays that have one place for each of them."""
FIRST_READINGS: Final = (GYRO, MAG, ANGLES)
"""First reading of each of them; its last one is before the next sensor's."""


class GnssSample(NamedTuple):
    """A position fix of the antenna, converted back from the reported latitude and longitude.

    `stamp_s` is the time of validity by the receiver's clock, some 0.11 s before the tick in which the sample arrives.
    It need not be a whole tick, and with a clock that is off it may even lie ahead.
    """

    stamp_s: float
    east_m: float
    north_m: float
    variance_m2: float
    """Reported variance per horizontal axis [m²]."""
    fix: int
    """0 none, 1 single, 2 float, 3 fixed (as `GnssStatus`)."""
    satellites: int
    correction_age_s: float


class CameraSample(NamedTuple):
    """Pose of the body measured by an overhead camera at `stamp_s`, some 0.08 s before it arrives."""

    stamp_s: float
    east_m: float
    north_m: float
    heading_rad: float
    sigma_m: float
    """Reported standard deviation along an axis; the next is that of the heading."""
    sigma_rad: float


class AuxiliarySample(NamedTuple):
    """Measurement of an auxiliary sensor at `stamp_s`, a latency before it arrives."""

    sensor: str
    """Name of the sensor in the vehicle."""
    stamp_s: float
    values: Sequence[float]
    """Values as the kind of sensor documents them: a tuple, or an `array.array` of many."""


class ImuSample(NamedTuple):
    """Body-frame angular rates [rad/s] and specific force [m/s²]: z reads +g at rest on level ground."""

    gyro_x_radps: float
    gyro_y_radps: float
    gyro_z_radps: float
    accel_x_mps2: float
    accel_y_mps2: float
    accel_z_mps2: float


class MagSample(NamedTuple):
    """Magnetic field in the body frame [T]. The undisturbed field points to map north (declination 0) and down.

    At heading 0 (east) an ideal sensor reads x = 0, y = +horizontal field, z = −vertical field.
    """

    x_t: float
    y_t: float
    z_t: float


class SensorFrame(NamedTuple):
    """Input of the onboard computer in one tick."""

    tick: int
    time_s: float
    imu: ImuSample
    mag: MagSample
    encoders: tuple[float, ...]
    """Cumulative readings of the encoders of the drive's actuators, in their order, quantised [rad]."""
    gnss: tuple[GnssSample, ...] = ()
    """Fixes that arrived in this tick, in the order of their arrival (10 Hz; late by the receiver's latency); usually
    none or one. When messages are delayed, several can arrive at once, out of order or repeated."""
    imu_age_ticks: int = 0
    """Age of the newest IMU sample: 0 is measured in this tick; more when messages are late or lost."""
    mag_age_ticks: int = 0
    encoder_age_ticks: int = 0
    bumper: bool = False
    """True while the bumper is pressed."""
    battery_fraction: float = 1.0
    """State of charge, 0…1."""
    tank_l: float = 20.0
    """Reading of the tank's level sensor."""
    operator_alive: bool = True
    """True if the operator was heard in this tick, in sim time. (The link over the bus is monitored separately.)"""
    camera: tuple[CameraSample, ...] = ()
    """Poses of an overhead camera that arrived in this tick, as `gnss`; a robot has one or the other, or none."""


class Command(NamedTuple):
    """Output of the onboard computer to the actuators until its next tick."""

    actuators: tuple[float, ...]
    """Commands in the order and units of `DriveSpec.actuators`."""
    valve: bool
    disc: bool
    valve_after_s: float = 0.0
    """Time into the tick at which the valve switches to this state; until then it has the opposite one. 0 if nothing
    changes."""


@cache
def standstill(actuators: int) -> Command:
    """Return the safe command for a number of actuators: wheels stopped, valve closed, disc lifted.

    There is one object for each number, so it differs by identity from a command that is merely equal.
    """
    return Command((0.0,) * actuators, False, False)


class Estimate(NamedTuple):
    """The onboard computer's belief about the axle centre, map frame, at the tick's time."""

    east_m: float
    north_m: float
    heading_rad: float
    speed_mps: float
    yaw_rate_radps: float
    covariance: NDArray[np.float64]
    """(9,) row-major covariance of (east [m], north [m], heading [rad])."""
    twist_covariance: NDArray[np.float64]
    """(4,) row-major covariance of (speed [m/s], yaw rate [rad/s])."""


class Consistency(NamedTuple):
    """Self-assessment of the estimator, in the order of `EstimatorStatus`."""

    innovation_east_m: float = 0.0
    innovation_north_m: float = 0.0
    fix_nis: float = 0.0
    fix_nis_recent: float = 0.0
    fix_nis_mean: float = 0.0
    """Mean NIS of the fixes as they are weighed, at most 5.5 each; 2 expected of a consistent filter."""
    encoder_nis_mean: float = 0.0
    """Mean NIS of the encoders; 2 expected."""
    mag_nis_mean: float = 0.0
    """Mean NIS of the magnetometer; 1 expected."""
    position_sigma_m: float = 0.0
    heading_sigma_rad: float = 0.0
    slip: float = 0.0
    """Share of the last wheel readings that contradict the rest."""
    fixes: int = 0
    fixes_rejected: int = 0
    fixes_too_late: int = 0
    fixes_duplicate: int = 0
    fixes_out_of_order: int = 0
    gyro_rejected: int = 0
    encoders_rejected: int = 0
    mag_rejected: int = 0
    recoveries: int = 0


CONSISTENCY_COUNTS: Final = 10
"""Index of the field of `Consistency` from which on they are counts."""


class Pause(NamedTuple):
    """Reason for a pause, and what ends it."""

    cause: int
    """Cause as in `PauseStatus`."""
    source: str
    """Person or component that ordered the pause."""
    ends_by_itself: bool = False
    """True if the robot moves off without a person."""
    earliest_tick: int = 0
    """Earliest tick in which it does so."""


class MoveOffWarning(NamedTuple):
    """The warning that the robot is about to move, given until it is stopped again."""

    earliest_tick: int
    """First tick in which it may move off."""
    reason: str
    """Source of the order to move."""


class Status(NamedTuple):
    """Status of the traversal as the onboard executive sees it; states are those of `TraversalStatus`."""

    state: int = 0
    reason: str = ""
    segment_index: int = 0
    """Index of the path segment under the robot."""
    segment_count: int = 0
    segment_id: str = ""
    arc_length_m: float = 0.0
    total_length_m: float = 0.0
    elapsed_s: float = 0.0
    """Sim time since the traversal was started, pauses included."""
    remaining_s: float = 0.0
    follower_fallbacks: int = 0
    """Ticks in which the follower fell back to its simpler method."""
    pause: Pause | None = None
    """Present pause, while the traversal is paused."""


class PaintBelief(NamedTuple):
    """Estimated paint, or ground covered with a tool that always works; no sensor observes it."""

    ids: tuple[str, ...] = ()
    """Ids of the segments that the loaded trajectory sprays, or of its swaths, in path order."""
    fractions: Sequence[float] = ()
    """Painted share of each, 0…1."""
    coverage_pct: float = 0.0
    """Painted share of all [%]; 100 when there are none, 0 without a trajectory."""


LEARNED_FIGURES: Final = 10
"""Number of figures that `Estimator.learned` has."""


class Checkpoint(NamedTuple):
    """State of a traversal from which it can continue after the process has died."""

    leg: int
    """Index of the stretch between two standstills that the robot is on."""
    arc_length_m: float
    owed_from_m: float | None
    """Arc length from which paint is owed: where it stopped, or would have if the process had died in this tick."""
    tick: int = 0
    """Tick at the end of which the checkpoint was taken; sim time continues from there."""
    elapsed_s: float = 0.0
    """This and the next have the meaning that they have in `Status`."""
    follower_fallbacks: int = 0
    learned: tuple[float, ...] = ()
    """Figures that the estimator had learned of the robot, see `Estimator.learned`."""


class OnboardEvent(NamedTuple):
    """Event for the operator; severities are those of `Event`."""

    severity: int
    code: str
    text: str
