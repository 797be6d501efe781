"""Payloads of topics that are sent with every tick or every other, packed for several ticks at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import (
    ACCEL,
    ANGLES,
    CONSISTENCY_COUNTS,
    GYRO,
    MAG,
    TICKS_PER_S,
    Consistency,
)
from touchline.schemas import topics
from touchline.schemas.layout import Payloads, Records
from touchline.schemas.scenario import Scenario
from touchline.schemas.topics import Topic
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.odometry_packer import NO_STAMP, STAMP, OdometryPacker, stamps
from touchline.services.robot_sim.packing import Payload, battery, camera_pose, gnss, stamp
from touchline.services.robot_sim.sensors import camera_truth, gnss_truth
from touchline.services.robot_sim.tick_log import Rows, period

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_NO_VECTOR: Final = (0.0, 0.0, 0.0)
_NO_COVARIANCE: Final = (0.0,) * 9
_NO_ORIENTATION: Final = (0.0, 0.0, 0.0, 1.0, -1.0, *(0.0,) * 8)
_SPRAYER_TICKS: Final = period(topics.SPRAYER)
_BATTERY_TICKS: Final = period(topics.BATTERY)
_COUNTS: Final = tick_log.CONSISTENCY + CONSISTENCY_COUNTS
_GYRO: Final = slice(tick_log.READINGS + GYRO, tick_log.READINGS + GYRO + 3)
_ACCEL: Final = slice(tick_log.READINGS + ACCEL, tick_log.READINGS + MAG)
_FIELD: Final = slice(tick_log.READINGS + MAG, tick_log.READINGS + ANGLES)


class Series(NamedTuple):
    """Payloads of a topic, in order, and the row of several in which each is due."""

    topic: Topic
    rows: Sequence[int]
    payloads: Payloads


Placed = tuple[int, Payload]
"""Index of a row, and a payload that is due in it."""


class Samples:
    """Packer of rows of `tick_log`.

    Args:
        vehicle: Gives the actuators, the tool and the positioning.
        scenario: Gives the IMU's noise, from which its reported covariances are made.
        history: (transport.HISTORY, READINGS) readings by tick.
        most: Largest number of rows at once.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario, history: Floats, most: int) -> None:
        """Prepare the records."""
        actuators = vehicle.drive.actuators
        count = len(actuators)
        self._angles = slice(tick_log.READINGS + ANGLES, tick_log.READINGS + ANGLES + count)
        self._commanded = tick_log.commanded(count)
        noise = scenario.effective().imu
        gyro, accel = (noise.gyro_density_radps_rthz**2) * TICKS_PER_S, (noise.accel_density_mps2_rthz**2) * TICKS_PER_S
        imu = layouts.IMU.pack(
            *NO_STAMP, *_NO_ORIENTATION, *_NO_VECTOR, *_diagonal(gyro), *_NO_VECTOR, *_diagonal(accel)
        )
        mag = layouts.MAGNETIC_FIELD.pack(*NO_STAMP, *_NO_VECTOR, *_NO_COVARIANCE)
        joints = layouts.joint_states(tuple(each.joint for each in actuators))
        command = layouts.actuator_command(tuple(each.name for each in actuators))
        vectors = {"angular_velocity.x": 3, "linear_acceleration.x": 3}
        self._imu = Records(layouts.IMU, imu, STAMP | vectors, most)
        self._mag = Records(layouts.MAGNETIC_FIELD, mag, STAMP | {"magnetic_field.x": 3}, most)
        still = joints.pack(*NO_STAMP, *(0.0,) * 2 * count)
        self._joints = Records(joints, still, STAMP | {"position[0]": count, "velocity[0]": count}, most)
        still = command.pack(*NO_STAMP, *(0.0,) * count)
        self._command = Records(command, still, STAMP | {"values[0]": count}, most)
        self._odometry = OdometryPacker(most)
        still = layouts.ESTIMATOR.pack(*NO_STAMP, *Consistency())
        counts = len(Consistency._fields) - CONSISTENCY_COUNTS
        figures = {"innovation_east_m": CONSISTENCY_COUNTS, "fixes": counts}
        self._estimator = Records(layouts.ESTIMATOR, still, STAMP | figures, most)
        self._history, self._sprays, self._battery_wh = history, vehicle.tool.paints, vehicle.body.battery_wh
        self._seen = vehicle.positioning == OVERHEAD_CAMERA
        self._sprayer: Floats = np.full((1, tick_log.TANK_L - tick_log.SPRAYER), math.nan)  # as last published

    def published_before(self, row: Rows) -> None:
        """Take the last tick's row, (tick_log.columns,), as already published, for the sprayer."""
        self._sprayer = row[np.newaxis, tick_log.SPRAYER : tick_log.TANK_L]

    def series(self, rows: Rows, positions: Sequence[Placed]) -> list[Series]:
        """Pack all payloads that are due in consecutive ticks, in the order of topics within a tick.

        Args:
            rows: (n, tick_log.columns) of the ticks.
            positions: Positions that are packed already, with the row of each.
        """
        return [
            *self._of_sensors(rows),
            *self._of_positions(rows, positions),
            *self._of_odometry(rows),
            self._of_estimator(rows),
            self._of_battery(rows),
            *([self._of_sprayer(rows)] if self._sprays else ()),
        ]

    def _of_sensors(self, rows: Rows) -> list[Series]:
        """Pack the samples that arrived, stamped with the time of measurement, and the commands to the actuators."""
        (imu, at_imu), (mag, at_mag), (encoders, at_encoders) = (
            _arrived(rows, column) for column in range(tick_log.MEASURED, tick_log.ESTIMATE)
        )
        rates = self._rates(encoders)
        joints = self._joints.pack(*stamps(encoders, tick_log.MEASURED + 2), encoders[:, self._angles], rates)
        commands = self._command.pack(*stamps(rows, tick_log.TICK), rows[:, self._commanded])
        return [
            Series(topics.IMU, at_imu, self._imu.pack(*stamps(imu, tick_log.MEASURED), imu[:, _GYRO], imu[:, _ACCEL])),
            Series(topics.MAGNETIC_FIELD, at_mag, self._mag.pack(*stamps(mag, tick_log.MEASURED + 1), mag[:, _FIELD])),
            Series(topics.JOINT_STATES, at_encoders, joints),
            Series(topics.ACTUATOR_COMMAND, range(len(rows)), commands),
        ]

    def _of_positions(self, rows: Rows, packed: Sequence[Placed]) -> list[Series]:
        """Pack fixes with their states, or the camera's poses: those in the rows, and those that are packed already."""
        placed = [
            (row, payload)
            for row in np.flatnonzero(rows[:, tick_log.FIXES]).tolist()
            for payload in self._position(rows[row, tick_log.REPORT : tick_log.READINGS].tolist())
        ]
        placed = sorted([*placed, *packed], key=lambda each: each[0])
        of_topic: dict[Topic, list[tuple[int, bytes]]] = {}
        for row, (topic, payload) in placed:
            of_topic.setdefault(topic, []).append((row, payload))
        return [
            Series(topic, [row for row, _ in each], Payloads.of([payload for _, payload in each]))
            for topic, each in of_topic.items()
        ]

    def _position(self, report: list[float]) -> list[Payload]:
        """Pack a row of `position_report`."""
        return [camera_pose(camera_truth.unpack(report))] if self._seen else gnss(gnss_truth.unpack(report)[0])

    def _rates(self, encoders: Rows) -> Floats:
        """Compute rates (n, actuators) [rad/s] as the encoders' driver derives them: by the reading of the tick before.

        They are computed where the encoders are read, so a message that is late, lost or repeated changes no other
        one's.
        """
        before = (encoders[:, tick_log.MEASURED + 2].astype(np.int64) - 1) % len(self._history)
        angles = encoders[:, self._angles]
        rates: Floats = (angles - self._history[before, ANGLES:]) * TICKS_PER_S
        return rates

    def _of_odometry(self, rows: Rows) -> list[Series]:
        """Pack the estimates and the true poses, in the ticks in which they are due."""
        at = _due(rows, tick_log.ODOMETRY_TICKS)
        due = rows[at.start :: at.step]
        return [
            Series(topics.ODOMETRY, at, self._odometry.estimates(due)),
            Series(topics.TRUTH, at, self._odometry.truths(due)),
        ]

    def _of_estimator(self, rows: Rows) -> Series:
        """Pack the estimator's status, in the ticks in which it is due."""
        at = _due(rows, tick_log.ESTIMATOR_TICKS)
        due = rows[at.start :: at.step]
        figures, counts = due[:, tick_log.CONSISTENCY : _COUNTS], due[:, _COUNTS : tick_log.ELAPSED_S]
        return Series(topics.ESTIMATOR, at, self._estimator.pack(*stamps(due, tick_log.TICK), figures, counts))

    def _of_battery(self, rows: Rows) -> Series:
        """Pack the battery's state, in the ticks in which it is due."""
        at = _due(rows, _BATTERY_TICKS)
        return Series(topics.BATTERY, at, Payloads.of([battery_state(rows[row], self._battery_wh) for row in at]))

    def _of_sprayer(self, rows: Rows) -> Series:
        """Pack the sprayer's state, where it has changed or is due."""
        states = np.concatenate((self._sprayer, rows[:, tick_log.SPRAYER : tick_log.TANK_L]))
        self._sprayer = states[-1:]
        other = (states[1:] != states[:-1]).any(axis=1)
        at = np.flatnonzero(other | (rows[:, tick_log.TICK] % _SPRAYER_TICKS == 0)).tolist()
        return Series(topics.SPRAYER, at, Payloads.of([sprayer_state(rows[row]) for row in at]))


