"""The path tracker: follows a loaded trajectory leg by leg, turns in place between them; one call per tick."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.onboard import filter_model as m
from touchline.services.onboard.computer_state import Computer, ComputerState
from touchline.services.onboard.control import Follower
from touchline.services.onboard.control.turn_in_place import Turning
from touchline.services.onboard.estimation.filter import Estimator, speed_now_mps
from touchline.services.onboard.interface import TICK_S
from touchline.services.onboard.trajectory import path_projection as t
from touchline.services.onboard.trajectory.path import SPIN, Leg
from touchline.services.onboard.trajectory.smoothing import W_LENGTH, W_SEGMENT, W_START
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

Floats = NDArray[np.float64]


class PathTracker:
    """Progress along one trajectory.

    Attributes:
        now: (NOW,) of `path_projection`, of the last tick.
        leg_index: Of the leg that the robot is on.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, follower: Follower, computer: ComputerState) -> None:
        """At the start of `plan`."""
        self._plan = plan
        self._follower = follower
        self._computer, self._state = computer, computer.leg
        self._state.reset(
            accelerate_mps2=vehicle.drive.max_acceleration_mps2 * ACCELERATION_MARGIN,
            brake_mps2=vehicle.drive.max_acceleration_mps2,
            back_speed_mps=BACK_SPEED_MPS,
            nozzle_x_m=vehicle.tool.nozzle_x_m,
            nozzle_y_m=vehicle.tool.nozzle_y_m,
            fine_rows=follower.fine_rows,
            wheel_radius_m=vehicle.drive.wheel_radius_m,
            track_width_m=vehicle.drive.track_width_m,
            half_tick_share=1.0 - math.exp(-0.5 * TICK_S / max(vehicle.drive.motor_time_constant_s, TICK_S)),
        )
        self._ahead = np.zeros((follower.ahead_rows, t.AHEAD_COLUMNS))
        self.now = self._state.now
        follower.reset()
        self._braked_ticks = 0
        self.leg_index = 0
        self._enter(0)

    def _enter(self, index: int) -> None:
        self.leg_index = index
        leg = self.leg
        self._rows = self._plan.ways[index]
        self._turning = Turning(self._plan.turns[index], leg.heading_rad) if leg.sense == SPIN else None
        state, rows = self._state, self._rows
        state.arc_m, state.piece, state.speed_mps, state.end_m = leg.start_m, 0, 0.0, leg.end_m
        state.way_end_m = rows[-1, W_START] + rows[-1, W_LENGTH] if len(rows) else leg.end_m

    def resume_at(self, leg: int, arc_length_m: float) -> None:
        """Stand at an arc length of a leg."""
        self._enter(leg)
        rows = self._rows
        self._state.arc_m = arc_length_m
        self._state.piece = max(int(np.searchsorted(rows[:, W_START], arc_length_m, side="right")) - 1, 0)

    @property
    def leg(self) -> Leg:
        """The leg that the robot is on."""
        return self._plan.legs[self.leg_index]

    @property
    def arc_length_m(self) -> float:
        """Progress of the axle centre along the path."""
        return self._state.arc_m

    @property
    def speed_mps(self) -> float:
        """Speed along the path: positive the way the plan goes, whichever way the robot faces."""
        return float(self.now[t.SPEED]) * self.leg.sense

    @property
    def segment(self) -> int:
        """Index of the path segment under the robot."""
        return int(self._rows[self._state.piece, W_SEGMENT])

    @property
    def reference_mps(self) -> float:
        """Reference speed, negative when going back."""
        return self._state.speed_mps

    @property
    def still(self) -> bool:
        """Whether the reference neither drives nor turns."""
        return abs(self.reference_mps) < STOPPED_MPS and (self._turning is None or not self._turning.moving)

    @property
    def leg_done(self) -> bool:
        """Whether the leg is done but for coming to rest."""
        if self._turning is not None:
            return self._turning.arrived(self.now)
        return bool(has_arrived(self._computer.array))

    def next_leg(self) -> bool:
        """Begin the next leg; False if this was the last."""
        if self.leg_index + 1 >= len(self._plan.legs):
            return False
        self._enter(self.leg_index + 1)
        return True

    def halt(self) -> None:
        """The robot stands: the next motion starts from nothing."""
        self._state.speed_mps = 0.0
        self._follower.reset()

    @property
    def leg_arrays(self) -> t.LegArrays:
        """The leg, for kernels."""
        return t.LegArrays(self._rows, self._plan.speeds, self._ahead)

    @property
    def brakes(self) -> bool:
        """Whether its last ticks were of coming to rest."""
        return self._braked_ticks > 0

    def step(self, estimator: Estimator, mode: int, back_to_m: float = 0.0) -> tuple[float, float]:
        """Wheel speeds (left, right) [rad/s] for the coming tick."""
        now = self.now
        self._state.back_to_m = back_to_m
        observe(self._computer.array)
        if self._turning is not None:
            self._turning.step(float(estimator.state[m.HEADING]), mode == t.MODE_BRAKE, now, self._ahead)
        else:
            self._track(mode)
        self._braked_ticks = self._braked_ticks + 1 if mode == t.MODE_BRAKE and self.still else 0
        if self._braked_ticks > BRAKED_TICKS:
            return 0.0, 0.0
        left, right = self._follower.step(now, self._ahead)
        return self._braking(left, right) if mode == t.MODE_BRAKE else (left, right)

    def wheels_rest(self, estimator: Estimator) -> bool:
        """Whether the wheels, by their encoders, have come to rest or begun to turn back."""
        left, right = estimator.buffer.rates_radps.tolist()
        radius_m = self._state.wheel_radius_m
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
        radius_m, direction = self._state.wheel_radius_m, self._direction
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
        self._state.back_to_m = self.leg.start_m
        for mode in (t.MODE_BRAKE, t.MODE_BACK):
            for _ in range(_LOCATE_STEPS):
                self._state.speed_mps = 0.0
                self._track(mode)
        self.halt()

    def _track(self, mode: int) -> None:
        t.track(self._computer.array, self.leg_arrays, self.leg.sense, mode)


