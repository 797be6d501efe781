"""Several emulated robots on one field in one process, in step, each as far as the traffic rules let it."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import TraversalStatus
from touchline.schemas.setup import Setup
from touchline.services.fleet.traffic.gates import authorities_m
from touchline.services.onboard import Onboard
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.services.runs.sharing.body_gap import BodyGap
from touchline.services.runs.sharing.joint_paint import JointPaint, Work, joint_paint
from touchline.services.runs.sharing.shared_job import SharedJob
from touchline.services.runs.simulation import Outcome

SLICE_TICKS: Final = 10
"""Robots report, and learn how far they may drive, ten times a second."""
PATIENCE_S: Final = 180.0
"""If none has come further for so long, somebody would have to do something."""
TOLD_EVERY: Final = 100
"""Slices between two looks at how far they are."""

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]


class TeamOrder(NamedTuple):
    """What an operator orders while they work.

    Attributes:
        at_s: When, in sim time.
        robot: Which, by number.
        kind: "pause" or "resume".
    """

    at_s: float
    robot: int
    kind: str


@dataclass(frozen=True)
class TeamOutcome:
    """What has come of it.

    Attributes:
        robots: Of each robot, its share alone.
        paint: Of all together.
        total_time_s: Until the last one was done, sim time.
        apart_m: How near to each other bodies came.
        waited_s: How long each robot stood because another one was in its way.
        reason: Why it failed; "" if it did not.
        wall_time_s: Reports included.
    """

    robots: tuple[Outcome, ...]
    paint: JointPaint
    total_time_s: float
    apart_m: float
    waited_s: tuple[float, ...]
    reason: str
    wall_time_s: float


@dataclass
class _Member:
    """A robot of the team.

    Attributes:
        emulator, onboard: It.
        furthest_m: That it has reported.
        waited_s: So long it was held.
    """

    emulator: Emulator
    onboard: Onboard
    furthest_m: float = 0.0
    waited_s: float = 0.0
    ended_s: float = 0.0
    _runner: FastRunner = field(init=False)
    _rows: Floats = field(init=False)

    def __post_init__(self) -> None:
        self._runner = FastRunner(self.emulator)
        self._rows = np.zeros((SLICE_TICKS, tick_log.COLUMNS))

    @property
    def progress_m(self) -> float:
        """How far it has reported to be; infinite once it is done."""
        return math.inf if self.onboard.state == TraversalStatus.DONE else self.furthest_m

    def run_slice(self) -> Floats:
        """Let a slice pass; (SLICE_TICKS, 3) its true poses. A robot that is done stands where it is."""
        emulator, rows = self.emulator, self._rows
        poses: Floats = np.empty((SLICE_TICKS, 3))
        done = 0
        while done < SLICE_TICKS and emulator.active:
            count = self._runner.step(SLICE_TICKS - done, rows)
            poses[done : done + count] = rows[:count, tick_log.TRUTH : tick_log.TRUTH + 3]
            if rows[count - 1, tick_log.TICK] != emulator.tick_count:
                poses[done + count - 1] = emulator.world.pose
            done += count
        poses[done:] = emulator.world.pose
        status = self.onboard.status
        self.furthest_m = max(self.furthest_m, status.arc_length_m)
        if status.state in (TraversalStatus.RUNNING, TraversalStatus.PAUSED):
            self.ended_s = emulator.time_s
            self.waited_s += SLICE_TICKS / 100 * self.onboard.held
        return poses


def simulate_shared(
    job: SharedJob,
    setups: Sequence[Setup],
    orders: Sequence[TeamOrder] = (),
    progress: Progress = lambda done, doing: None,
) -> TeamOutcome:
    """Carry out a shared job once, as fast as it goes.

    Args:
        job: What they paint.
        setups: Of each robot: its world and its computer; the vehicle is the job's.
        orders: What an operator orders meanwhile.
        progress: Told the fraction done, and who is where.

    Raises:
        CommandRefused: A robot does not take its plan, or an order.
    """
    begun = time.perf_counter()
    members = [_member(setup) for setup in setups]
    for member, plan, share in zip(members, job.plans, job.shares, strict=True):
        member.emulator.load(plan.trajectory, share)
    _authorize(job, members)
    for member in members:
        member.emulator.start()
    gap = BodyGap(job.vehicle)
    reason = _drive(job, members, gap, sorted(orders), progress)
    works = [Work(member.emulator.ledger, member.emulator.track) for member in members]
    paint = joint_paint(job.template, job.vehicle, works)
    outcomes = []
    for member in members:
        own = Telemetry(member.emulator)
        outcomes.append(Outcome(*own.reports(), member.onboard.status.reason, 0.0, None, own.strokes()))
    return TeamOutcome(
        tuple(outcomes),
        paint,
        max(member.ended_s for member in members),
        gap.closest_m,
        tuple(member.waited_s for member in members),
        reason,
        time.perf_counter() - begun,
    )


def _member(setup: Setup) -> _Member:
    onboard = Onboard(setup.vehicle, setup.onboard)
    return _Member(Emulator(setup.vehicle, setup.scenario, setup.onboard, onboard), onboard)


def _authorize(job: SharedJob, members: Sequence[_Member]) -> None:
    """Tell each robot that is under way how far it may drive."""
    until_m = authorities_m(job.table.gates, [member.progress_m for member in members])
    for member, arc_m in zip(members, until_m, strict=True):
        if member.onboard.state in (TraversalStatus.READY, TraversalStatus.RUNNING, TraversalStatus.PAUSED):
            member.onboard.authorize(arc_m)


def _drive(
    job: SharedJob, members: Sequence[_Member], gap: BodyGap, orders: list[TeamOrder], progress: Progress
) -> str:
    """Run until all are done or none comes any further; why it failed, or ""."""
    length_m = sum(path.end_m for path in job.paths)
    slices, moved_at, reached_m = 0, 0, 0.0
    while any(member.emulator.active for member in members):
        while orders and orders[0].at_s <= slices * SLICE_TICKS / 100:
            _obey(orders.pop(0), members)
        gap.look([member.run_slice() for member in members])
        _authorize(job, members)
        slices += 1
        if slices % TOLD_EVERY:
            continue
        now_m = sum(member.furthest_m for member in members)
        progress(now_m / length_m, ", ".join(member.onboard.status.segment_id for member in members))
        moved_at, reached_m = (slices, now_m) if now_m > reached_m else (moved_at, reached_m)
        if (slices - moved_at) * SLICE_TICKS > 100 * PATIENCE_S:
            _give_up(members)
    failed = [k for k, member in enumerate(members) if member.onboard.state != TraversalStatus.DONE]
    return "; ".join(f"robot {k + 1}: {members[k].onboard.status.reason}" for k in failed)


def _obey(order: TeamOrder, members: Sequence[_Member]) -> None:
    member = members[order.robot]
    if member.onboard.state in (TraversalStatus.RUNNING, TraversalStatus.PAUSED):
        {"pause": member.emulator.pause, "resume": member.emulator.resume}[order.kind]()


def _give_up(members: Sequence[_Member]) -> None:
    for member in members:
        if member.onboard.state in (TraversalStatus.RUNNING, TraversalStatus.PAUSED):
            why = member.onboard.status.reason or "it did not move on"
            member.emulator.abort(f"given up by the simulation after {PATIENCE_S:.0f} s without progress: {why}")
