"""Simulation of a job whose robot waits for what is in its way, goes round it, and comes back to what it left out."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple, Protocol

from touchline.jobs.shared.joint_paint import JointPaint, Work, joint_paint
from touchline.jobs.single.reports import failing, hash_figures, plan_figures
from touchline.jobs.single.simulation import GivenDrive, Job, Outcome, Products, Progress, carry_out
from touchline.jobs.way_round.round_plan import plan_round
from touchline.jobs.way_round.unpainted_lines import OPERATOR, Gap, UnpaintedLines
from touchline.jobs.way_round.waiting import PATIENT, Patience, Waiting, WaitingOrder
from touchline.onboard.interface import TICKS_PER_S
from touchline.onboard.protection.protector import Blocked
from touchline.schemas.digest import scenario_hash
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.template import Polygon
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.settling import RESTING_MPS

AGAIN_S: Final = 10.0
"""Time after which a way round is searched again where there was none."""


class Sight(Protocol):
    """Perception and protection of a robot."""

    def blocked(self) -> Blocked | None:
        """Return the robot's report of what is in its way; None if nothing is."""

    def seen(self) -> Sequence[Polygon]:
        """Return outlines of what it believes to stand or move on the field and its plan does not know."""


class TimedWaitingOrder(NamedTuple):
    """Order of an operator at a time, s, as `Waiting` understands it."""

    at_s: float
    answer: WaitingOrder


@dataclass(frozen=True)
class WayRoundOutcome:
    """Outcome of a job with ways round.

    Attributes:
        last: Outcome of the last drive, with those before it.
        paint: Paint of all drives together, against what the robot believes to have painted.
        gaps: What it left unpainted.
    """

    last: Outcome
    paint: JointPaint
    gaps: tuple[Gap, ...]

    def figures(self, job: Job) -> dict[str, Any]:
        """Return the report, as `touchline run` gives it, over all drives."""
        drives = (*self.last.earlier, self.last)
        total_s = sum(each.report.total_time_s for each in drives)
        finished = not self.last.reason and self.paint.metrics.verdict.accepted
        return {
            "success": finished,
            "reason": self.last.reason or ("" if finished else failing(self.last.report, None)),
            "plan": plan_figures(job.plan_report),
            "traversal": {
                "total_time_s": total_s,
                "wall_time_s": self.last.wall_time_s,
                "real_time_factor": total_s / self.last.wall_time_s,
                "follower_fallbacks": sum(each.report.follower_fallbacks for each in drives),
            },
            "paint": self.paint.figures(),
            "gaps": gap_figures(self.gaps),
            "drives": [each.reason or "done" for each in drives],
            "recording": self.last.recording,
            "hash": hash_figures(self.last.scenario_hash, self.last.report),
        }


def gap_figures(gaps: Sequence[Gap]) -> dict[str, Any]:
    """Return unpainted parts of lines as figures of a report."""
    return {
        "total_m": sum(gap.to_m - gap.from_m for gap in gaps),
        "stretches": [
            {"line": gap.line_id, "along_m": [gap.from_m, gap.to_m], "reason": gap.reason or "not painted"}
            for gap in gaps
        ],
    }


def simulate_way_round(
    emulator: Emulator,
    job: Job,
    sight: Sight,
    products: Products,
    answers: Sequence[TimedWaitingOrder] = (),
    patience: Patience = PATIENT,
    progress: Progress = lambda done, doing: None,
) -> WayRoundOutcome:
    """Simulate a job of lines once, as fast as possible.

    Args:
        emulator: The robot, just switched on.
        job: The planned job.
        sight: What the robot perceives.
        products: Products besides the report.
        answers: Orders of an operator; with any the robot waits for an answer.
        patience: How long it waits.
        progress: Called with the fraction done of a drive and where the robot is.

    Raises:
        CommandRefused: The robot does not take a plan.
        RecordingError: The recording cannot be written.
    """
    drive = GivenDrive(job.trajectory, job.template, Taking.CARRIED, PlanCause.of(job.options, job.plan_report))
    rerouting = _WayRound(emulator, job, sight, Waiting(patience), list(answers))
    last = carry_out(emulator, drive, products, progress, rerouting)
    last = replace(last, scenario_hash=scenario_hash(emulator.setup, job.template, job.options))
    unpainted = rerouting.unpainted
    paint = joint_paint(unpainted.painted(), job.vehicle, rerouting.works)
    return WayRoundOutcome(last, paint, tuple(unpainted.gaps()))