@kernel
def _bounded(slip: float) -> float:
    return min(max(slip, -_SLIP_LIMIT), _SLIP_LIMIT)


@kernel
def has_arrived(computer: Computer) -> bool:
    """Whether a leg is done but for coming to rest."""
    leg = computer[0].leg
    return bool(leg.arc_m >= leg.end_m - END_TOLERANCE_M and abs(leg.now[t.SPEED]) < 2.0 * t.CREEP_MPS)


@kernel
def nozzle_m(computer: Computer) -> float:
    """The arc length at which the nozzle would be if the robot's heading were the path's [m].

    The nozzle is beside the axle: a robot turned by an angle carries it ahead by that times its distance.
    """
    leg = computer[0].leg
    place_m: float = leg.arc_m - leg.nozzle_y_m * leg.now[t.HEADING_ERROR]
    return place_m


@kernel
def observe(computer: Computer) -> None:
    """What the follower is told about the robot itself: twist, effective radii and commands, in the leg's `now`."""
    c = computer[0]
    x, wheels, now = c.filter.states[c.times.tick % m.RING], c.command.actuators, c.leg.now
    radius_m = c.leg.wheel_radius_m
    now[t.SPEED] = speed_now_mps(computer)
    now[t.LEFT_RADIUS] = radius_m * (1.0 - _bounded(x[m.LEFT_SLIP]))
    now[t.RIGHT_RADIUS] = radius_m * (1.0 - _bounded(x[m.RIGHT_SLIP]))
    now[t.LEFT_COMMAND], now[t.RIGHT_COMMAND] = wheels[0], wheels[1]
    # The estimate is the mean of the last tick; the motors' lag says how far it has moved on since its middle.
    turned_mps = wheels[1] * now[t.RIGHT_RADIUS] - wheels[0] * now[t.LEFT_RADIUS]
    commanded = turned_mps / c.leg.track_width_m
    now[t.YAW_RATE] = x[m.YAW_RATE] + c.leg.half_tick_share * (commanded - x[m.YAW_RATE])
