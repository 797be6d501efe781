"""Path tracker: follows a loaded trajectory leg by leg and turns in place between legs; one call per tick."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import Computer, ComputerState
from touchline.onboard.control.follower import Asking, Follower, FollowerInput, PathFollower, keeps_time
from touchline.onboard.control.turn_in_place import PATIENCE_S, Turning, TurnLimits
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.filter_tick import speed_now_mps
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.way import NOT_LAID, hold_to_cap, lay_along_leg, lay_turn
from touchline.onboard.trajectory import path_projection as t
from touchline.onboard.trajectory.path import SPIN, Leg
from touchline.onboard.trajectory.smoothing import W_LENGTH, W_SEGMENT, W_START
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.vehicles import Vehicle

ACCELERATION_MARGIN = 1.2
"""Factor on the plan's acceleration up to which the reference may speed up, to catch up after a pause."""
BACK_SPEED_MPS = 0.4
STOPPED_MPS = 0.02
BRAKED_TICKS = 60
"""Ticks after the reference has come to rest from which the robot is stopped by its wheels alone, whatever its
estimated motion."""
BRAKE_SHARE: Final = 1.2
BRAKE_MARGIN_MPS: Final = 0.05
"""While the robot brakes, the commanded speed is at most this multiple of the reference speed plus this margin."""
END_TOLERANCE_M = 0.01
EXACT_M: Final = 0.001
"""Distance to the end within which a robot that does no work on its path, as on one to a goal, has arrived."""
CATCH_UP_S = 0.1
"""Delay up to which a timed reference may start late on a leg and still keep the time: a head start of millimetres."""
HELD_M: Final = 0.05
"""Distance to the end of its authority within which a robot counts as held: there it does not paint."""
_LOCATE_STEPS = 30  # of at most 5 cm each
TURNING_LEVER_M = 0.25
"""Distance from the drive's origin at which turning is counted as motion."""

Floats = NDArray[np.float64]


