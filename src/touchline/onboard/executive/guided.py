"""Guided driving: to targets within cells, which a team's coordinator sends while the robot drives."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from touchline.core.timed_motion import COLUMNS
from touchline.onboard import filter_model as m
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.control.cell_steering import HEADING, SPEED, SteeringLimits, X, Y
from touchline.onboard.control.follower import Asking
from touchline.onboard.control.path_tracker import STOPPED_MPS
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.executive.cell_keeper import CellKeeper, Segment
from touchline.onboard.executive.dead_reckoning import LEAST_WAY_M, DeadReckoning, must_stand
from touchline.onboard.executive.geofence import FenceArrays
from touchline.onboard.executive.guided_tick import GuidedCourse, drive_on, stopping_point
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.plan_keeper import PlanKeeper
from touchline.onboard.executive.traversal_job import JobProgress, Step
from touchline.onboard.interface import TICK_S, TICKS_PER_S, Command, PaintBelief
from touchline.onboard.protection.way import lay_straight
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Guidance, PlanState, Whereabouts
from touchline.schemas.onboard import TeamLimits
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]


class GuidedDrive:
    """Job of a guided robot; the robot stands until it gets a cell.

    Attributes:
        course: Data for kernels.
        forgot: Whether it has forgotten its cell, and has no other yet.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        team: TeamLimits,
        blind: DeadReckoning,
        estimator: Estimator,
        watch: LocalizationMonitor,
        computer: ComputerState,
        *,
        plans: bool = False,
    ) -> None:
        """Begin where the robot stands, not yet aligned.

        Args:
            vehicle: The nominal robot.
            team: Limits of the team.
            blind: Limits of driving without fixes.
            estimator: Estimator of the pose.
            watch: Monitor of the pose.
            computer: State of the computer.
            plans: Whether guidance has plans instead of cells.

        Raises:
            CommandRefused: The robot cannot turn on the spot, so it could not stop anywhere in a cell and continue.
        """
        spec = vehicle.drive
        if not spec.can_spin:
            remedy = "give it trajectories"
            raise CommandRefused(f"cannot be guided: the robot cannot turn on the spot, as cells need it; {remedy}")
        self._drive, self._estimator, self._watch, self._computer = drive_of(vehicle), estimator, watch, computer
        self._team, self._cell, self._plan = team, CellKeeper(team), PlanKeeper() if plans else None
        self._aligned, self._halted_tick, self.forgot = False, -1, False
        computer.leg.reset(half_tick_share=1.0 - math.exp(-0.5 * TICK_S / max(self._drive.lag_s, TICK_S)))
        computer.guidance.reset()
        limits = SteeringLimits(
            spec.transit_speed_mps,
            spec.max_acceleration_mps2,
            spec.max_lateral_acceleration_mps2,
            spec.max_yaw_rate_radps,
            team.there_m,
            team.away_m,
        )
        fence = FenceArrays(np.zeros((0, 2)), np.zeros((0, 2)))
        self.course = GuidedCourse(
            half_planes=np.zeros((0, 3)),
            target_m=0j,
            until_tick=-1,
            plan=np.zeros((0, COLUMNS)),
            plan_tick=0,
            limits=limits,
            blind=blind,
            lag_s=self._drive.lag_s,
            drive=estimator.drive,
            motion=np.zeros(4),
            planned=np.zeros(COLUMNS),
            fence=fence,
        )

    def receive(self, guidance: Guidance) -> bool:
        """Take guidance, as of `CellKeeper.receive` or `PlanKeeper.receive`."""
        if self._plan is not None:
            return self._receive_plan(self._plan, guidance)
        keeper = self._cell
        taken = keeper.receive(guidance, self._stopping_segment())
        self.forgot = self.forgot and not len(keeper.half_planes)
        until_tick = math.floor(keeper.until_s * TICKS_PER_S + 0.5)
        self.course = self.course._replace(
            half_planes=keeper.half_planes, target_m=keeper.target_m, until_tick=until_tick
        )
        return taken

    def forget_cell(self) -> None:
        """Brake straight ahead until another coordinator sends a cell: its numbers begin anew."""
        self._cell, self.forgot = CellKeeper(self._team), True
        self.course = self.course._replace(half_planes=self._cell.half_planes, until_tick=-1)

    def _receive_plan(self, keeper: PlanKeeper, guidance: Guidance) -> bool:
        """Take a plan; it ends at rest, so it needs no lease."""
        tick = self._computer.clock.tick
        taken = keeper.receive(guidance, tick, halts=tick == self._halted_tick)
        last_tick, way_m = int(np.iinfo(np.int64).max), max(keeper.longest_m, LEAST_WAY_M)
        self.course = self.course._replace(
            plan=keeper.plan,
            plan_tick=keeper.plan_tick,
            until_tick=last_tick,
            blind=self.course.blind._replace(way_m=way_m),
        )
        return taken

    def _stopping_segment(self) -> Segment:
        """Return the place of the robot, and its stopping point if it braked now, x + iy (m)."""
        x = self._estimator.state
        stop = self._stop(self._computer.array, self.course)
        return complex(x[m.EAST], x[m.NORTH]), self._stop_of_braking() if self.forgot else stop

    def _stop_of_braking(self) -> complex:
        """Return the stopping point of a robot that brakes already, once `stopping_point` has filled in its motion.

        That takes a robot to brake from its speed. One that brakes already is faster than it is commanded, by what its
        actuators are behind. Its stopping segment would be longer than the one on which it began to brake.
        """
        motion, limits, lag_s = self.course.motion, self.course.limits, self.course.lag_s
        speed_mps, faster_mps = motion[SPEED], abs(self._computer.leg.now[tracking.SPEED])
        if faster_mps - speed_mps > 2.0 * limits.acceleration_mps2 * lag_s:  # by more: it does not do as commanded
            speed_mps = faster_mps
        braking_m = float(speed_mps * speed_mps) / (2.0 * limits.acceleration_mps2)
        return complex(motion[X], motion[Y]) + cmath.rect(braking_m, float(motion[HEADING]))

    @cached_property
    def _stop(self) -> Callable[..., complex]:
        """The kernel `stopping_point`, without checking the types of its arguments, which are always the same."""
        code: Callable[..., complex] = stopping_point.for_types_of((self._computer.array, self.course))
        return code

    @property
    def whereabouts(self) -> Whereabouts | None:
        """Message to a coordinator that guides by cells, after the last tick; None if it does not."""
        stamp_s = self._computer.clock.tick / TICKS_PER_S
        if self._plan is not None:
            return None
        if not self._aligned:
            return Whereabouts(stamp_s=stamp_s, aligned=False)
        return self._cell.report(stamp_s, self._stopping_segment())

    @property
    def plan_state(self) -> PlanState | None:
        """Message to a coordinator that guides by plans, after the last tick; None if it does not."""
        stamp_s = self._computer.clock.tick / TICKS_PER_S
        if self._plan is None:
            return None
        if not self._aligned:
            return PlanState(stamp_s=stamp_s, aligned=False)
        estimate = self._estimator.estimate()
        return PlanState(
            stamp_s=stamp_s,
            x_m=float(estimate[0]),
            y_m=float(estimate[1]),
            heading_rad=float(estimate[2]),
            speed_mps=float(estimate[3]),
            yaw_rate_radps=float(estimate[4]),
            adopted=self._plan.adopted,
            decided=self._plan.decided,
            stays=self.must_stand,
        )

    @property
    def must_stand(self) -> bool:
        """True if the robot has no fixes, and may not drive as far as its guidance may take it."""
        return bool(must_stand(self._computer.array, self.course.blind))

    @property
    def plan(self) -> tuple[Floats, float]:
        """Plan that it follows, (m, 5) samples of `timed_motion`, and its start by the robot's clock (s)."""
        if self._plan is None:
            return np.zeros((0, COLUMNS)), 0.0
        return self._plan.plan, self._plan.plan_tick / TICKS_PER_S

    def run(self) -> Asking[Step]:
        """Run one tick towards the target, as `guided_tick.guide`."""
        if not self._aligned:
            self._aligned = self._estimator.aligned
            return Step(self.stop_hard())
        if problem := self._watch.drive_problem():
            return Step((yield from self.rest()), hold=problem)
        if self.must_stand:
            command = yield from self.rest()
            return Step(command, waits=f"waiting for its pose: {self._watch.pose_problem}")
        drive_on(self._computer.array, self.course)
        return Step(self._computer.command.command)

    def rest(self) -> Asking[Command]:
        """Run one tick of braking straight ahead, or of what is left of a plan, which others keep clear."""
        yield from ()  # there is no follower to be asked
        self._halted_tick = self._computer.clock.tick
        if self._plan is not None and not self._plan.over(self._computer.clock.tick):
            drive_on(self._computer.array, self.course)
            return self._computer.command.command
        if self.standing and self._computer.guidance.speed_mps == 0.0:
            return self.stop_hard()
        drive_on(self._computer.array, self.course._replace(until_tick=-1))
        return self._computer.command.command

    def stop_hard(self) -> Command:
        """Run one tick of braking as hard as the wheels can."""
        self._halted_tick = self._computer.clock.tick
        self._computer.guidance.reset()
        command = self._computer.command
        return command.give(command.standstill)

    @property
    def standing(self) -> bool:
        """True if the robot is not commanded to move, and its wheels have stood for a while or the estimate is 0."""
        moves_mps = self._drive.moves_mps(self._computer.command.actuators)
        estimator = self._estimator
        still = not estimator.started or abs(estimator.speed_now_mps()) < 2.0 * STOPPED_MPS or estimator.wheels_stand
        return bool(moves_mps < 2.0 * STOPPED_MPS and still)

    @property
    def aligning(self) -> bool:
        """True if the robot does not yet know where it stands."""
        return not self._aligned

    @property
    def nominal(self) -> bool:
        """True if nothing has to be decided while the robot drives on."""
        return self._aligned

    @property
    def waiting(self) -> bool:
        """Always False: a guided robot has no work that a wrong start could spoil."""
        return False

    @property
    def held(self) -> bool:
        """Always False: the cell moves on."""
        return False

    @property
    def progress(self) -> JobProgress:
        """Empty progress: guidance has no end."""
        return JobProgress()

    @property
    def place(self) -> None:
        """Always None: another process does not know the cell, and needs new guidance."""
        return None

    @property
    def spraying(self) -> bool:
        """Always False."""
        return False

    @property
    def painted(self) -> PaintBelief:
        """Empty estimate of the paint."""
        return PaintBelief()

    @property
    def lateral_error_m(self) -> float:
        """Always 0: there is no path."""
        return 0.0

    @property
    def way(self) -> tuple[int, bool]:
        """Always the same: straight ahead, as the robot would brake."""
        return 0, False

    @property
    def returns(self) -> bool:
        """Always False: there is no path."""
        return False

    def lay_way(self, *, back: bool) -> None:
        """Lay the way to come in the computer's state: straight ahead."""
        lay_straight(self._computer.array)

    @property
    def next_paint_m(self) -> float:
        """Always 0: there is no path."""
        return 0.0

    def close_valve(self, in_s: float = TICK_S) -> None:
        """Do nothing: the valve is always closed."""

    def owe_dry(self, dry_s: float) -> None:
        """Do nothing: a guided robot does not spray."""

    def owe_moved(self, ahead_m: float) -> None:
        """Do nothing: a guided robot does not spray."""

    def locate(self) -> float:
        """Return 0: there is no path."""
        return 0.0

    def go_on(self) -> None:
        """Do nothing: cell and target remain."""
