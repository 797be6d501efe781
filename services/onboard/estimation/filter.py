"""The estimator: starts itself at standstill, then runs the filter's kernel every tick."""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.estimation.calibration import start_learning
from touchline.services.onboard.estimation.delayed_fusion import advance, take_fix
from touchline.services.onboard.estimation.sample_buffer import STILL_TICKS, Intake
from touchline.services.onboard.estimation.standing import JOLT_MPS2
from touchline.services.onboard.estimation.tail import CONTRADICTED
from touchline.services.onboard.interface import TICK_S, Estimate, GnssSample, SensorFrame

FIX_NONE: Final = 0
FIX_FIXED: Final = 3

_START_TICKS = 25  # at standstill before the biases are worth starting from
_GATHERED_TICKS = 1000  # of which a jolt is told from the rest
_MOST_LEAN_MPS2 = 3.0  # of an accelerometer's reading at standstill, beyond its bias: that is a slope of 30 %
_GATHERED_SIGMAS = 4.0
_ALIGNED_FIXES = 3
_LOOSE_FIX_FACTOR = 20.0  # float and single fixes err slowly: their variance counts for two seconds, not for 0.1 s
_LOOSE_FIX_FLOOR_M2 = {1: 1.0, 2: 0.04}
LEAD_S = 0.005  # by which a receiver's clock may be ahead and still be believed
_ALONE = 4.0  # factor on the white variance of a fix that there is nothing to weigh by: it may be one of the tail
_ACCEPTED_HEADING_VAR = math.radians(0.3) ** 2
JUMP_RUN: Final = 15
"""Outlying fixes in a row (1.5 s) after which they are a jump that the operator may accept."""
_PLACE: Final = [m.EAST, m.NORTH]
_NO_COVARIANCE = np.diag([1e6, 1e6, math.pi**2]).ravel()
_NO_TWIST_COVARIANCE = np.diag([1e6, 1e6]).ravel()