class PathTracker:
    """Progress along one trajectory.

    Attributes:
        now: (NOW,) of `tracking_state`, of the last tick.
        leg_index: Index of the leg that the robot is on.
        drive: Onboard side of the drive.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, follower: Follower, computer: ComputerState) -> None:
        """Make a tracker at the start of a plan.

        Args:
            plan: The trajectory.
            vehicle: The nominal robot.
            follower: Follower, which is reset.
            computer: State of the computer; its `leg` is reset.
        """
        self._plan = plan
        self._follower, self.drive = follower, drive_of(vehicle)
        self._actuators: Floats = np.zeros(len(vehicle.drive.actuators))
        self._computer, self._state = computer, computer.leg
        self._state.reset(
            accelerate_mps2=vehicle.drive.max_acceleration_mps2 * ACCELERATION_MARGIN,
            brake_mps2=vehicle.drive.max_acceleration_mps2,
            back_speed_mps=BACK_SPEED_MPS,
            nozzle_x_m=vehicle.tool.point_m[0],
            nozzle_y_m=vehicle.tool.point_m[1],
            fine_rows=follower.fine_rows,
            timed=keeps_time(follower),
            exact=not plan.works,
            half_tick_share=1.0 - math.exp(-0.5 * TICK_S / max(self.drive.lag_s, TICK_S)),
        )
        self._ahead = np.zeros((follower.ahead_rows, t.AHEAD_COLUMNS))
        self.now = self._state.now
        follower.reset()
        self._braked_ticks = 0
        self.leg_index = 0
        self._enter(0)
        if isinstance(follower, PathFollower):
            follower.take_path(self)

    def _enter(self, index: int) -> None:
        self.leg_index = index
        leg = self.leg
        self._rows = self._plan.pieces[index]
        self._turning = Turning(self._plan.turns[index], leg.heading_rad) if leg.sense == SPIN else None
        state, rows = self._state, self._rows
        state.arc_m, state.piece, state.speed_mps, state.end_m = leg.start_m, 0, 0.0, leg.end_m
        state.reference_m = leg.start_m
        self._computer.way.kind = NOT_LAID
        state.pieces_end_m = rows[-1, W_START] + rows[-1, W_LENGTH] if len(rows) else leg.end_m

    def resume_at(self, leg: int, arc_length_m: float) -> None:
        """Begin in the middle of the plan.

        Args:
            leg: Index of the leg.
            arc_length_m: Arc length on that leg.
        """
        self._enter(leg)
        rows = self._rows
        self._state.arc_m = self._state.reference_m = arc_length_m
        self._state.piece = max(int(np.searchsorted(rows[:, W_START], arc_length_m, side="right")) - 1, 0)

    def change_plan(self, plan: LoadedTrajectory, arc_length_m: float) -> None:
        """Continue on another plan at the present reference speed.

        Args:
            plan: The other trajectory.
            arc_length_m: Arc length on its first leg at which to continue.
        """
        speed_mps = self._state.speed_mps
        self._plan, self._state.exact = plan, not plan.works
        self.resume_at(0, arc_length_m)
        self._state.speed_mps, self._state.entry = speed_mps, 0
        if isinstance(self._follower, PathFollower):
            self._follower.take_path(self)

    @property
    def leg(self) -> Leg:
        """The leg that the robot is on."""
        return self._plan.legs[self.leg_index]

    @property
    def pieces(self) -> Floats:
        """Pieces of the leg, (n, COLUMNS) of `smoothing`."""
        return self._rows

    @property
    def arc_length_m(self) -> float:
        """Arc length that the drive's origin has reached on the path."""
        return self._state.arc_m

    @property
    def speed_mps(self) -> float:
        """Speed along the path, positive in the plan's direction even where that is driven backward."""
        return float(self.now[tracking.SPEED]) * self.leg.sense

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
        """True if the reference neither drives nor turns."""
        return abs(self.reference_mps) < STOPPED_MPS and (self._turning is None or not self._turning.moving)

    @property
    def held(self) -> bool:
        """True if the robot has come to the end of its authority."""
        return bool(is_held(self._computer.array))

    @property
    def authority_m(self) -> float:
        """Arc length up to which the robot may drive; infinite if nobody has set it."""
        return self._state.authority_m

    def authorize(self, until_m: float) -> None:
        """Allow driving up to this arc length."""
        self._state.authority_m = until_m

    @property
    def leg_done(self) -> bool:
        """True if the robot has reached the end of the leg, even if not quite at rest."""
        if self._turning is not None:
            return self._turning.arrived(self.now)
        return bool(has_arrived(self._computer.array))

    def next_leg(self) -> bool:
        """Begin the next leg; return False if this was the last."""
        if self.leg_index + 1 >= len(self._plan.legs):
            return False
        state, turn = self._state, self._plan.turns.get(self.leg_index)
        late_s = state.owed_s - (turn.time_s if turn is not None else 0.0)
        self._enter(self.leg_index + 1)
        # The tick that ends a leg is also the first one of the next.
        state.owed_s = min(max(late_s, 0.0), CATCH_UP_S) - TICK_S
        return True

    def halt(self) -> None:
        """Restart the next motion from rest, because the robot stands."""
        self._state.speed_mps, self._state.owed_s = 0.0, 0.0
        self._state.reference_m = self._state.arc_m
        self._follower.reset()

    @property
    def leg_arrays(self) -> t.LegArrays:
        """Arrays of the leg, for kernels."""
        return t.LegArrays(self._rows, self._plan.speeds, self._ahead)

    @property
    def brakes(self) -> bool:
        """True if the robot was braking or held in the last tick, with the reference already at rest."""
        return self._braked_ticks > 0

    def step(self, estimator: Estimator, mode: int, back_to_m: float = 0.0) -> Asking[tuple[float, ...]]:
        """Run one tick, in which the follower is asked.

        Args:
            estimator: Estimator that has seen the tick.
            mode: MODE_PROFILE, MODE_BRAKE or MODE_BACK of `path_projection`.
            back_to_m: Arc length to return to, for MODE_BACK.

        Returns:
            Commands of the drive's actuators for the coming tick.
        """
        now = self.now
        self._state.back_to_m = back_to_m
        observe(self.drive.figures, self._computer.array)
        if self._turning is not None:
            self._turning.step(float(estimator.state[m.HEADING]), self._turn_limits(mode), now, self._ahead)
            self._turn_timed()
        else:
            self._track(mode)
        stops = mode == t.MODE_BRAKE or (mode == t.MODE_PROFILE and self.held)
        self._braked_ticks = self._braked_ticks + 1 if stops and self.still else 0
        if self._braked_ticks > BRAKED_TICKS:
            return self.drive.resting(tuple(self._computer.command.actuators.tolist()))
        answer = yield FollowerInput(now, self._ahead)
        assert answer is not None, "no kernel takes it from here"
        speed_mps, yaw_rate_radps, actuators = answer
        if actuators is None:
            onboard_drive.command(self.drive.figures, speed_mps, yaw_rate_radps, now, self._actuators)
        else:
            self._actuators[:] = actuators
        if mode == t.MODE_BRAKE:
            self._hold_back()
        elif self._computer.way.on:
            hold_to_cap(self.drive.figures, self._computer.array, self._actuators)
        return tuple(self._actuators.tolist())

    def _turn_limits(self, mode: int) -> TurnLimits:
        way, leg = self._computer.way, self._state
        if not way.on:
            return TurnLimits(mode == t.MODE_BRAKE)
        return TurnLimits(mode == t.MODE_BRAKE, leg.brake_mps2 / way.planned_mps2, way.limit_mps / way.lever_m)

    def lay_way(self, *, back: bool) -> None:
        """Lay the way to come in the computer's state, for its clearances.

        Args:
            back: True for the way back along the leg.
        """
        if self._turning is not None:
            lay_turn(self._computer.array, self._turning.left_rad)
        else:
            lay_along_leg(self._computer.array, self.leg_arrays, float(self.leg.sense), back)

    def _turn_timed(self) -> None:
        """Set the errors of a timed reference in a turn in place: it is where the robot is, at the turn's heading."""
        if self._state.timed:
            now = self.now
            now[tracking.ALONG] = now[tracking.ACROSS] = now[tracking.REFERENCE_ACCELERATION] = 0.0
            now[tracking.TURN] = -now[tracking.HEADING_ERROR]
            self._state.owed_s += TICK_S

    def wheels_rest(self, estimator: Estimator) -> bool:
        """Return True if the wheels, by their encoders, have come to rest or begun to turn back."""
        speed_mps, yaw_rate_radps = onboard_drive.twist(self.drive.figures, estimator.buffer.measured, self.now)
        ahead_mps, turn_mps = speed_mps * self._direction, abs(yaw_rate_radps) * TURNING_LEVER_M
        return bool(ahead_mps < 2.0 * STOPPED_MPS and turn_mps < 2.0 * STOPPED_MPS)

    @property
    def _direction(self) -> float:
        """Direction of the present or last motion of the robot: +1 forward, −1 backward."""
        return math.copysign(1.0, self.reference_mps) * (self.leg.sense or 1.0)

    def _hold_back(self) -> None:
        """Limit the actuators to little more than the reference speed, and to next to nothing in the other direction.

        A wrong estimate of the speed would otherwise make the robot speed up or drive back. This is the last step,
        since the drive's limits on a command depend on that estimate, too.
        """
        figures, direction = self.drive.figures, self._direction
        speed_mps, yaw_rate_radps = onboard_drive.twist(figures, self._actuators, self.now)
        most = BRAKE_SHARE * abs(self.reference_mps) + BRAKE_MARGIN_MPS
        held = direction * min(max(direction * speed_mps, -BRAKE_MARGIN_MPS), most)
        if held != speed_mps:
            # Slower along the same circle: at the same yaw rate it would turn ever more tightly.
            slower = yaw_rate_radps * held / speed_mps
            self._actuators[:] = onboard_drive.actuators_of(figures, held, slower, self.now)

    def locate(self, estimator: Estimator) -> None:
        """Find the standing robot's place on the path anew: it may have slid or been pushed, forward or back."""
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
def has_arrived(computer: Computer) -> bool:
    """Return True if the robot has reached the end of the leg, even if not quite at rest.

    If its exact resting place matters, it has arrived once it would brake to rest at the end: braking earlier leaves
    some millimetres, and in a tight bend 5 mm are 2°. A timed reference must have arrived, too; for a robot that stays
    behind it waits no longer than for one that turns in place.
    """
    leg = computer[0].leg
    speed_mps = abs(leg.now[tracking.SPEED])
    tolerance_m = max(0.5 * speed_mps**2 / leg.brake_mps2, EXACT_M) if leg.exact else END_TOLERANCE_M
    there, slow = leg.arc_m >= leg.end_m - tolerance_m, speed_mps < 2.0 * t.CREEP_MPS
    if leg.timed:
        return bool(leg.owed_s > 0.0 and slow and (there or leg.owed_s > PATIENCE_S))
    return bool(there and slow)


