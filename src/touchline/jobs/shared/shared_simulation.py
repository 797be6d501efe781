"""Several emulated robots on one field in one process, in step, each as far as the traffic rules allow."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.body_contacts import PRESSED
from touchline.coordination.traffic.gates import authorities_m
from touchline.core.stopwatch import Stopwatch
from touchline.jobs.shared.assignment import assignments
from touchline.jobs.shared.body_gap import BodyGap
from touchline.jobs.shared.claimed_stretch import publish_stretches
from touchline.jobs.shared.joint_ground import JointGround
from touchline.jobs.shared.joint_paint import JointPaint
from touchline.jobs.shared.remaining_work import RemainingWork
from touchline.jobs.shared.replanning import FieldRobot, no_remaining_work, painted_before, replan_rest
from touchline.jobs.shared.shared_job import SharedJob
from touchline.jobs.shared.team_member import SLICE_TICKS, Listener, TeamMember
from touchline.jobs.shared.team_order import OrderTaken, TeamOrder
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.jobs.shared.work_evaluation import evaluate_work
from touchline.jobs.single.simulation import Outcome
from touchline.jobs.single.stall_detector import ADVANCED_M
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.schemas.setup import Setup
from touchline.services.planner.sequencing.wet_paint import NO_LINES
from touchline.services.robot_sim.loaded_job import Taking

PATIENCE_S: Final = 180.0
"""Sim time without progress after which an operator would have to act."""
REPORT_EVERY: Final = 100
"""Slices between two progress reports."""
OUT_OF_SERVICE: Final = "out of service"

Progress = Callable[[float, str], None]
Floats = NDArray[np.float64]


def names_of(robots: int) -> list[str]:
    """Return the names of the robots of a shared job."""
    return [f"r{number + 1}" for number in range(robots)]


@dataclass(frozen=True)
class TeamOutcome:
    """Outcome of a simulated shared job.

    Attributes:
        robots: Outcome of each robot, its assignments only.
        work: Paint of all together, or the ground that they have covered.
        total_time_s: Sim time until the last one was done.
        apart_m: Smallest distance of bodies.
        waited_s: Time for which each robot stood because another one was in its way.
        reason: Reason for a failure; "" if there was none.
        wall_time_s: Wall clock, reports included.
        left_out: Work that could not be reached beside standing robots.
        orders: Orders and their outcomes.
    """

    robots: tuple[tuple[Outcome, ...], ...]
    work: JointPaint | JointGround
    total_time_s: float
    apart_m: float
    waited_s: tuple[float, ...]
    reason: str
    wall_time_s: float
    left_out: RemainingWork
    orders: tuple[OrderTaken, ...] = ()


def simulate_shared(
    job: SharedJob,
    setups: Sequence[Setup],
    orders: Sequence[TeamOrder] = (),
    progress: Progress = lambda done, doing: None,
    *,
    hashed: bool = False,
    listener: Listener | None = None,
) -> TeamOutcome:
    """Simulate a shared job once, as fast as possible.

    Args:
        job: The job.
        setups: World and computer of each robot; the vehicle is the job's.
        orders: Scheduled orders of an operator.
        progress: Called with the fraction done, and the places of the robots.
        hashed: True if the reports contain session hashes; with a listener they always do.
        listener: Called with all telemetry of the robots, by name.

    Raises:
        CommandRefused: A robot does not accept its plan.
    """
    watch = Stopwatch()
    names = names_of(len(setups))
    members = [
        TeamMember.of(name, setup, hashed=hashed, listener=listener) for name, setup in zip(names, setups, strict=True)
    ]
    run = _SharedRun(job, members, progress)
    taken = [OrderTaken(order) for order in sorted(orders)]
    reason = run.drive(list(taken))
    for member in run.members:
        member.stretch.release()
        member.conclude()
    works = [work for member in run.members for work in member.works]
    return TeamOutcome(
        tuple(tuple(member.outcomes) for member in run.members),
        evaluate_work(job, run.planned, works),
        max(member.ended_s for member in run.members),
        run.gap.closest_m,
        tuple(member.waited_s for member in run.members),
        reason,
        watch.elapsed_s,
        run.left_out,
        tuple(taken),
    )


class _SharedRun:
    """Robots and their progress.

    Attributes:
        members: All robots.
        crew: Those of the present job, in its order.
        job: The present job.
        gap: Distance between bodies.
        left_out: Work that could not be reached.
    """

    def __init__(self, job: SharedJob, members: list[TeamMember], progress: Progress) -> None:
        """Place every robot at its start."""
        self.members, self.gap, self._progress = members, BodyGap(job.vehicle), progress
        self.left_out, self._driven = no_remaining_work(job), list[Trajectory]()
        self._slices = 0
        self._gathering = list[OrderTaken]()
        self._nothing_remains, self._problem = False, ""
        self._painted, self._begun_s = NO_LINES, 0.0
        self._begin(job, members, Taking.CARRIED)

    @property
    def planned(self) -> list[Trajectory]:
        """All planned trajectories: aborted ones as far as they were driven, and their replacements."""
        return [*self._driven, *(each.trajectory for each in self.job.plans)]

    @property
    def _now_s(self) -> float:
        return self._slices * SLICE_TICKS / TICKS_PER_S

    def _begin(self, job: SharedJob, crew: Sequence[TeamMember], taking: Taking) -> None:
        self.job, self.crew, self._begun_s = job, list(crew), self._now_s
        for member, assignment in zip(crew, assignments(job), strict=True):
            member.take(assignment, taking)
        self._authorize()
        for member in crew:
            member.order(member.emulator.start)

    def _authorize(self) -> None:
        """Set the authority of each driving robot."""
        until_m = authorities_m(self.job.table.gates, [member.progress_m for member in self.crew])
        for member, arc_m in zip(self.crew, until_m, strict=True):
            if member.under_way or member.onboard.state == TraversalStatus.READY:
                member.authorize(arc_m)
        self._claim()

    def _claim(self) -> None:
        """Publish for each robot the stretch of its path that the others avoid."""
        heard = [member for member in self.members if member.listener is not None]
        crew = {member.name for member in self.crew}
        for member in heard:
            member.claim(on_the_job=member.name in crew)
        publish_stretches([member.stretch for member in heard], self._now_s)

    def drive(self, orders: list[OrderTaken]) -> str:
        """Run until all are done or none progresses; return the reason of a failure, or ""."""
        moved_at, reached_m = 0, -1.0
        while orders or any(member.emulator.active for member in self.members):
            while orders and orders[0].order.at_s <= self._now_s:
                self._obey(orders.pop(0))
            poses = [(member, member.run_slice()) for member in self.members]
            touched = self.gap.look({member.name: each for member, each in poses if not member.gone})
            for member in self.members:
                if member.name in touched:
                    member.order(partial(member.emulator.inject_fault, PRESSED))
            self._authorize()
            self._slices += 1
            if self._gathering and all(member.waits for member in self.crew if not member.dead):
                self._hand_over()
            if self._slices % REPORT_EVERY == 0:
                now_m = self._report()
                if orders or abs(now_m - reached_m) > ADVANCED_M:
                    moved_at, reached_m = self._slices, now_m
            if (self._slices - moved_at) * SLICE_TICKS > TICKS_PER_S * PATIENCE_S:
                self._abort_all()
                break
        if self._nothing_remains:
            return ""
        failed = [member for member in self.crew if member.onboard.state != TraversalStatus.DONE]
        reasons = [f"robot {member.name}: {member.onboard.status.reason}" for member in failed]
        return "; ".join([self._problem, *reasons] if self._problem else reasons)

    def _report(self) -> float:
        """Report progress; return the distance driven by all on this job, m."""
        now_m = sum(min(member.furthest_m, path.end_m) for member, path in zip(self.crew, self.job.paths, strict=True))
        at = ", ".join(f"{member.name} {member.onboard.status.segment_id}" for member in self.crew if member.under_way)
        self._progress(now_m / sum(path.end_m for path in self.job.paths), at)
        return now_m

    def _obey(self, taken: OrderTaken) -> None:
        """Carry out an order that is due, and note its outcome; a take-over takes several steps."""
        order = taken.order
        member = self.members[order.robot]
        if order.kind == "take-over":
            self._gather(taken, member)
        elif order.kind == "remove":
            taken.done = member.dead and not member.gone
            member.gone = member.dead
            taken.outcome = "carried away" if taken.done else f"nothing: {member.name} has not failed there"
        elif order.kind == "fail":
            taken.done, member.dead = not member.dead, True
            if taken.done:
                member.order(partial(member.emulator.estop, OUT_OF_SERVICE))
            taken.outcome = "it is out of service" if taken.done else "nothing: it has failed before"
        elif order.kind == "pause":
            taken.done = member.onboard.state == TraversalStatus.RUNNING
            if taken.done:
                member.order(member.emulator.pause)
            taken.outcome = "paused" if taken.done else "nothing: it is not under way"
        elif order.kind == "resume":
            taken.done = member.onboard.state == TraversalStatus.PAUSED
            if taken.done:
                member.order(member.emulator.resume)
            taken.outcome = "it goes on" if taken.done else "nothing: it is not paused"

    def _gather(self, taken: OrderTaken, member: TeamMember) -> None:
        if not member.dead:
            taken.outcome = f"nothing: {member.name} has not failed and does its own share"
            return
        taken.outcome = "not carried out: the others did not come to rest"
        self._gathering.append(taken)
        for each in self.crew:
            if not each.dead:
                each.stop_between_swaths()

    def _hand_over(self) -> None:
        """Abort every robot where it stands; start the rest once they are at rest."""
        for member in self.crew:
            if member.under_way and not member.dead:
                member.abort("others take over")
        if any(member.emulator.active for member in self.members):
            return
        gathering, self._gathering = self._gathering, []
        outcome, done = self._begin_on_the_rest()
        for taken in gathering:
            taken.outcome, taken.done = outcome, done

    def _begin_on_the_rest(self) -> tuple[str, bool]:
        """Start the remaining work; return the outcome, and True if all of it has a robot."""
        statuses = [each for member in self.crew for each in member.assignment_statuses]
        remaining = self.left_out.joined(self.job, statuses)
        for member in self.members:
            if not member.dead:
                member.stand_by(self._slices * SLICE_TICKS)
        self._nothing_remains = not remaining
        if not remaining:
            return "no work remains", True
        beliefs = [member.onboard.painted for member in self.crew]
        painted = painted_before(self.job, beliefs, self._painted, self._now_s - self._begun_s)
        robots = [FieldRobot(Standing(each.name, each.pose), not each.dead) for each in self.members if not each.gone]
        try:
            rest = replan_rest(self.job, remaining, robots, painted, self._progress)
        except PlanningError as error:
            self._problem = f"the rest cannot be done: {error}"
            return self._problem, False
        self._painted, self._problem, self.left_out = painted, "", rest.left_out
        self._driven += [each.driven for each in statuses]
        self._begin(rest.job, [each for each in self.members if each.name in rest.crew], Taking.HERE)
        return str(rest), True

    def _abort_all(self) -> None:
        for member in self.members:
            if member.under_way and not member.dead:
                why = member.onboard.status.reason or "it did not move on"
                member.abort(f"aborted by the simulation after {PATIENCE_S:.0f} s without progress: {why}")
