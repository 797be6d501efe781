"""Carries the onboard computer's state into the kernels of its quiet ticks, and back."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque

import numpy as np

from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard import carried as c
from touchline.services.onboard.carried import Ring, Way
from touchline.services.onboard.computer import Onboard
from touchline.services.onboard.control import Follower
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.estimation.sample_buffer import MAG_EVERY_TICKS
from touchline.services.onboard.executive import failsafe as h
from touchline.services.onboard.executive.mission import MissionPhase
from touchline.services.onboard.interface import Command, GnssSample, ImuSample
from touchline.services.onboard.trajectory import path_projection as t
from touchline.services.onboard.trajectory.path import FORWARD


class Cruise:
    """Carries the state of an `Onboard` into the kernels and back; it knows that room's insides.

    Attributes:
        state, constants, flows, saved, ring, way, ahead: What the kernels are given; valid after `begin`.
    """

    def __init__(self, onboard: Onboard, vehicle: Vehicle) -> None:
        """For this computer, whatever it has loaded."""
        self._onboard = onboard
        self._traversal, self._watch, self._hazards = onboard._traversal, onboard._watch, onboard._hazards
        self._estimator, self._intake = onboard._estimator, onboard._estimator.intake
        estimator = self._estimator
        self.ring: Ring = (
            estimator._xs,
            estimator._covariances,
            estimator._inputs,
            estimator._fixes,
            estimator._c,
            estimator.counters,
            estimator._slow,
        )
        self.state = np.zeros(c.STATE_SIZE)
        self.constants = np.zeros(c.CONSTANTS)
        self.flows = np.zeros(h.FLOW_WINDOW_TICKS)
        self.saved = np.zeros(t.PROGRESS + t.NOW)
        self.ahead = np.zeros((0, t.AHEAD_COLUMNS))
        self.way: Way = (*(np.zeros((0, 0)),) * 2, *(np.zeros(0),) * 6, *(np.zeros((0, 2)),) * 2)
        hazards, k = self._hazards, self.constants
        k[c.K_RADIUS] = vehicle.drive.wheel_radius_m
        k[c.K_LAG], k[c.K_MAX_STEP], k[c.K_NOMINAL_L] = hazards._lag, hazards._max_step, hazards._nominal_l
        k[c.K_SETTLE_TICKS] = hazards._settle_ticks
        k[c.K_FIX_AGE] = self._watch.fix_age_s
        k[c.K_VALVE_ON], k[c.K_VALVE_OFF] = vehicle.tool.valve_on_delay_s, vehicle.tool.valve_off_delay_s

    @property
    def follower(self) -> Follower:
        """What is asked between `steer` and `obey`."""
        return self._onboard._follower

    def begin(self, tick: int) -> bool:
        """Take over after `tick`, if nothing is the matter."""
        job, estimator, hazards, intake = self._traversal.job, self._estimator, self._hazards, self._intake
        fix, fence = estimator.last_fix, hazards.fence
        if (
            job is None
            or fix is None
            or fence is None
            or intake._reading is None
            or self._traversal.state != TraversalStatus.RUNNING
            or self._traversal.reason
        ):
            return False
        driver, sprayer, plan = job.driver, job.sprayer, job.plan
        along = job._phase is MissionPhase.ALONG and driver.leg.sense == FORWARD and sprayer.owed_from_m is None
        worried = self._watch.pose_problem or hazards.emergency or hazards.stop or any(hazards._wheel_s)
        away = hazards._outside_s > 0.0 or hazards._unheard_s > 0.0 or hazards.dry_s > 0.0
        if not along or worried or away or self.follower.can_fail or not intake.imu_tick == intake.encoder_tick == tick:
            return False
        s, k = self.state, self.constants
        s[c.STILL], s[c.ACCEL], s[c.RATE : c.RATE + 2] = intake.still_ticks, intake.accel_mps2, intake.encoder_rates
        s[c.ANGLE], s[c.ANGLE + 1] = intake._left_rad, intake._right_rad
        s[c.READING : c.READING + 6], s[c.RATE_THEN : c.RATE_THEN + 2] = intake._reading, intake._rates_then
        s[c.FIX : c.FIX + c.FIX_COLUMNS] = fix
        s[c.LAST_USED], s[c.FIRST_TICK] = estimator.last_used_stamp_s, estimator._first_tick
        s[c.EXPECTED : c.EXPECTED + 2] = hazards._expected
        s[c.TANK], s[c.FLOW_SUM], s[c.FLOW_VALVE] = hazards._tank_l, hazards._flow_sum_l, hazards._valve
        s[c.FLOW_TICKS], s[c.FLOW_COUNT], s[c.FLOW_FIRST] = hazards._valve_ticks, len(hazards._flow), 0
        self.flows[: len(hazards._flow)] = hazards._flow
        s[c.ELAPSED], s[c.COMMAND : c.VALVE_AFTER + 1] = self._traversal._elapsed_s, self._onboard._command
        s[c.SPRAYED_TO], s[c.FALLS_FROM], s[c.FALLS_TO] = sprayer._last_m, sprayer.falls_from_m, sprayer.falls_to_m
        s[c.SWITCH] = bisect_right(plan.switch_m, sprayer._last_m) - 1
        k[c.K_FENCE_MARGIN], k[c.K_BODY_RADIUS], k[c.K_LEG_END] = fence.margin_m, fence.radius_m, driver.leg.end_m
        self.ahead = driver._ahead
        switch_m, actuation = np.array(plan.switch_m), np.array(plan.actuation, dtype=np.float64)
        moving = (driver._progress, driver._limits, driver.now, driver._body)
        self.way = (driver._rows, plan.speeds, switch_m, actuation, *moving, fence.outline, fence.body)
        return True

    def end(self, tick: int, *, sensed: int) -> Command:
        """Give back after `tick`, the last whole one; the estimator has seen all up to `sensed`.

        The valve may have switched once since `begin`, and no more: what was painted is counted here.
        """
        s, job = self.state.tolist(), self._traversal.job
        estimator, hazards, intake = self._estimator, self._hazards, self._intake
        assert job is not None, "it was there at the beginning"
        intake.imu_tick = intake.encoder_tick = sensed
        intake._mag_tick = max(intake._mag_tick, sensed - sensed % MAG_EVERY_TICKS)
        intake.still_ticks, intake.accel_mps2 = int(s[c.STILL]), s[c.ACCEL]
        intake.encoder_rates = (s[c.RATE], s[c.RATE + 1])
        intake._left_rad, intake._right_rad = s[c.ANGLE], s[c.ANGLE + 1]
        intake._reading = ImuSample(*s[c.READING : c.READING + 6])
        intake._rates_then = (s[c.RATE_THEN], s[c.RATE_THEN + 1])
        stamp, east, north, variance, fix, satellites, age = s[c.FIX : c.FIX + c.FIX_COLUMNS]
        estimator.last_fix = GnssSample(stamp, east, north, variance, int(fix), int(satellites), age)
        estimator.last_used_stamp_s = s[c.LAST_USED]
        estimator._slot, estimator._tick = sensed % m.RING, sensed
        hazards._expected = [s[c.EXPECTED], s[c.EXPECTED + 1]]
        first, count = int(s[c.FLOW_FIRST]), int(s[c.FLOW_COUNT])
        hazards._flow = deque(np.roll(self.flows, -first)[:count].tolist(), h.FLOW_WINDOW_TICKS)
        hazards._tank_l, hazards._flow_sum_l = s[c.TANK], s[c.FLOW_SUM]
        hazards._valve, hazards._valve_ticks = s[c.FLOW_VALVE] > 0.0, int(s[c.FLOW_TICKS])
        self._watch._tick = tick
        left, right, valve, disc, after_s = s[c.COMMAND : c.VALVE_AFTER + 1]
        command = Command(left, right, valve > 0.0, disc > 0.0, after_s)
        job._last = self._onboard._command = command
        sprayer, was_open = job.sprayer, job.sprayer.valve
        sprayer.valve, sprayer._last_m = command.valve, s[c.SPRAYED_TO]
        sprayer.falls_from_m, sprayer.falls_to_m = s[c.FALLS_FROM], s[c.FALLS_TO]
        if was_open and not sprayer.valve:
            sprayer.note_closed()
        self._traversal._elapsed_s, self._traversal._time_s = s[c.ELAPSED], tick / 100
        self._onboard._estimate = None
        return command
