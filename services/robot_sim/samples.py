"""The payloads of the topics that come with every tick or every other, packed for several ticks at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import topics
from touchline.schemas.layout import Records
from touchline.schemas.scenario import Scenario
from touchline.schemas.topics import Topic
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.onboard.interface import ACCEL, ANGLES, GYRO, MAG, TICKS_PER_S
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.packing import Payload, camera_pose, gnss, stamp
from touchline.services.robot_sim.sensors import camera
from touchline.services.robot_sim.sensors.gnss import unpack
from touchline.services.robot_sim.tick_log import Rows, period

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_STAMP: Final = {"header.stamp.sec": 1, "header.stamp.nanosec": 1}
_NO_STAMP: Final = (0, 0)
_NO_VECTOR: Final = (0.0, 0.0, 0.0)
_NO_COVARIANCE: Final = (0.0,) * 9
_NO_ORIENTATION: Final = (0.0, 0.0, 0.0, 1.0, -1.0, *(0.0,) * 8)
_NO_ODOMETRY: Final = (0.0,) * (7 + 36 + 6 + 36)
_C: Final = tick_log.COVARIANCE
_T: Final = tick_log.TWIST_COVARIANCE
_COVARIANCE: Final = {
    "pose.covariance[0]": slice(_C, _C + 2),
    "pose.covariance[5]": slice(_C + 2, _C + 3),
    "pose.covariance[6]": slice(_C + 1, _C + 5, 3),
    "pose.covariance[11]": slice(_C + 5, _C + 6),
    "pose.covariance[30]": slice(_C + 2, _C + 6, 3),
    "pose.covariance[35]": slice(_C + 8, _C + 9),
    "twist.covariance[0]": slice(_T, _T + 1),
    "twist.covariance[5]": slice(_T + 1, _T + 2),
    "twist.covariance[30]": slice(_T + 2, _T + 3),
    "twist.covariance[35]": slice(_T + 3, _T + 4),
}
"""Where the columns of `tick_log` go in the covariances of (x, y, z, roll, pitch, yaw) and of their rates."""

_SPRAYER_TICKS: Final = period(topics.SPRAYER)
_GYRO: Final = slice(tick_log.READINGS + GYRO, tick_log.READINGS + GYRO + 3)
_ACCEL: Final = slice(tick_log.READINGS + ACCEL, tick_log.READINGS + MAG)
_FIELD: Final = slice(tick_log.READINGS + MAG, tick_log.READINGS + ANGLES)


class Samples:
    """Packs rows of `tick_log`.

    Args:
        vehicle: Has the actuators, a tool or none, and what positions it.
        scenario: Has the IMU's noise, of which the covariances that it reports are made.
        history: (transport.HISTORY, READINGS) what was measured, by tick.
        most: Rows at once.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario, history: Floats, most: int) -> None:
        """See the class."""
        actuators = vehicle.drive.actuators
        count = len(actuators)
        self._angles = slice(tick_log.READINGS + ANGLES, tick_log.READINGS + ANGLES + count)
        self._commanded = slice(tick_log.COMMANDED, tick_log.COMMANDED + count)
        noise = scenario.effective().imu
        gyro, accel = (noise.gyro_density_radps_rthz**2) * TICKS_PER_S, (noise.accel_density_mps2_rthz**2) * TICKS_PER_S
        imu = layouts.IMU.pack(
            *_NO_STAMP, *_NO_ORIENTATION, *_NO_VECTOR, *_diagonal(gyro), *_NO_VECTOR, *_diagonal(accel)
        )
        mag = layouts.MAGNETIC_FIELD.pack(*_NO_STAMP, *_NO_VECTOR, *_NO_COVARIANCE)
        joints = layouts.joint_states(tuple(each.joint for each in actuators))
        command = layouts.actuator_command(tuple(each.name for each in actuators))
        vectors = {"angular_velocity.x": 3, "linear_acceleration.x": 3}
        self._imu = Records(layouts.IMU, imu, _STAMP | vectors, most)
        self._mag = Records(layouts.MAGNETIC_FIELD, mag, _STAMP | {"magnetic_field.x": 3}, most)
        still = joints.pack(*_NO_STAMP, *(0.0,) * 2 * count)
        self._joints = Records(joints, still, _STAMP | {"position[0]": count, "velocity[0]": count}, most)
        still = command.pack(*_NO_STAMP, *(0.0,) * count)
        self._command = Records(command, still, _STAMP | {"values[0]": count}, most)
        pose = {"pose.pose.position.x": 2, "pose.pose.orientation.z": 2}
        twist = {"twist.twist.linear.x": 1, "twist.twist.angular.z": 1}
        odometry = layouts.ODOMETRY.pack(*_NO_STAMP, *_NO_ODOMETRY)
        covariance = {path: len(range(tick_log.TRUTH)[columns]) for path, columns in _COVARIANCE.items()}
        self._estimate = Records(layouts.ODOMETRY, odometry, _STAMP | pose | twist | covariance, most)
        self._truth = Records(layouts.ODOMETRY, odometry, _STAMP | pose | twist, most)
        self._history, self._sprays = history, vehicle.tool.paints
        self._seen = vehicle.positioning == OVERHEAD_CAMERA
        self._sprayer: Floats = np.full((1, tick_log.TANK_L - tick_log.SPRAYER), math.nan)  # its state, as last told

    def payloads(self, rows: Rows, positions: Sequence[Payload]) -> list[Payload]:
        """All that is due in these ticks, tick by tick; the positions of the last one are packed already."""
        sensors = self._of_sensors(rows)
        before = -round(rows[0, tick_log.TICK]) % tick_log.ODOMETRY_TICKS  # the first tick with odometry
        odometry = self._of_odometry(rows[before :: tick_log.ODOMETRY_TICKS])
        fixes, switched = rows[:, tick_log.FIXES].tolist(), self._switched(rows) if self._sprays else ()
        due: list[Payload] = []
        for index in range(len(rows)):
            due += [(topic, payloads[index]) for topic, payloads in sensors if index < len(payloads)]
            if fixes[index]:
                due += self._position(rows[index, tick_log.REPORT :].tolist())
            if index == len(rows) - 1:
                due += positions
            turn, between = divmod(index - before, tick_log.ODOMETRY_TICKS)
            if not between:
                due += [(topic, payloads[turn]) for topic, payloads in odometry]
            if switched and switched[index]:
                due.append((topics.SPRAYER, sprayer_state(rows[index])))
        return due

    def _position(self, report: list[float]) -> list[Payload]:
        """A row of `position_report`."""
        return [camera_pose(camera.unpack(report))] if self._seen else gnss(unpack(report)[0])

    def _of_sensors(self, rows: Rows) -> list[tuple[Topic, list[bytes]]]:
        """Per topic the payloads, tick by tick, of the samples that arrived, stamped with the time of measurement.

        The commands to the actuators are among them. A topic may be short of the last row's.
        """
        imu, mag, encoders = (_arrived(rows, column) for column in range(tick_log.MEASURED, tick_log.READINGS))
        return [
            (topics.IMU, self._imu.pack(*_stamps(imu, tick_log.MEASURED), imu[:, _GYRO], imu[:, _ACCEL])),
            (topics.MAGNETIC_FIELD, self._mag.pack(*_stamps(mag, tick_log.MEASURED + 1), mag[:, _FIELD])),
            (
                topics.JOINT_STATES,
                self._joints.pack(
                    *_stamps(encoders, tick_log.MEASURED + 2), encoders[:, self._angles], self._rates(encoders)
                ),
            ),
            (topics.ACTUATOR_COMMAND, self._command.pack(*_stamps(rows, tick_log.TICK), rows[:, self._commanded])),
        ]

    def _rates(self, encoders: Rows) -> Floats:
        """Rates (n, actuators) [rad/s] as the encoders' driver derives them: by the reading of the tick before.

        That is where they are read, so a message that is late, lost or sent again changes no other one's.
        """
        before = (encoders[:, tick_log.MEASURED + 2].astype(np.int64) - 1) % len(self._history)
        angles = encoders[:, self._angles]
        rates: Floats = (angles - self._history[before, ANGLES : ANGLES + angles.shape[1]]) * TICKS_PER_S
        return rates

    def _of_odometry(self, rows: Rows) -> list[tuple[Topic, list[bytes]]]:
        """The estimates and the truths of rows in which they are due."""
        stamps = _stamps(rows, tick_log.TICK)
        estimate, truth = rows[:, tick_log.ESTIMATE : tick_log.COVARIANCE], rows[:, tick_log.TRUTH : tick_log.SPRAYER]
        covariance = (rows[:, columns] for columns in _COVARIANCE.values())
        return [
            (topics.ODOMETRY, self._estimate.pack(*stamps, *_motion(estimate), *covariance)),
            (topics.TRUTH, self._truth.pack(*stamps, *_motion(truth))),
        ]

    def _switched(self, rows: Rows) -> Sequence[bool]:
        """Per row, whether the sprayer's state is due: because it is another one, or it is time."""
        states = np.concatenate((self._sprayer, rows[:, tick_log.SPRAYER : tick_log.TANK_L]))
        self._sprayer = states[-1:]
        other = (states[1:] != states[:-1]).any(axis=1)
        due: list[bool] = (other | (rows[:, tick_log.TICK] % _SPRAYER_TICKS == 0)).tolist()
        return due