class Estimator:
    """A 12-state EKF that sees nothing but `SensorFrame`s; states and noise in `model`.

    It starts in the tick in which the first RTK-fixed position arrives after a quarter of a second at standstill:
    gyro and accelerometer bias from their means, heading from the magnetometer, position from the fix.
    """

    def __init__(self, vehicle: Vehicle, config: OnboardConfig) -> None:
        """A filter that has seen nothing yet."""
        self._c = m.noise_figures(vehicle, config)
        self._gyro_start_var = config.imu.gyro_density_radps_rthz**2
        self._accel_start_var = config.imu.accel_density_mps2_rthz**2
        self.intake = Intake(vehicle)
        self._xs = np.zeros((m.RING, m.STATES))
        self._covariances = np.zeros((m.RING, m.STATES, m.STATES))
        self._inputs = np.zeros((m.RING, m.INPUTS))
        self._fixes = np.zeros((m.RING + 1, m.FIXES))
        self.counters = np.zeros(m.COUNTERS)
        """(COUNTERS,) counts, NIS sums and the last innovation; indices in `model`."""
        self._slow = np.zeros(m.SLOW)
        self._sums = np.zeros(4)
        self._accels: deque[float] = deque(maxlen=_GATHERED_TICKS)
        self.restart()

    def restart(self) -> None:
        """Forget everything and start again from the sensors: the robot may have been carried elsewhere."""
        self._first_tick = -1
        self._slot = self._tick = 0
        self._gather_anew()
        self._fixes[:] = 0.0
        self._inputs[:] = math.nan  # nothing of it is learned from
        start_learning(self._c, self._slow)
        self.counters[:] = 0.0
        self.last_fix: GnssSample | None = None
        """The newest fix that arrived, used or not; by its stamp, and not from the future."""
        self.last_used_stamp_s = -math.inf
        """Time of validity of the newest RTK-fixed position that was used."""

    @property
    def started(self) -> bool:
        """Whether there is an estimate."""
        return self._first_tick >= 0

    @property
    def aligned(self) -> bool:
        """Whether the filter has settled enough at standstill to drive off.

        The last fix has to agree with those before: should the first one have been far off, it is outweighed only then.
        """
        agreed = self.counters[m.FIX_DOUBT] == 0.0
        return bool(self.started and self.counters[m.N_FIXES] >= _ALIGNED_FIXES and agreed and not self.disputed)

    @property
    def contradicted(self) -> bool:
        """Whether the last fixes are not used, since no honest receiver's would all be so far off."""
        return bool(self.counters[m.FIX_DOUBT] >= CONTRADICTED)

    @property
    def disputed(self) -> bool:
        """Whether the accelerometer contradicts wheels that stand, and is not believed."""
        return bool(self._inputs[self._slot, m.IN_DISPUTED] > 0.0)

    @property
    def wheels_stand(self) -> bool:
        """Whether the wheels have stood for a while, whatever the other sensors say."""
        return self.intake.still_ticks >= STILL_TICKS

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
        accel_mps2 = self.intake.accel_mps2 - x[m.ACCEL_BIAS]
        if self._inputs[self._slot, m.IN_STILL] > 0.0 and abs(accel_mps2) > JOLT_MPS2:
            return float(x[m.SPEED])
        return float(x[m.SPEED] + 0.5 * TICK_S * accel_mps2)

    def estimate(self) -> Estimate:
        """Pose, twist and their covariances of the axle centre at the tick's time."""
        if not self.started:
            return Estimate(0.0, 0.0, 0.0, 0.0, 0.0, _NO_COVARIANCE, _NO_TWIST_COVARIANCE)
        x, p = self._xs[self._slot].tolist(), self._covariances[self._slot]
        twist = m.SPEED, m.YAW_RATE
        return Estimate(
            x[m.EAST],
            x[m.NORTH],
            x[m.HEADING],
            self.speed_now_mps(),
            x[m.YAW_RATE],
            p[:3, :3].ravel(),
            p[np.ix_(twist, twist)].ravel(),
        )

    def step(self, frame: SensorFrame) -> None:
        """Take in a tick's measurements. Frames must come in order, one per tick; what is in them need not."""
        oldest, live = self.intake.take(frame, self._inputs)
        for gnss in frame.gnss:
            newer = self.last_fix is None or gnss.stamp_s > self.last_fix.stamp_s
            if newer and gnss.stamp_s <= frame.time_s + LEAD_S:
                self.last_fix = gnss
        if not self.started:
            self._gather(frame)
            return
        self._slot, self._tick = frame.tick % m.RING, frame.tick
        ring = (self._xs, self._covariances, self._inputs, self._fixes, self._c, self.counters)
        advance(*ring, self._slow, frame.tick, max(oldest, self._first_tick + 1), live)
        for gnss in frame.gnss:
            if gnss.fix == FIX_NONE or not math.isfinite(gnss.stamp_s + gnss.east_m + gnss.north_m + gnss.variance_m2):
                continue
            used = self.counters[m.N_FIXES]
            take_fix(*ring, frame.tick, self._first_tick, self._enter_fix(gnss))
            if gnss.fix == FIX_FIXED and self.counters[m.N_FIXES] > used:
                self.last_used_stamp_s = max(self.last_used_stamp_s, gnss.stamp_s)

    @property
    def jump_m(self) -> float:
        """How far the receiver has lastingly jumped away from the estimate; 0 if it has not."""
        if self.counters[m.N_FIX_OUTLYING_RUN] < JUMP_RUN:
            return 0.0
        return math.hypot(self.counters[m.INNOVATION_EAST], self.counters[m.INNOVATION_NORTH])

    def accept_jump(self) -> None:
        """Believe the receiver, as the operator wants it: the robot stands where its last fix says.

        The position and its slow error start anew there; heading, biases and slips stay.
        """
        fix = self.last_fix
        assert fix is not None, "there is no jump without a fix"
        self.covariance[m.HEADING, m.HEADING] += _ACCEPTED_HEADING_VAR
        self._place(self.state, self.covariance, fix)
        self._fixes[:] = 0.0
        # Nothing from before this tick is run again.
        self._first_tick = self._tick
        self.counters[[m.N_FIX_OUTLYING_RUN, m.FIX_DOUBT, m.NIS_FIX_RECENT]] = 0.0
        self.counters[m.N_RECOVERIES] += 1.0

    def _place(self, x: NDArray[np.float64], p: NDArray[np.float64], fix: GnssSample) -> None:
        """Put the axle where a fix says, into a state and its covariance, whose heading is known already.

        Its place is the fix less the fix's error and less the lever, which turns with the heading and all that goes
        with that.
        """
        c, slows = self._c, [m.GNSS_EAST, m.GNSS_NORTH]
        cos, sin = math.cos(x[m.HEADING]), math.sin(x[m.HEADING])
        ax, ay = c[m.C_ANTENNA_X], c[m.C_ANTENNA_Y]
        x[_PLACE] = fix.east_m - (cos * ax - sin * ay), fix.north_m - (sin * ax + cos * ay)
        x[slows] = 0.0
        p[_PLACE + slows, :] = 0.0
        p[:, _PLACE + slows] = 0.0
        p[slows, slows] = c[m.C_GM_VAR]
        p[_PLACE, slows] = p[slows, _PLACE] = -c[m.C_GM_VAR]
        lever = np.zeros((2, m.STATES))
        lever[:, m.HEADING] = sin * ax + cos * ay, sin * ay - cos * ax
        turned = lever @ p
        p[_PLACE, :] += turned
        p[:, _PLACE] += turned.T
        p[np.ix_(_PLACE, _PLACE)] += turned @ lever.T + np.eye(2) * (_ALONE * c[m.C_R_GNSS] + c[m.C_GM_VAR])

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
        if self.intake.still_ticks == 0:
            self._gather_anew()
            return
        imu, mag = frame.imu, frame.mag
        gnss = max(frame.gnss, key=lambda fix: fix.stamp_s, default=None)
        self._sums += (imu.gyro_z_radps, imu.accel_x_mps2, mag.x_t, mag.y_t)
        self._sum_ticks += 1
        self._accels.append(imu.accel_x_mps2)
        if gnss is None or gnss.fix != FIX_FIXED or self._sum_ticks < _START_TICKS:
            return
        if gnss.stamp_s < frame.time_s - (self._sum_ticks - 0.5) * TICK_S:
            return  # from before the robot stood here
        gyro, accel, mag_x, mag_y = (self._sums / self._sum_ticks).tolist()
        accel, c = self._without_jolts(accel), self._c
        if abs(accel) > _MOST_LEAN_MPS2 + _GATHERED_SIGMAS * math.sqrt(c[m.C_SIDE_BIAS_VAR]):
            self._gather_anew()
            return
        self._slot = frame.tick % m.RING
        x, p = self._xs[self._slot], self._covariances[self._slot]
        x[m.HEADING], x[m.GYRO_BIAS], x[m.ACCEL_BIAS] = math.atan2(mag_x, mag_y), gyro, accel
        span_s = self._sum_ticks * TICK_S
        diagonal = np.zeros(m.STATES)
        diagonal[m.HEADING] = c[m.C_MAG_VAR] + c[m.C_R_MAG] / self._sum_ticks
        diagonal[m.SPEED], diagonal[m.YAW_RATE] = 1e-6, 1e-6
        diagonal[m.GYRO_BIAS] = self._gyro_start_var / span_s + 1e-10
        diagonal[m.ACCEL_BIAS] = self._accel_start_var / span_s + 1e-6
        diagonal[[m.LEFT_SLIP, m.RIGHT_SLIP]] = c[m.C_SLIP_VAR]
        diagonal[m.MAG_BIAS] = c[m.C_MAG_VAR]
        p[:] = np.diag(diagonal)
        # The heading's error is the magnetometer's.
        p[m.HEADING, m.MAG_BIAS] = p[m.MAG_BIAS, m.HEADING] = -c[m.C_MAG_VAR]
        self._place(x, p, gnss)
        self._inputs[self._slot, m.IN_RISE_EAST :] = 0.0  # nothing has been learned yet
        self._first_tick = frame.tick

    def _gather_anew(self) -> None:
        self._sums[:] = 0.0
        self._sum_ticks = 0
        self._accels.clear()

    def _without_jolts(self, mean_mps2: float) -> float:
        """The mean of what the accelerometer said at standstill, less what is far from most of it."""
        gathered = np.array(self._accels)
        middle = np.sort(gathered)[len(gathered) // 2]
        calm = np.abs(gathered - middle) <= JOLT_MPS2
        return mean_mps2 if calm.all() else float(gathered[calm].mean())
