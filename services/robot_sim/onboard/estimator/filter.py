"""The estimator: starts itself at standstill, then runs the filter's kernel every tick."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S, Estimate, GnssSample, SensorFrame
from services.robot_sim.onboard.estimator import model as m
from services.robot_sim.onboard.estimator.kernels import tick_filter

FIX_NONE: Final = 0
FIX_FIXED: Final = 3

_STILL_RAD = 1e-4  # wheel angle in a tick below which the wheel stands (1 mm/s)
_STILL_TICKS = 20
_START_TICKS = 25  # at standstill before the biases are worth starting from
_MAG_EVERY_TICKS = 10  # its error is a slow one: more samples say nothing new and cost time
_ALIGNED_FIXES = 3
_LOOSE_FIX_FACTOR = 20.0  # float and single fixes err slowly: their variance counts for two seconds, not for 0.1 s
_LOOSE_FIX_FLOOR_M2 = {1: 1.0, 2: 0.04}
_NO_COVARIANCE = np.diag([1e6, 1e6, math.pi**2]).ravel()


class Estimator:
    """A 12-state EKF that sees nothing but `SensorFrame`s; states and noise in `model`.

    It starts in the tick in which the first RTK-fixed position arrives after a quarter of a second at standstill:
    gyro and accelerometer bias from their means, heading from the magnetometer, position from the fix.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """A filter that has seen nothing yet."""
        self._c = m.noise_figures(vehicle, scenario)
        self._gyro_start_var = scenario.imu.gyro_density_radps_rthz**2
        self._accel_start_var = scenario.imu.accel_density_mps2_rthz**2
        self._radius_m = vehicle.wheel_radius_m
        self._xs = np.zeros((m.RING, m.STATES))
        self._covariances = np.zeros((m.RING, m.STATES, m.STATES))
        self._inputs = np.zeros((m.RING, m.INPUTS))
        self._fixes = np.zeros((m.RING + 1, m.FIXES))
        self.counters = np.zeros(m.COUNTERS)
        """(COUNTERS,) counts, NIS sums and the last innovation; indices in `model`."""
        self._last_left = math.nan
        self._last_right = math.nan
        self._last_accel = 0.0
        self._still_ticks = 0
        self._sums = np.zeros(4)
        self.restart()

    def restart(self) -> None:
        """Forget everything and start again from the sensors: the robot may have been carried elsewhere."""
        self._first_tick = -1
        self._slot = 0
        self._sums[:] = 0.0
        self._sum_ticks = 0
        self._fixes[:] = 0.0
        self.counters[:] = 0.0
        self.last_fix: GnssSample | None = None
        """The newest fix that arrived, used or not."""
        self.last_used_stamp_s = -math.inf
        """Time of validity of the newest RTK-fixed position that passed the gate."""

    @property
    def started(self) -> bool:
        """Whether there is an estimate."""
        return self._first_tick >= 0

    @property
    def aligned(self) -> bool:
        """Whether the filter has settled enough at standstill to drive off."""
        return self.started and self.counters[m.N_FIXES] >= _ALIGNED_FIXES

    @property
    def state(self) -> NDArray[np.float64]:
        """(STATES,) the current state; a view."""
        row: NDArray[np.float64] = self._xs[self._slot]
        return row

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(STATES, STATES) its covariance; a view."""
        matrix: NDArray[np.float64] = self._covariances[self._slot]
        return matrix

    @property
    def position_sigma_m(self) -> float:
        """Larger standard deviation of the two horizontal axes, slow GNSS error included."""
        p = self._covariances[self._slot]
        return math.sqrt(max(p[m.EAST, m.EAST], p[m.NORTH, m.NORTH])) if self.started else math.inf

    @property
    def heading_sigma_rad(self) -> float:
        """Standard deviation of the heading."""
        return math.sqrt(self._covariances[self._slot, m.HEADING, m.HEADING]) if self.started else math.inf

    def speed_now_mps(self) -> float:
        """Speed at the end of the tick: the state is the tick's mean, the accelerometer gives the other half."""
        x = self._xs[self._slot]
        return float(x[m.SPEED] + 0.5 * TICK_S * (self._last_accel - x[m.ACCEL_BIAS]))

    def estimate(self) -> Estimate:
        """Pose, twist and pose covariance of the axle centre at the tick's time."""
        if not self.started:
            return Estimate(0.0, 0.0, 0.0, 0.0, 0.0, _NO_COVARIANCE)
        x = self._xs[self._slot].tolist()
        covariance = self._covariances[self._slot, :3, :3].ravel()
        return Estimate(x[m.EAST], x[m.NORTH], x[m.HEADING], self.speed_now_mps(), x[m.YAW_RATE], covariance)

    def step(self, frame: SensorFrame) -> None:
        """Take in a tick's measurements. Frames must come in order, one per tick."""
        imu, mag, encoders = frame.imu, frame.mag, frame.encoders
        turned_left = encoders.left_rad - self._last_left
        turned_right = encoders.right_rad - self._last_right
        self._last_left, self._last_right = encoders.left_rad, encoders.right_rad
        if turned_left != turned_left:  # first frame: nothing to compare with yet
            turned_left = turned_right = 0.0
            self._last_accel = imu.accel_x_mps2
        if abs(turned_left) < _STILL_RAD and abs(turned_right) < _STILL_RAD:
            self._still_ticks += 1
        else:
            self._still_ticks = 0
        slot = frame.tick % m.RING
        z = self._inputs[slot]
        z[m.IN_GYRO] = imu.gyro_z_radps
        z[m.IN_ACCEL] = 0.5 * (imu.accel_x_mps2 + self._last_accel)
        z[m.IN_LEFT] = turned_left * self._radius_m / TICK_S
        z[m.IN_RIGHT] = turned_right * self._radius_m / TICK_S
        z[m.IN_STILL] = 1.0 if self._still_ticks >= _STILL_TICKS else 0.0
        z[m.IN_MAG] = math.atan2(mag.x_t, mag.y_t) if frame.tick % _MAG_EVERY_TICKS == 0 else math.nan
        self._last_accel = imu.accel_x_mps2
        gnss = frame.gnss[-1] if frame.gnss else None
        if gnss is not None:
            self.last_fix = gnss
        if not self.started:
            self._gather(frame)
            return
        self._slot = slot
        fix_tick = -1
        if gnss is not None and gnss.fix != FIX_NONE and math.isfinite(gnss.east_m + gnss.north_m):
            fix_tick = self._enter_fix(gnss)
        used = self.counters[m.N_FIXES]
        tick_filter(
            self._xs,
            self._covariances,
            self._inputs,
            self._fixes,
            self._c,
            self.counters,
            frame.tick,
            self._first_tick,
            fix_tick,
        )
        if gnss is not None and gnss.fix == FIX_FIXED and self.counters[m.N_FIXES] > used:
            self.last_used_stamp_s = max(self.last_used_stamp_s, gnss.stamp_s)

    def _enter_fix(self, gnss: GnssSample) -> int:
        tick = math.floor(gnss.stamp_s / TICK_S + 1e-6)
        row = self._fixes[m.RING]
        row[m.FIX_EAST], row[m.FIX_NORTH] = gnss.east_m, gnss.north_m
        row[m.FIX_AFTER] = gnss.stamp_s - tick * TICK_S
        if gnss.fix == FIX_FIXED:
            # What the receiver reports beyond its data sheet is trouble; what it reports less is not believed.
            excess = gnss.variance_m2 - self._c[m.C_R_GNSS] - self._c[m.C_GM_VAR]
            row[m.FIX_VARIANCE] = self._c[m.C_R_GNSS] + max(excess, 0.0)
        else:
            floor = _LOOSE_FIX_FLOOR_M2.get(gnss.fix, 1.0)
            row[m.FIX_VARIANCE] = _LOOSE_FIX_FACTOR * max(gnss.variance_m2, floor)
        return tick

    def _gather(self, frame: SensorFrame) -> None:
        """Average the sensors at standstill and start the filter when a fixed position arrives."""
        if self._still_ticks == 0:
            self._sums[:] = 0.0
            self._sum_ticks = 0
            return
        imu, mag = frame.imu, frame.mag
        gnss = frame.gnss[-1] if frame.gnss else None
        self._sums += (imu.gyro_z_radps, imu.accel_x_mps2, mag.x_t, mag.y_t)
        self._sum_ticks += 1
        if gnss is None or gnss.fix != FIX_FIXED or self._sum_ticks < _START_TICKS:
            return
        if gnss.stamp_s < frame.time_s - (self._sum_ticks - 0.5) * TICK_S:
            return  # from before the robot stood here
        gyro, accel, mag_x, mag_y = (self._sums / self._sum_ticks).tolist()
        c = self._c
        self._slot = frame.tick % m.RING
        x, p = self._xs[self._slot], self._covariances[self._slot]
        heading = math.atan2(mag_x, mag_y)
        cos, sin = math.cos(heading), math.sin(heading)
        ax, ay = c[m.C_ANTENNA_X], c[m.C_ANTENNA_Y]
        x[m.HEADING], x[m.GYRO_BIAS], x[m.ACCEL_BIAS] = heading, gyro, accel
        x[m.EAST] = gnss.east_m - (cos * ax - sin * ay)
        x[m.NORTH] = gnss.north_m - (sin * ax + cos * ay)
        span_s = self._sum_ticks * TICK_S
        arm2 = ax * ax + ay * ay
        position = c[m.C_R_GNSS] + c[m.C_GM_VAR] + arm2 * c[m.C_MAG_VAR]
        diagonal = np.zeros(m.STATES)
        diagonal[[m.EAST, m.NORTH]] = position
        diagonal[m.HEADING] = c[m.C_MAG_VAR] + c[m.C_R_MAG] / self._sum_ticks
        diagonal[m.SPEED], diagonal[m.YAW_RATE] = 1e-6, 1e-6
        diagonal[m.GYRO_BIAS] = self._gyro_start_var / span_s + 1e-10
        diagonal[m.ACCEL_BIAS] = self._accel_start_var / span_s + 1e-6
        diagonal[[m.LEFT_SLIP, m.RIGHT_SLIP]] = c[m.C_SLIP_VAR]
        diagonal[m.MAG_BIAS] = c[m.C_MAG_VAR]
        diagonal[[m.GNSS_EAST, m.GNSS_NORTH]] = c[m.C_GM_VAR]
        p[:] = np.diag(diagonal)
        # The heading's error is the magnetometer's, and the position's holds the slow error of the fix.
        p[m.HEADING, m.MAG_BIAS] = p[m.MAG_BIAS, m.HEADING] = -c[m.C_MAG_VAR]
        for axis, slow in ((m.EAST, m.GNSS_EAST), (m.NORTH, m.GNSS_NORTH)):
            p[axis, slow] = p[slow, axis] = -c[m.C_GM_VAR]
        for axis, arm in ((m.EAST, sin * ax + cos * ay), (m.NORTH, -(cos * ax - sin * ay))):
            p[axis, m.HEADING] = p[m.HEADING, axis] = arm * diagonal[m.HEADING]
            p[axis, m.MAG_BIAS] = p[m.MAG_BIAS, axis] = -arm * c[m.C_MAG_VAR]
        self._first_tick = frame.tick
