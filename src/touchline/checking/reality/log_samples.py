"""Samples of a log that its errors are told by: odometry, IMU and fixes, at the ticks of a robot's computer."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_inputs import EstimatorInputs
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.interface import ANGLES, GYRO, MAG, TICKS_PER_S
from touchline.schemas.errors import SpecError
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

REST_MPS: Final = 0.02
"""Speed by the wheels below which a robot rests."""
_REST_RADPS: Final = 0.02
_SETTLE_TICKS: Final = 50
_SMOOTH_TICKS: Final = 20
_LEAST_BIAS_TICKS: Final = 100


class LogSamples(NamedTuple):
    """Samples of n ticks of a log or of its emulation.

    Attributes:
        time_s: (n,) ends of the ticks.
        wheels_rad: (n, 2) angles of the left and the right wheel.
        imu: (n, 6) gyro [rad/s], then accelerometer [m/s²], body frame; NaN where the log has none.
        fixes: (k, 3) RTK-fixed positions of the antenna: time [s], east, north [m].
        reported_m: Median σ that fixes report; NaN without fixes.
        vehicle: The robot.
    """

    time_s: Floats
    wheels_rad: Floats
    imu: Floats
    fixes: Floats
    reported_m: float
    vehicle: Vehicle

    @property
    def duration_s(self) -> float:
        """Length of the log [s]."""
        return float(len(self.time_s) / TICKS_PER_S)

    @property
    def wheel_rates_radps(self) -> Floats:
        """(n, 2) rates of the wheels, means over 0.2 s."""
        ahead = np.minimum(np.arange(len(self.time_s)) + _SMOOTH_TICKS // 2, len(self.time_s) - 1)
        behind = np.maximum(np.arange(len(self.time_s)) - _SMOOTH_TICKS // 2, 0)
        moved = self.wheels_rad[ahead] - self.wheels_rad[behind]
        rates: Floats = moved * (TICKS_PER_S / np.maximum(ahead - behind, 1))[:, None]
        return rates

    @property
    def speed_mps(self) -> Floats:
        """(n,) speed by the wheels."""
        speed: Floats = self.wheel_rates_radps.mean(axis=1) * self.vehicle.drive.wheel_radius_m
        return speed

    @property
    def rests(self) -> Flags:
        """(n,) True while the robot rests, half a second after it came to rest and before it sets off."""
        turning = np.diff(self.wheel_rates_radps)[:, 0] * self.vehicle.drive.wheel_radius_m
        still = (np.abs(self.speed_mps) < REST_MPS) & (np.abs(turning) < _REST_RADPS)
        moved = np.concatenate(([0], np.cumsum(~still)))
        first = np.maximum(np.arange(len(still)) - _SETTLE_TICKS, 0)
        last = np.minimum(np.arange(len(still)) + _SETTLE_TICKS + 1, len(still))
        rests: Flags = moved[last] == moved[first]
        return rests

    @property
    def turn_radps(self) -> Floats:
        """(n,) yaw rate: the gyro's, less its mean in the rests around; the wheels' where there is none."""
        drive = self.vehicle.drive
        by_wheels: Floats = np.diff(self.wheel_rates_radps)[:, 0] * drive.wheel_radius_m / drive.track_width_m
        gyro = self.imu[:, 2]
        there = np.isfinite(gyro)
        if not there.any():
            return by_wheels
        times, biases = [], []
        for first, last in stretches(self.rests & there):
            if last - first >= _LEAST_BIAS_TICKS:
                times.append(self.time_s[first:last].mean())
                biases.append(gyro[first:last].mean())
        if not times:
            times, biases = [0.0], [float((gyro - by_wheels)[there].mean())]
        return np.where(there, gyro - np.interp(self.time_s, times, biases), by_wheels)

    @property
    def antenna_track(self) -> Floats:
        """(n, 3) dead-reckoned antenna, east and north in a frame of its own [m], and the distance driven [m]."""
        turn = np.cumsum(self.turn_radps) / TICKS_PER_S
        step = np.diff(self.wheels_rad.mean(axis=1), prepend=self.wheels_rad[0].mean())
        step *= self.vehicle.drive.wheel_radius_m
        middle = turn - 0.5 * np.diff(turn, prepend=turn[0])
        body, cos, sin = self.vehicle.body, np.cos(turn), np.sin(turn)
        x, y = body.gnss_antenna_x_m, body.gnss_antenna_y_m
        east = np.cumsum(step * np.cos(middle)) + cos * x - sin * y
        north = np.cumsum(step * np.sin(middle)) + sin * x + cos * y
        return np.column_stack([east, north, np.cumsum(np.abs(step))])


def stretches(flags: Flags) -> list[tuple[int, int]]:
    """Return first and behind-last index of each stretch of True.

    Args:
        flags: (n,) truth values.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def samples_of(inputs: EstimatorInputs) -> LogSamples:
    """Return the samples of a recorded or imported session.

    Args:
        inputs: The session.

    Raises:
        NotRebuilt: It has no sensor frames.
        SpecError: Its robot does not drive with two wheels.
    """
    vehicle, frames = inputs.setup.vehicle, inputs.frames
    if not hasattr(vehicle.drive, "track_width_m"):
        raise SpecError("the recording", "", "is of a robot without two driven wheels", "give one of such a robot")
    ticks = frames.first_tick + np.arange(len(frames.readings))
    imu = frames.readings[:, GYRO:MAG].copy()
    imu[frames.measured[:, 0] < ticks] = np.nan
    receiver = inputs.receiver()
    fixed = receiver[receiver[:, 4] == FIX_FIXED]
    reported_m = float(np.median(fixed[:, 3])) if len(fixed) else float("nan")
    fixes = fixed[np.argsort(fixed[:, 0], kind="stable"), :3]
    wheels = frames.readings[:, ANGLES : ANGLES + 2]
    wheels = np.where(np.isfinite(wheels), wheels, 0.0)
    return LogSamples(ticks / TICKS_PER_S, wheels, imu, fixes, reported_m, vehicle)