def sprayer_state(row: Floats) -> bytes:
    """CDR of `sprayer/state` of a tick's row."""
    valve, is_open, disc, down, flow, tank_l = row[tick_log.SPRAYER : tick_log.TANK_L + 1].tolist()
    time = stamp(round(row[tick_log.TICK]))
    return layouts.SPRAYER.pack(*time, bool(valve), bool(is_open), bool(disc), bool(down), flow, tank_l)


def _diagonal(variance: float) -> tuple[float, ...]:
    return (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance)


def _arrived(rows: Rows, measured: int) -> Rows:
    """The rows in which the sample measured in that column's tick arrived: only the last may be without."""
    return rows[:-1] if rows[-1, measured] < 0.0 else rows


def _stamps(rows: Rows, column: int) -> tuple[Integers, Integers]:
    """Seconds and nanoseconds (n, 1) of sim time at the ends of the ticks in a column."""
    whole = rows[:, column : column + 1].astype(np.int64)
    return whole // 100, whole % 100 * 10_000_000


def _motion(rows: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Position (n, 2), the quaternion's z and w (n, 2), speed and yaw rate (n, 1) of rows (n, 5)."""
    turned = [(math.sin(0.5 * heading), math.cos(0.5 * heading)) for heading in rows[:, 2].tolist()]
    return rows[:, :2], np.array(turned).reshape(-1, 2), rows[:, 3:4], rows[:, 4:5]
