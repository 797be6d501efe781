"""Drives along a loaded trajectory: tracking and follower joined, one call per tick."""

from __future__ import annotations

import math

import numpy as np

from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S
from services.robot_sim.onboard import tracking as t
from services.robot_sim.onboard.estimator import model as m
from services.robot_sim.onboard.estimator.filter import Estimator
from services.robot_sim.onboard.followers import Follower
from services.robot_sim.onboard.trajectory import LoadedTrajectory

ACCELERATION_MARGIN = 1.2
"""The reference may speed up this much harder than the plan does, to catch up after a pause."""
BACK_SPEED_MPS = 0.4
STOPPED_MPS = 0.02
END_TOLERANCE_M = 0.01
_LOCATE_STEPS = 30  # of at most 5 cm each
_SLIP_LIMIT = 0.15  # of what the feed-forward makes up for


class Driver:
    """Progress along one trajectory.

    Attributes:
        now: (NOW,) of `tracking`, of the last tick.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, follower: Follower) -> None:
        """At the start of `plan`."""
        self._plan = plan
        self._follower = follower
        self._radius_m = vehicle.wheel_radius_m
        self._track_m = vehicle.track_width_m
        self._half_tick = 1.0 - math.exp(-0.5 * TICK_S / max(vehicle.motor_time_constant_s, TICK_S))
        self._progress = np.zeros(t.PROGRESS)
        self._limits = np.zeros(t.LIMITS)
        self._limits[t.L_ACCELERATE] = vehicle.max_acceleration_mps2 * ACCELERATION_MARGIN
        self._limits[t.L_BRAKE] = vehicle.max_acceleration_mps2
        self._limits[t.L_BACK_SPEED] = BACK_SPEED_MPS
        self._limits[t.L_NOZZLE_X], self._limits[t.L_NOZZLE_Y] = vehicle.nozzle_x_m, vehicle.nozzle_y_m
        self._ahead = np.zeros((t.AHEAD_TICKS, t.AHEAD_COLUMNS))
        self.now = np.zeros(t.NOW)
        follower.reset()

    @property
    def arc_length_m(self) -> float:
        """Progress of the axle centre along the path."""
        return float(self._progress[t.P_ARC])

    @property
    def segment(self) -> int:
        """Index of the path segment under the robot."""
        return int(self._progress[t.P_SEGMENT])

    @property
    def reference_mps(self) -> float:
        """Reference speed, negative when going back."""
        return float(self._progress[t.P_SPEED])

    @property
    def at_end(self) -> bool:
        """Whether the whole path is done."""
        return self.arc_length_m >= self._plan.total_length_m - END_TOLERANCE_M

    def halt(self) -> None:
        """The robot stands: the next motion starts from nothing."""
        self._progress[t.P_SPEED] = 0.0
        self._follower.reset()

    def step(
        self, estimator: Estimator, command: tuple[float, float], mode: int, back_to_m: float = 0.0
    ) -> tuple[float, float]:
        """Wheel speeds (left, right) [rad/s] for the coming tick; `command` are those of the last one."""
        x = estimator.state.tolist()
        now = self.now
        self._limits[t.L_BACK_TO] = back_to_m
        now[t.SPEED] = estimator.speed_now_mps()
        now[t.LEFT_RADIUS] = self._radius_m * (1.0 - _bounded(x[m.LEFT_SLIP]))
        now[t.RIGHT_RADIUS] = self._radius_m * (1.0 - _bounded(x[m.RIGHT_SLIP]))
        now[t.LEFT_COMMAND], now[t.RIGHT_COMMAND] = command
        # The estimate is the mean of the last tick; the motors' lag says how far it has moved on since its middle.
        commanded = (command[1] * now[t.RIGHT_RADIUS] - command[0] * now[t.LEFT_RADIUS]) / self._track_m
        now[t.YAW_RATE] = x[m.YAW_RATE] + self._half_tick * (commanded - x[m.YAW_RATE])
        self._track(x, mode)
        return self._follower.step(now, self._ahead)

    def locate(self, estimator: Estimator) -> None:
        """Find the standing robot's place on the path anew: it may have slid or been pushed, either way."""
        x = estimator.state.tolist()
        self._limits[t.L_BACK_TO] = 0.0
        for mode in (t.MODE_BRAKE, t.MODE_BACK):
            for _ in range(_LOCATE_STEPS):
                self._progress[t.P_SPEED] = 0.0
                self._track(x, mode)
        self.halt()

    def _track(self, x: list[float], mode: int) -> None:
        t.track(
            self._plan.path,
            self._plan.speeds,
            self._progress,
            self._limits,
            mode,
            x[m.EAST],
            x[m.NORTH],
            x[m.HEADING],
            self.now,
            self._ahead,
        )


def _bounded(slip: float) -> float:
    return min(max(slip, -_SLIP_LIMIT), _SLIP_LIMIT)