class _WayRound:
    """Choice of the drives of one job; see `Rerouting`.

    Attributes:
        unpainted: Unpainted lines, by the robot's own record of ended drives.
        works: True paint of ended drives.
    """

    def __init__(
        self, emulator: Emulator, job: Job, sight: Sight, waiting: Waiting, answers: list[TimedWaitingOrder]
    ) -> None:
        self._emulator, self._options, self._sight, self._waiting = emulator, job.options, sight, waiting
        self._answers, self._attended = sorted(answers), bool(answers)
        self._trajectory = job.trajectory
        self._following: GivenDrive | None = None
        self.unpainted, self.works = UnpaintedLines(job.template, job.vehicle), list[Work]()
        self.unpainted.note(job.template, job.plan_report.left_out)
        self._search_tick, self._returning = 0, False
        known = [*([job.template.boundary] if job.template.boundary else []), *job.template.obstacles]
        self._for_good = {OPERATOR, *(outline.id for outline in known)}

    def gives_up(self) -> str:
        """See `Rerouting`; once the robot has waited for long enough, and the rest has a plan."""
        emulator, tick = self._emulator, self._emulator.tick_count
        while self._answers and self._answers[0].at_s * TICKS_PER_S <= tick:
            self._waiting.answer = self._answers.pop(0).answer
        answer = self._waiting.look(tick, self._sight.blocked(), attended=self._attended)
        stands = abs(emulator.onboard.estimate.speed_mps) < RESTING_MPS
        if answer is None or not stands or tick < self._search_tick:
            return ""
        seen = self._sight.seen()
        self._enter_paint()
        gaps = self._open_gaps()
        try:
            self._following = self._drive(gaps, seen) if gaps else None
        except PlanningError as error:
            if self._returning:
                return f"what was left out cannot be reached: {error}"
            self._search_tick = tick + round(AGAIN_S * TICKS_PER_S)
            return ""
        if answer is WaitingOrder.LEAVE_OUT:
            self.unpainted.leave_out({each.id for each in seen}, OPERATOR)
        return f"goes round {', '.join(each.id for each in seen)}" if gaps else "nothing remains to be painted"

    def next_drive(self) -> GivenDrive | None:
        """See `Rerouting`: the way round, and after the last line, once, back to what was left out."""
        self.works.append(Work(self._emulator.ledger, self._emulator.track))
        self._enter_paint()
        following, self._following = self._following, None
        if following is None and self._emulator.onboard.state == TraversalStatus.DONE and not self._returning:
            self._returning = True
            if gaps := self._open_gaps():
                with suppress(PlanningError):  # it still stands there
                    following = self._drive(gaps, self._sight.seen())
        if following is not None:
            self._trajectory = following.trajectory
        return following

    def _enter_paint(self) -> None:
        self.unpainted.enter(self._trajectory, self._emulator.onboard.painted)

    def _open_gaps(self) -> list[Gap]:
        """Unpainted parts of lines that are not left out for good."""
        return [gap for gap in self.unpainted.gaps() if gap.reason not in self._for_good]

    def _drive(self, gaps: Sequence[Gap], seen: Sequence[Polygon]) -> GivenDrive:
        """Plan gaps from where the robot stands."""
        pose = self._emulator.onboard.estimate[:3]
        made = plan_round(self.unpainted, gaps, pose, seen, self._options)
        cause = PlanCause.of(made.options, made.plan.report)
        return GivenDrive(made.plan.trajectory, made.template, Taking.HERE, cause)