@kernel
def is_held(computer: Computer) -> bool:
    """Return True if the robot has come to the end of its authority."""
    leg = computer[0].leg
    return bool(leg.arc_m >= leg.authority_m - HELD_M)


@kernel
def nozzle_m(computer: Computer) -> float:
    """Return the arc length [m] at which the nozzle would be if the robot's heading were the path's.

    The nozzle is beside the axle: a rotation of the robot moves it ahead by the angle times its distance.
    """
    leg = computer[0].leg
    place_m: float = leg.arc_m - leg.nozzle_y_m * leg.now[tracking.HEADING_ERROR]
    return place_m


@kernel
def observe(drive: Any, computer: Computer) -> None:
    """Fill in the robot's own motion in the leg's `now`, for the follower.

    Args:
        drive: Parameters of the drive.
        computer: (1,) whose estimator has seen the tick.
    """
    c = computer[0]
    x, actuators, now = c.filter.states[c.times.tick % m.RING], c.command.actuators, c.leg.now
    now[tracking.SPEED] = speed_now_mps(computer)
    onboard_drive.effective(drive, x, now)
    copy(actuators, now[tracking.COMMAND :])
    # The estimate is the mean of the last tick; the actuators' lag gives the change since its middle.
    _, commanded = onboard_drive.twist(drive, actuators, now)
    now[tracking.YAW_RATE] = x[m.YAW_RATE] + c.leg.half_tick_share * (commanded - x[m.YAW_RATE])
