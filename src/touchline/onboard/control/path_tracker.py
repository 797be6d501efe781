"""The path tracker: follows a loaded trajectory leg by leg, turns in place between them; one call per tick."""

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
from touchline.onboard.control import Follower, PathFollower, keeps_time
from touchline.onboard.control.turn_in_place import PATIENCE_S, Turning
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.filter import Estimator, speed_now_mps
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory import path_projection as t
from touchline.onboard.trajectory.path import SPIN, Leg
from touchline.onboard.trajectory.smoothing import W_LENGTH, W_SEGMENT, W_START
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.vehicles import Vehicle

ACCELERATION_MARGIN = 1.2
"""The reference may speed up this much harder than the plan does, to catch up after a pause."""
BACK_SPEED_MPS = 0.4
STOPPED_MPS = 0.02
BRAKED_TICKS = 60
"""After the reference has come to rest the robot is stopped by its wheels alone, wherever it believes to be going."""
BRAKE_SHARE: Final = 1.2
BRAKE_MARGIN_MPS: Final = 0.05
"""While the robot brakes it is commanded at most this multiple of the reference speed plus this margin."""
END_TOLERANCE_M = 0.01
EXACT_M: Final = 0.001
"""A robot that does no work on its way, as on one to a goal, is there for where it rests: so near to the end."""
CATCH_UP_S = 0.1
"""By how much a timed reference may set off late on a leg and still keep the time: a head start of millimetres."""
HELD_M: Final = 0.05
"""So near to where it may drive no further, a robot counts as held: there it does not paint."""
_LOCATE_STEPS = 30  # of at most 5 cm each
TURNING_LEVER_M = 0.25
"""From the drive's origin to where turning is seen as motion."""

Floats = NDArray[np.float64]