def battery_state(row: Floats, capacity_wh: float) -> bytes:
    """Pack `battery_state` of a tick as CDR.

    Args:
        row: (tick_log.columns,) of the tick.
        capacity_wh: Charge of the full battery.
    """
    left_wh, power_w = row[tick_log.BATTERY_WH : tick_log.POWER_W + 1].tolist()
    return battery(stamp(round(row[tick_log.TICK])), left_wh, power_w, capacity_wh)


def odometry_of(row: Floats) -> bytes:
    """Pack `odometry/filtered` of a tick's row as CDR."""
    return OdometryPacker(1).estimates(row[np.newaxis]).data


def sprayer_state(row: Floats) -> bytes:
    """Pack `sprayer/state` of a tick's row as CDR."""
    valve, is_open, disc, down, flow, tank_l = row[tick_log.SPRAYER : tick_log.TANK_L + 1].tolist()
    time = stamp(round(row[tick_log.TICK]))
    return layouts.SPRAYER.pack(*time, bool(valve), bool(is_open), bool(disc), bool(down), flow, tank_l)


def _due(rows: Rows, ticks: int) -> range:
    """Return the rows that are due, of consecutive ones, if every tick that is a multiple of `ticks` is."""
    return range(-round(rows[0, tick_log.TICK]) % ticks, len(rows), ticks)


def _diagonal(variance: float) -> tuple[float, ...]:
    return (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance)


def _arrived(rows: Rows, measured: int) -> tuple[Rows, Sequence[int]]:
    """Return the rows in which the sample measured in that column's tick arrived, and their indices."""
    at = np.flatnonzero(rows[:, measured] >= 0.0)
    return rows if len(at) == len(rows) else rows[at], at.tolist()
