"""Estimator: starts itself at standstill, then runs the filter's kernel every tick.

It is an extended Kalman filter (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, Estimation with Applications to Tracking
and Navigation, Wiley 2001, section 10.3), whose states are in `filter_model`; innovations pass χ² gates (section 5.4).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import nearest_turn
from touchline.core.records import RecordArray
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import ComputerState, ReceivedFix
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.adaptation import FIRST_WANDER, SEEN_SHARE
from touchline.onboard.estimation.aiding.encoder_aiding import STILL_TICKS
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.calibration import start_learning
from touchline.onboard.estimation.claimed_covariance import claim_pose
from touchline.onboard.estimation.consistency_monitor import MOVING_MPS
from touchline.onboard.estimation.delayed_fusion import take_row
from touchline.onboard.estimation.filter_tick import speed_now_mps, take_frame
from touchline.onboard.estimation.learned_constants import LearnedConstant, learned_constants
from touchline.onboard.estimation.noise import noise_figures
from touchline.onboard.estimation.received import received
from touchline.onboard.estimation.standing import JOLT_MPS2
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.interface import (
    TICK_S,
    TICKS_PER_S,
    Estimate,
    SensorFrame,
)
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import ODOMETRY, Vehicle

Floats = NDArray[np.float64]

_START_TICKS = 25  # at standstill before the biases are worth starting from
_GATHERED_TICKS = 1000  # of which a jolt is told from the rest
_MOST_LEAN_MPS2 = 3.0  # of an accelerometer's reading at standstill, beyond its bias: that is a slope of 30 %
_GATHERED_SIGMAS = 4.0
_ALIGNED_FIXES = 3
_ALONE = 4.0  # factor on the white variance of a fix that there is nothing to weigh by: it may be one of the tail
_ACCEPTED_HEADING_VAR = math.radians(0.3) ** 2
JUMP_RUN: Final = 15
"""Number of outlying fixes in a row (1.5 s) from which they are a jump that the operator may accept."""
_PLACE: Final = [m.EAST, m.NORTH]
_NO_COVARIANCE = np.diag([1e6, 1e6, math.pi**2]).ravel()
_NO_TWIST_COVARIANCE = np.diag([1e6, 1e6]).ravel()
_TWIST = np.ix_((m.SPEED, m.YAW_RATE), (m.SPEED, m.YAW_RATE))


class AcceptedJump(NamedTuple):
    """Move of the estimate to the receiver's position.

    Attributes:
        moved_m: Distance.
        seen_m: Largest distance that the receiver moved beyond odometry from one fix to the next.
        ahead_m: Part of the move that is ahead of the robot.
    """

    moved_m: float
    seen_m: float
    ahead_m: float

    @property
    def of_receiver(self) -> bool:
        """True if the receiver has jumped; else the estimate had drifted away from it."""
        return self.seen_m >= SEEN_SHARE * self.moved_m


class Gathered(NamedTuple):
    """Readings that an estimator has gathered at standstill before it starts.

    Attributes:
        sums: Sums of gyro z [rad/s], accelerometer x [m/s²], magnetometer x and y [T].
        ticks: Number of ticks of these sums.
        accels: The newest readings of the accelerometer [m/s²].
        told: Pose from which odometry alone starts: east [m], north [m], heading [rad]; None if none was given.
    """

    sums: tuple[float, ...]
    ticks: int
    accels: tuple[float, ...]
    told: tuple[float, float, float] | None

    @classmethod
    def from_json(cls, values: Sequence[Any]) -> Self:
        """Return the readings with the values that this tuple has in JSON.

        Raises:
            ValueError, TypeError: The values are not such.
        """
        sums, ticks, accels, told = values
        pose = None if told is None else (float(told[0]), float(told[1]), float(told[2]))
        return cls(tuple(map(float, sums)), int(ticks), tuple(map(float, accels)), pose)


class Estimator:
    """16-state EKF on `SensorFrame`s alone; its states are in `filter_model`, its noise figures in `noise`.

    It starts in the tick in which the first RTK-fixed position arrives after a quarter of a second at standstill:
    gyro and accelerometer bias from their means, heading from the magnetometer, position from the fix. A camera's pose
    has a heading, too. With odometry alone it starts by itself, from the pose that it is given.

    Args:
        vehicle: Vehicle.
        config: Configuration, which has the data sheets.
        computer: State that the estimator's state is a part of; None: a new one.
    """

    def __init__(self, vehicle: Vehicle, config: OnboardConfig, computer: ComputerState | None = None) -> None:
        """Create a filter without any measurement."""
        self._gyro_start_var = config.imu.gyro_density_radps_rthz**2
        self._accel_start_var = config.imu.accel_density_mps2_rthz**2
        self._computer = computer or ComputerState.sized(len(vehicle.drive.actuators))()
        self.buffer, self.times, self.ring = self._computer.buffer, self._computer.times, self._computer.filter
        drive = drive_of(vehicle, config.drive.track_width_relative)
        self.drive = drive.figures
        self.ring.figures.assign(noise_figures(vehicle, config, drive))
        self._sums = np.zeros(4)
        self._accels: deque[float] = deque(maxlen=_GATHERED_TICKS)
        self._told = config.odometry if vehicle.positioning == ODOMETRY else None
        self._jump_fixes = config.gnss.jump_fixes
        start_learning(self.ring.figures, self.ring.learned)
        self.restart()

    def restart(self, told: tuple[float, float, float] | None = None, learned: tuple[float, ...] = ()) -> None:
        """Forget everything but what the robot is like, and start again from the sensors: it may be elsewhere.

        Args:
            told: Pose by people's knowledge: east [m], north [m], heading [rad]; odometry alone has nothing else.
            learned: What another process had learned of this robot, see `learned`.
        """
        known = learned if learned and not self.started else self.learned
        self._told_pose = told
        self.times.reset()
        self._gather_anew()
        self.ring.fixes.reset()
        self.ring.update_counts[:] = 0
        self.ring.inputs.reset()  # nothing of it is learned from
        start_learning(self.ring.figures, self.ring.learned)
        self._recall(known)
        self.counters.reset()
        self.ring.blind.reset()

    @property
    def learned(self) -> tuple[float, ...]:
        """Figures of the robot that it has learned, and that stay wherever it is.

        Constants less what the files say, their variances, bias of the left accelerometer [m/s²] and its variance.
        """
        kept = self.ring.learned
        constants, variances = kept.constants, kept.constant_var
        if self.started:
            constants, variances = self.state[m.CONSTANTS], np.diag(self.covariance)[m.CONSTANTS]
        return (*constants.tolist(), *variances.tolist(), kept.side_bias_mps2, kept.bias_var)

    def _recall(self, learned: tuple[float, ...]) -> None:
        kept, count = self.ring.learned, len(self.ring.learned.constants)
        kept.constants[:], kept.constant_var[:] = learned[:count], learned[count : 2 * count]
        kept.side_bias_mps2, kept.bias_var = learned[2 * count :]

    @property
    def gathered(self) -> Gathered | None:
        """Readings gathered so far to start from; None if it has started."""
        if self.started:
            return None
        return Gathered(tuple(self._sums.tolist()), self._sum_ticks, tuple(self._accels), self._told_pose)

    @gathered.setter
    def gathered(self, gathered: Gathered | None) -> None:
        if gathered is None:
            return
        self._sums[:], self._sum_ticks, accels, self._told_pose = gathered
        self._accels = deque(accels, maxlen=_GATHERED_TICKS)

    @property
    def counters(self) -> m.FilterCounters:
        """Counts, NIS sums and the last innovation."""
        return self.ring.counters

    @property
    def last_fix(self) -> ReceivedFix | None:
        """Newest fix that arrived, used or not; by its stamp, and not from the future."""
        return self.times.fix if self.times.has_fix else None

    @property
    def started(self) -> bool:
        """True if there is an estimate."""
        return self.times.first_tick >= 0

    @property
    def aligned(self) -> bool:
        """True if the filter has settled enough at standstill to drive off.

        The last fix has to agree with those before: only then a first one that was far off is outweighed.
        """
        settled = self.counters.fixes >= _ALIGNED_FIXES and self.counters.fix_doubt == 0.0
        return self.started and (settled or self._told is not None) and not self.disputed

    @property
    def contradicted(self) -> bool:
        """True if the last fixes are rejected, because it is too unlikely that honest ones are all so far off."""
        return self.counters.fix_doubt >= CONTRADICTED

    @property
    def disputed(self) -> bool:
        """True if the accelerometer contradicts wheels that stand, and is not used."""
        return self.ring.inputs[self._slot].disputed_ticks > 0

    @property
    def wheels_stand(self) -> bool:
        """True if the wheels have stood for a while, whatever the other sensors say."""
        return self.buffer.still_ticks >= STILL_TICKS

    @property
    def _slot(self) -> int:
        return self.times.tick % m.RING

    @property
    def state(self) -> Floats:
        """Current state, (STATES,); a view."""
        row: Floats = self.ring.states[self._slot]
        return row

    @property
    def covariance(self) -> Floats:
        """Covariance of the current state, (STATES, STATES); a view."""
        matrix: Floats = self.ring.covariances[self._slot]
        return matrix

    @property
    def fix_lag(self) -> int:
        """Number of fixes between innovations that are independent if all is right."""
        return m.FIX_LAG if self.ring.figures.burst_var > 0.0 else 1

    @property
    def constants(self) -> tuple[LearnedConstant, ...]:
        """Constants of the robot as they have been learned; none before there is an estimate."""
        return learned_constants(self.state, self.covariance, self.ring.figures) if self.started else ()

    @property
    def position_sigma_m(self) -> float:
        """Larger standard deviation of the two horizontal axes [m], slow GNSS error included."""
        if not self.started:
            return math.inf
        east_var, north_var, _ = self.pose_covariance.diagonal().tolist()
        return math.sqrt(max(east_var, north_var))

    @property
    def heading_sigma_rad(self) -> float:
        """Standard deviation of the heading [rad]."""
        return math.sqrt(self.pose_covariance[2, 2]) if self.started else math.inf

    @property
    def pose_covariance(self) -> Floats:
        """Covariance of the pose that is claimed, (3, 3) east [m], north [m], heading [rad]; see `claim`."""
        row = np.empty(9)
        claim_pose(self._computer.array, row)
        return row.reshape(3, 3)

    def speed_now_mps(self) -> float:
        """Return the speed at the end of the tick [m/s]."""
        return float(speed_now_mps(self._computer.array))

    def estimate(self) -> Estimate:
        """Return pose and twist of the axle centre, with their covariances, at the end of the tick."""
        if not self.started:
            return Estimate(0.0, 0.0, 0.0, 0.0, 0.0, _NO_COVARIANCE, _NO_TWIST_COVARIANCE)
        x, p = self.state.tolist(), self.covariance
        return Estimate(
            x[m.EAST],
            x[m.NORTH],
            x[m.HEADING],
            self.speed_now_mps(),
            x[m.YAW_RATE],
            self.pose_covariance.ravel(),
            p[_TWIST].ravel(),
        )

    def step(self, frame: SensorFrame) -> None:
        """Process the measurements of a tick.

        Args:
            frame: Frame of the tick. Frames come in order, one per tick; the measurements in them may come late.
        """
        self._computer.frame.fill(frame)
        fixes, started = received(frame), self.started
        take_frame(frame.tick, fixes.array, len(fixes), self.drive, self._computer.array)
        if not started:
            self._gather(frame, fixes)

    def prepare_rows(self) -> None:
        """Compile `take_row`, before the robot would have to wait for it."""
        self._take_row = take_row.for_types_of((self._computer.array, self.drive, 0, np.zeros(m.UPDATE_COLUMNS)))

    def take_row(self, at: int, row: Floats) -> bool:
        """Use a scalar measurement of an auxiliary sensor; see `delayed_fusion.take_row`.

        Args:
            at: Tick in which it is valid.
            row: (UPDATE_COLUMNS,) Jacobian, value and variance.
        """
        return bool(self._take_row(self._computer.array, self.drive, at, row))

    def accept_lasting_jump(self) -> AcceptedJump | None:
        """Accept a jump of the receiver, if the configuration allows that without the operator.

        Returns:
            The jump; None if there is none, or the operator is to be asked.
        """
        counters, fix = self.counters, self.last_fix
        if self._jump_fixes is None or counters.fixes_outlying_run < self._jump_fixes:
            return None
        if fix is None or fix.fix != FIX_FIXED or not self.contradicted:
            return None
        off_m = math.hypot(counters.innovation_east_m, counters.innovation_north_m)
        seen = counters.outlying_step_m >= SEEN_SHARE * off_m
        if not seen and self.ring.blind.wander == 0.0 and abs(self.state[m.SPEED]) >= MOVING_MPS:
            self.ring.blind.wander = FIRST_WANDER  # that is no jump: see `adaptation.strays`
            return None
        return self.accept_jump()

    @property
    def jump_m(self) -> float:
        """Distance by which the receiver has lastingly jumped away from the estimate [m]; 0 if it has not."""
        if self.counters.fixes_outlying_run < JUMP_RUN:
            return 0.0
        return math.hypot(self.counters.innovation_east_m, self.counters.innovation_north_m)

    def accept_jump(self) -> AcceptedJump:
        """Set the robot to the place of its last fix, moved on by what it has driven since, as the operator wants it.

        The position and its slow error start anew there. Heading, biases and slips stay, unless a camera gives the
        heading.
        """
        fix, counters = self.last_fix, self.counters
        assert fix is not None, "there is no jump without a fix"
        moved_m = math.hypot(counters.innovation_east_m, counters.innovation_north_m)
        before = self.state[_PLACE].copy()
        self.covariance[m.HEADING, m.HEADING] += _ACCEPTED_HEADING_VAR
        if not math.isnan(fix.heading_rad):
            self._face(self.state, self.covariance, fix.heading_rad, fix.heading_variance_rad2)
        driven = self._driven_since(fix)
        self._place(self.state, self.covariance, fix, _ALONE * self.ring.figures.r_gnss)
        self.state[_PLACE] += driven
        heading_rad = self.state[m.HEADING]
        ahead_m = float((self.state[_PLACE] - before) @ (math.cos(heading_rad), math.sin(heading_rad)))
        jump = AcceptedJump(moved_m, counters.outlying_step_m, ahead_m)
        self.ring.fixes.reset()
        # Nothing from before this tick is run again.
        self.times.first_tick = self.times.tick
        counters.fixes_outlying_run, counters.fix_doubt, counters.fix_nis_recent = 0, 0.0, 0.0
        counters.outlying_step_m = 0.0
        counters.recoveries += 1
        return jump

    def _driven_since(self, fix: ReceivedFix) -> Floats:
        """Return how far the axle has moved since a fix, (2,) east and north [m]; 0 if that is not known any more."""
        at = math.floor(fix.stamp_s * TICKS_PER_S + 1e-6)
        if not max(self.times.first_tick, self.times.tick - m.RING + 2) <= at <= self.times.tick:
            return np.zeros(2)
        driven: Floats = self.state[_PLACE] - self.ring.states[at % m.RING][_PLACE]
        return driven

    def _face(self, x: Floats, p: Floats, heading_rad: float, variance_rad2: float) -> None:
        """Set the heading in a state and its covariance, without regard to what was known of it."""
        x[m.HEADING] = nearest_turn(heading_rad, x[m.HEADING])
        p[m.HEADING, :] = p[:, m.HEADING] = 0.0
        p[m.HEADING, m.HEADING] = max(variance_rad2, self.ring.figures.r_heading)

    def _place(self, x: Floats, p: Floats, fix: ReceivedFix, variance_m2: float) -> None:
        """Set the axle's position in a state and its covariance by a fix; the heading is known already.

        Its place is the fix less the fix's error and less the lever, which turns with the heading and all that goes
        with that. The variance is that of the fix along an axis, without its slow error.
        """
        c, slows = self.ring.figures, [m.GNSS_EAST, m.GNSS_NORTH]
        cos, sin = math.cos(x[m.HEADING]), math.sin(x[m.HEADING])
        ax, ay = c.antenna_x_m + x[m.ANTENNA_X], c.antenna_y_m + x[m.ANTENNA_Y]
        x[_PLACE] = fix.east_m - (cos * ax - sin * ay), fix.north_m - (sin * ax + cos * ay)
        x[slows] = 0.0
        p[_PLACE + slows, :] = 0.0
        p[:, _PLACE + slows] = 0.0
        p[slows, slows] = c.gnss_var
        p[_PLACE, slows] = p[slows, _PLACE] = -c.gnss_var
        lever = np.zeros((2, m.STATES))
        lever[:, m.HEADING] = sin * ax + cos * ay, sin * ay - cos * ax
        lever[:, m.ANTENNA_X], lever[:, m.ANTENNA_Y] = (-cos, -sin), (sin, -cos)
        turned = lever @ p
        p[_PLACE, :] += turned
        p[:, _PLACE] += turned.T
        variance_m2 += c.gnss_var + c.slow_var
        p[np.ix_(_PLACE, _PLACE)] += turned @ lever.T + np.eye(2) * variance_m2

    def _gather(self, frame: SensorFrame, fixes: RecordArray[ReceivedFix]) -> None:
        """Average the sensors at standstill and start the filter when a fixed position arrives, or without one."""
        if self.buffer.still_ticks == 0:
            self._gather_anew()
            return
        imu, mag = frame.imu, frame.mag
        newest = max(fixes, key=lambda fix: fix.stamp_s, default=None)
        position = newest if self._told is None else self._believed()
        self._sums += (imu.gyro_z_radps, imu.accel_x_mps2, mag.x_t, mag.y_t)
        self._sum_ticks += 1
        self._accels.append(imu.accel_x_mps2)
        if position is None or position.fix != FIX_FIXED or self._sum_ticks < _START_TICKS:
            return
        if position.stamp_s < frame.time_s - (self._sum_ticks - 0.5) * TICK_S:
            return  # from before the robot stood here
        gyro, accel, mag_x, mag_y = (self._sums / self._sum_ticks).tolist()
        if mag_x == mag_y == 0.0 and math.isnan(position.heading_rad):
            return  # no sensor has told the heading
        # Of a sensor that is not there, no bias is to be learned.
        c = self.ring.figures
        gyro = 0.0 if math.isnan(gyro) else gyro / c.gyro_scale
        accel = 0.0 if math.isnan(accel) else self._without_jolts(accel)
        if abs(accel) > _MOST_LEAN_MPS2 + _GATHERED_SIGMAS * math.sqrt(c.side_bias_var):
            self._gather_anew()
            return
        self.times.first_tick = self.times.tick = frame.tick
        x, p = self.state, self.covariance
        x[m.HEADING], x[m.GYRO_BIAS], x[m.ACCEL_BIAS] = math.atan2(mag_x, mag_y), gyro, accel
        span_s = self._sum_ticks * TICK_S
        diagonal = np.zeros(m.STATES)
        diagonal[m.HEADING] = c.mag_var + c.r_mag / self._sum_ticks
        diagonal[m.SPEED], diagonal[m.YAW_RATE] = 1e-6, 1e-6
        diagonal[m.GYRO_BIAS] = self._gyro_start_var / span_s + 1e-10
        diagonal[m.ACCEL_BIAS] = self._accel_start_var / span_s + 1e-6
        diagonal[m.ODOMETRY_ERROR : m.ODOMETRY_ERROR + 2] = c.slip_var
        diagonal[m.MAG_BIAS], diagonal[m.CONSTANTS] = c.mag_var, self.ring.learned.constant_var
        x[m.CONSTANTS] = self.ring.learned.constants
        p[:] = np.diag(diagonal)
        # The heading's error is the magnetometer's.
        p[m.HEADING, m.MAG_BIAS] = p[m.MAG_BIAS, m.HEADING] = -c.mag_var
        if not math.isnan(position.heading_rad):
            self._face(x, p, position.heading_rad, position.heading_variance_rad2)
        self._place(x, p, position, _ALONE * c.r_gnss if self._told is None else position.variance_m2)
        self.ring.learned.start_east_m, self.ring.learned.start_north_m = x[_PLACE].tolist()
        z = self.ring.inputs[self._slot]  # nothing has been learned yet
        z.rise_east_mps2 = z.rise_north_mps2 = z.rise_var = z.waves_var = 0.0
        z.error_mean[:], z.smooth[:] = 0.0, 0.0

    def _believed(self) -> ReceivedFix | None:
        """Return the pose that odometry alone starts from, as a fix that is always there; None if it has none."""
        sheet, pose = self._told, self._told_pose
        if sheet is None or pose is None:
            return None
        east_m, north_m, heading_rad = pose
        return ReceivedFix(
            stamp_s=math.inf,
            east_m=east_m,
            north_m=north_m,
            variance_m2=sheet.start_sigma_m**2,
            fix=FIX_FIXED,
            heading_rad=heading_rad,
            heading_variance_rad2=sheet.start_sigma_rad**2,
        )

    def _gather_anew(self) -> None:
        self._sums[:] = 0.0
        self._sum_ticks = 0
        self._accels.clear()

    def _without_jolts(self, mean_mps2: float) -> float:
        """Return the mean of the accelerometer's readings at standstill without those far from the median [m/s²]."""
        gathered = np.array(self._accels)
        middle = np.sort(gathered)[len(gathered) // 2]
        calm = np.abs(gathered - middle) <= JOLT_MPS2
        return mean_mps2 if calm.all() else float(gathered[calm].mean())