class PathTracker:
    """Progress along one trajectory.

    Attributes:
        now: (NOW,) of `tracking_state`, of the last tick.
        leg_index: Of the leg that the robot is on.
        drive: That is commanded.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle, follower: Follower, computer: ComputerState) -> None:
        """At the start of `plan`."""
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
        state.pieces_end_m = rows[-1, W_START] + rows[-1, W_LENGTH] if len(rows) else leg.end_m

    def resume_at(self, leg: int, arc_length_m: float) -> None:
        """Begin at an arc length of a leg."""
        self._enter(leg)
        rows = self._rows
        self._state.arc_m = self._state.reference_m = arc_length_m
        self._state.piece = max(int(np.searchsorted(rows[:, W_START], arc_length_m, side="right")) - 1, 0)

    def change_plan(self, plan: LoadedTrajectory, arc_length_m: float) -> None:
        """Drive on along another plan, from an arc length of its first leg, at the speed that the reference has."""
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
        """(n, COLUMNS) pieces of the leg, of `smoothing`."""
        return self._rows

    @property
    def arc_length_m(self) -> float:
        """Progress of the axle centre along the path."""
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
        """Whether the reference neither drives nor turns."""
        return abs(self.reference_mps) < STOPPED_MPS and (self._turning is None or not self._turning.moving)

    @property
    def held(self) -> bool:
        """Whether it has come to where it may drive no further for now."""
        return bool(is_held(self._computer.array))

    @property
    def authority_m(self) -> float:
        """Arc length up to which it may drive; infinite if nobody has said."""
        return self._state.authority_m

    def authorize(self, until_m: float) -> None:
        """Drive up to this arc length, and no further until told."""
        self._state.authority_m = until_m

    @property
    def leg_done(self) -> bool:
        """Whether the robot has come to the end of the leg, if not yet quite to rest."""
        if self._turning is not None:
            return self._turning.arrived(self.now)
        return bool(has_arrived(self._computer.array))

    def next_leg(self) -> bool:
        """Begin the next leg; False if this was the last."""
        if self.leg_index + 1 >= len(self._plan.legs):
            return False
        state, turn = self._state, self._plan.turns.get(self.leg_index)
        late_s = state.owed_s - (turn.time_s if turn is not None else 0.0)
        self._enter(self.leg_index + 1)
        # The tick that ends a leg is also the first one of the next.
        state.owed_s = min(max(late_s, 0.0), CATCH_UP_S) - TICK_S
        return True

    def halt(self) -> None:
        """The robot stands: the next motion starts from nothing."""
        self._state.speed_mps, self._state.owed_s = 0.0, 0.0
        self._state.reference_m = self._state.arc_m
        self._follower.reset()

    @property
    def leg_arrays(self) -> t.LegArrays:
        """The leg, for kernels."""
        return t.LegArrays(self._rows, self._plan.speeds, self._ahead)

    @property
    def brakes(self) -> bool:
        """Whether it was braking in the last tick, or held, with the reference already at rest."""
        return self._braked_ticks > 0

    def step(self, estimator: Estimator, mode: int, back_to_m: float = 0.0) -> tuple[float, ...]:
        """Commands of the drive's actuators for the coming tick."""
        now = self.now
        self._state.back_to_m = back_to_m
        observe(self.drive.figures, self._computer.array)
        if self._turning is not None:
            self._turning.step(float(estimator.state[m.HEADING]), mode == t.MODE_BRAKE, now, self._ahead)
            self._turn_timed()
        else:
            self._track(mode)
        stops = mode == t.MODE_BRAKE or (mode == t.MODE_PROFILE and self.held)
        self._braked_ticks = self._braked_ticks + 1 if stops and self.still else 0
        if self._braked_ticks > BRAKED_TICKS:
            return self.drive.resting(tuple(self._computer.command.actuators.tolist()))
        speed_mps, yaw_rate_radps, actuators = self._follower.step(now, self._ahead)
        if actuators is None:
            onboard_drive.command(self.drive.figures, speed_mps, yaw_rate_radps, now, self._actuators)
        else:
            self._actuators[:] = actuators
        if mode == t.MODE_BRAKE:
            self._hold_back()
        return tuple(self._actuators.tolist())

    def _turn_timed(self) -> None:
        """A turn in place has a reference of its own: a timed one is where the robot is, turned as that."""
        if self._state.timed:
            now = self.now
            now[tracking.ALONG] = now[tracking.ACROSS] = now[tracking.REFERENCE_ACCELERATION] = 0.0
            now[tracking.TURN] = -now[tracking.HEADING_ERROR]
            self._state.owed_s += TICK_S

    def wheels_rest(self, estimator: Estimator) -> bool:
        """Whether the wheels, by their encoders, have come to rest or begun to turn back."""
        speed_mps, yaw_rate_radps = onboard_drive.twist(self.drive.figures, estimator.buffer.measured, self.now)
        ahead_mps, turn_mps = speed_mps * self._direction, abs(yaw_rate_radps) * TURNING_LEVER_M
        return bool(ahead_mps < 2.0 * STOPPED_MPS and turn_mps < 2.0 * STOPPED_MPS)

    @property
    def _direction(self) -> float:
        """+1 if the robot drives, or last drove, forward."""
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
            # Slower along the same circle: at the same yaw rate it would turn in ever more tightly.
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
    """Whether the robot has come to the end of the leg that it drives, if not yet quite to rest.

    Where it matters where it rests, it has come there once it would brake to rest at the end: braking earlier leaves
    some millimetres, and in a tight bend 5 mm are 2°. A timed reference must have come there, too; for a robot that
    stays behind it waits no longer than for one that turns in place.
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
    """Whether the robot has come to where it may drive no further for now."""
    leg = computer[0].leg
    return bool(leg.arc_m >= leg.authority_m - HELD_M)


@kernel
def nozzle_m(computer: Computer) -> float:
    """The arc length at which the nozzle would be if the robot's heading were the path's [m].

    The nozzle is beside the axle: a robot turned by an angle carries it ahead by that times its distance.
    """
    leg = computer[0].leg
    place_m: float = leg.arc_m - leg.nozzle_y_m * leg.now[tracking.HEADING_ERROR]
    return place_m


@kernel
def observe(drive: Any, computer: Computer) -> None:
    """Fill in the robot's own motion in the leg's `now`, for the follower.

    Args:
        drive: Figures of the drive.
        computer: (1,) of which the estimator has seen the tick.
    """
    c = computer[0]
    x, actuators, now = c.filter.states[c.times.tick % m.RING], c.command.actuators, c.leg.now
    now[tracking.SPEED] = speed_now_mps(computer)
    onboard_drive.effective(drive, x, now)
    copy(actuators, now[tracking.COMMAND :])
    # The estimate is the mean of the last tick; the actuators' lag says how far it has moved on since its middle.
    _, commanded = onboard_drive.twist(drive, actuators, now)
    now[tracking.YAW_RATE] = x[m.YAW_RATE] + c.leg.half_tick_share * (commanded - x[m.YAW_RATE])
