"""The path tracker: follows a loaded trajectory leg by leg, turns in place between them; one call per tick."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.onboard.control import Follower
from touchline.services.onboard.control.turn_in_place import Turning
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.estimation.filter import Estimator
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.trajectory import path_projection as t
from touchline.services.onboard.trajectory.path import SPIN, Leg
from touchline.services.onboard.trajectory.smoothing import W_SEGMENT, W_START
from touchline.services.onboard.trajectory.trajectory import LoadedTrajectory

ACCELERATION_MARGIN = 1.2
"""The reference may speed up this much harder than the plan does, to catch up after a pause."""
BACK_SPEED_MPS = 0.4
STOPPED_MPS = 0.02
BRAKED_TICKS = 60
"""After the reference has come to rest the robot is stopped by its wheels alone, wherever it believes to be going."""
BRAKE_SHARE: Final = 1.2
BRAKE_MARGIN_MPS: Final = 0.05
"""While it brakes the robot is commanded no speed beyond this share of the reference and this more, nor backward."""
END_TOLERANCE_M = 0.01
_LOCATE_STEPS = 30  # of at most 5 cm each
# Of what the feed-forward makes up for: random slip is within it. A tyre at the end of its grip slips more, and faster
# wheels would only make it slip more still.
_SLIP_LIMIT = 0.05

B_RADIUS: Final = 0  # m
B_TRACK: Final = 1  # m
B_HALF_TICK: Final = 2  # share of the way to the command that the motors make in half a tick
BODY: Final = 3

Floats = NDArray[np.float64]


class PathTracker:
    """Progress along one trajectory.

    Attributes:
        now: (NOW,) of `path_projection`, of the last tick.
        leg_index: Of the leg that the robot is on.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, follower: Follower) -> None:
        """At the start of `plan`."""
        self._plan = plan
        self._follower = follower
        self._body = np.zeros(BODY)
        self._body[B_RADIUS], self._body[B_TRACK] = vehicle.drive.wheel_radius_m, vehicle.drive.track_width_m
        self._body[B_HALF_TICK] = 1.0 - math.exp(-0.5 * TICK_S / max(vehicle.drive.motor_time_constant_s, TICK_S))
        self._progress = np.zeros(t.PROGRESS)
        self._limits = np.zeros(t.LIMITS)
        self._limits[t.L_ACCELERATE] = vehicle.drive.max_acceleration_mps2 * ACCELERATION_MARGIN
        self._limits[t.L_BRAKE] = vehicle.drive.max_acceleration_mps2
        self._limits[t.L_BACK_SPEED] = BACK_SPEED_MPS
        self._limits[t.L_NOZZLE_X], self._limits[t.L_NOZZLE_Y] = vehicle.tool.nozzle_x_m, vehicle.tool.nozzle_y_m
        self._ahead = np.zeros((follower.ahead_rows, t.AHEAD_COLUMNS))
        self._limits[t.L_FINE] = follower.fine_rows
        self.now = np.zeros(t.NOW)
        follower.reset()
        self._braked_ticks = 0
        self.leg_index = 0
        self._enter(0)

    def _enter(self, index: int) -> None:
        self.leg_index = index
        leg = self.leg
        self._rows = self._plan.ways[index]
        self._turning = Turning(self._plan.turns[index], leg.heading_rad) if leg.sense == SPIN else None
        self._progress[t.P_ARC], self._progress[t.P_PIECE], self._progress[t.P_SPEED] = leg.start_m, 0.0, 0.0

    def resume_at(self, leg: int, arc_length_m: float) -> None:
        """Stand at an arc length of a leg."""
        self._enter(leg)
        rows = self._rows
        self._progress[t.P_ARC] = arc_length_m
        self._progress[t.P_PIECE] = max(int(np.searchsorted(rows[:, W_START], arc_length_m, side="right")) - 1, 0)

    @property
    def leg(self) -> Leg:
        """The leg that the robot is on."""
        return self._plan.legs[self.leg_index]

    @property
    def arc_length_m(self) -> float:
        """Progress of the axle centre along the path."""
        return float(self._progress[t.P_ARC])

    @property
    def speed_mps(self) -> float:
        """Speed along the path: positive the way the plan goes, whichever way the robot faces."""
        return float(self.now[t.SPEED]) * self.leg.sense

    @property
    def segment(self) -> int:
        """Index of the path segment under the robot."""
        return int(self._rows[int(self._progress[t.P_PIECE]), W_SEGMENT])

    @property
    def reference_mps(self) -> float:
        """Reference speed, negative when going back."""
        return float(self._progress[t.P_SPEED])

    @property
    def still(self) -> bool:
        """Whether the reference neither drives nor turns."""
        return abs(self.reference_mps) < STOPPED_MPS and (self._turning is None or not self._turning.moving)

    @property
    def leg_done(self) -> bool:
        """Whether the leg is done but for coming to rest."""
        if self._turning is not None:
            return self._turning.arrived(self.now)
        return self.arc_length_m >= self.leg.end_m - END_TOLERANCE_M and abs(self.speed_mps) < 2.0 * t.CREEP_MPS

    def next_leg(self) -> bool:
        """Begin the next leg; False if this was the last."""
        if self.leg_index + 1 >= len(self._plan.legs):
            return False
        self._enter(self.leg_index + 1)
        return True

    def halt(self) -> None:
        """The robot stands: the next motion starts from nothing."""
        self._progress[t.P_SPEED] = 0.0
        self._follower.reset()

    def step(
        self, estimator: Estimator, command: tuple[float, float], mode: int, back_to_m: float = 0.0
    ) -> tuple[float, float]:
        """Wheel speeds (left, right) [rad/s] for the coming tick; `command` are those of the last one."""
        x, now = estimator.state, self.now
        self._limits[t.L_BACK_TO] = back_to_m
        observe(x, estimator.speed_now_mps(), *command, self._body, now)
        if self._turning is not None:
            self._turning.step(float(x[m.HEADING]), mode == t.MODE_BRAKE, now, self._ahead)
        else:
            self._track(x, mode)
        self._braked_ticks = self._braked_ticks + 1 if mode == t.MODE_BRAKE and self.still else 0
        if self._braked_ticks > BRAKED_TICKS:
            return 0.0, 0.0
        left, right = self._follower.step(now, self._ahead)
        return self._braking(left, right) if mode == t.MODE_BRAKE else (left, right)

    def wheels_rest(self, estimator: Estimator) -> bool:
        """Whether the wheels, by their encoders, have come to rest or begun to turn back."""
        left, right = estimator.intake.encoder_rates
        radius_m = self._body[B_RADIUS]
        ahead_mps, turn_mps = 0.5 * radius_m * (left + right) * self._direction, 0.5 * radius_m * abs(right - left)
        return bool(ahead_mps < 2.0 * STOPPED_MPS and turn_mps < 2.0 * STOPPED_MPS)

    @property
    def _direction(self) -> float:
        """+1 if the robot drives, or last drove, forward."""
        return math.copysign(1.0, self.reference_mps) * (self.leg.sense or 1.0)

    def _braking(self, left: float, right: float) -> tuple[float, float]:
        """Wheel speeds (left, right) that brake: about as fast as the reference at most, and hardly the other way.

        A speed that is believed and wrong would else have the robot speed up, or drive back.
        """
        radius_m, direction = float(self._body[B_RADIUS]), self._direction
        ahead = 0.5 * (left + right) * direction
        most = (BRAKE_SHARE * abs(self.reference_mps) + BRAKE_MARGIN_MPS) / radius_m
        least = -BRAKE_MARGIN_MPS / radius_m
        excess = direction * (ahead - min(max(ahead, least), most))
        return (left - excess, right - excess) if excess else (left, right)

    def locate(self, estimator: Estimator) -> None:
        """Find the standing robot's place on the path anew: it may have slid or been pushed, either way."""
        x = estimator.state
        if self._turning is not None:
            self._turning.hold(float(x[m.HEADING]))
            self.halt()
            return
        self._limits[t.L_BACK_TO] = self.leg.start_m
        for mode in (t.MODE_BRAKE, t.MODE_BACK):
            for _ in range(_LOCATE_STEPS):
                self._progress[t.P_SPEED] = 0.0
                self._track(x, mode)
        self.halt()

    def _track(self, x: Floats, mode: int) -> None:
        t.track(
            self._rows,
            self.leg.sense,
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


@kernel
def _bounded(slip: float) -> float:
    return min(max(slip, -_SLIP_LIMIT), _SLIP_LIMIT)


@kernel
def observe(x: Floats, speed_mps: float, left_radps: float, right_radps: float, body: Floats, now: Floats) -> None:
    """What the follower is told about the robot itself.

    Args:
        x: (STATES,) of the estimator.
        speed_mps: At the end of the tick.
        left_radps: Commanded in the last tick, as `right_radps`.
        right_radps: See `left_radps`.
        body: (BODY,) of this vehicle.
        now: (NOW,) of `path_projection`: twist, effective radii and commands are filled in.
    """
    now[t.SPEED] = speed_mps
    now[t.LEFT_RADIUS] = body[B_RADIUS] * (1.0 - _bounded(x[m.LEFT_SLIP]))
    now[t.RIGHT_RADIUS] = body[B_RADIUS] * (1.0 - _bounded(x[m.RIGHT_SLIP]))
    now[t.LEFT_COMMAND], now[t.RIGHT_COMMAND] = left_radps, right_radps
    # The estimate is the mean of the last tick; the motors' lag says how far it has moved on since its middle.
    commanded = (right_radps * now[t.RIGHT_RADIUS] - left_radps * now[t.LEFT_RADIUS]) / body[B_TRACK]
    now[t.YAW_RATE] = x[m.YAW_RATE] + body[B_HALF_TICK] * (commanded - x[m.YAW_RATE])
