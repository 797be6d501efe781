"""Simulation of a job whose robot waits for what is in its way, goes round it, and comes back to what it left out."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.single.reports import hash_figures, plan_figures
from touchline.jobs.single.simulation import GivenDrive, Job, Outcome, Products, Progress, carry_out, simulate_with
from touchline.jobs.way_round.covered_areas import covered_areas
from touchline.jobs.way_round.drives_report import EndedDrive, drives_figures, ended_early, failure, painted_drives
from touchline.jobs.way_round.work_done import WorkDone
from touchline.schemas.digest import scenario_hash
from touchline.schemas.errors import NothingReachedError, PlanningError
from touchline.schemas.messages import AreaReport, PaintMarks, Trajectory, TraversalReport
from touchline.schemas.plan_cause import PlanCause
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plan_task import Company
from touchline.services.robot_sim.accounting.travelled_path import travelled_path
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.way_round.rest_request import RestRequest
from touchline.services.robot_sim.way_round.uncovered_ground import UncoveredGround
from touchline.services.robot_sim.way_round.way_round_job import WayRoundJob, goes_round


@dataclass(frozen=True)
class WayRoundOutcome:
    """Outcome of a job with ways round.

    Attributes:
        last: Outcome of the last drive, with those before it.
        work: Work of all drives together.
        plans: Plan of each drive.
    """

    last: Outcome
    work: WorkDone
    plans: tuple[Trajectory, ...]

    @property
    def several(self) -> bool:
        """True if the robot has gone round something, or ended the job before its end."""
        return bool(self.last.earlier or self.last.reason)

    @property
    def report(self) -> TraversalReport:
        """Report of the only drive, or of all: sums of times, the work of all, and the hash of the last."""
        last = self.last.report
        if not self.several:
            return last
        reports = [each.report for each in self.drives]
        times_s = [each.total_time_s for each in reports]
        return self.work.report.model_copy(
            update={
                "header": last.header,
                "success": not failure(self._ended, self.work),
                "total_time_s": math.fsum(times_s),
                "position_rmse_m": _rms([each.position_rmse_m for each in reports], times_s),
                "heading_rmse_rad": _rms([each.heading_rmse_rad for each in reports], times_s),
                "follower_fallbacks": sum(each.follower_fallbacks for each in reports),
                "session_hash": last.session_hash,
            }
        )

    @property
    def area(self) -> AreaReport | None:
        """Report of the areas, if a covering tool has worked on some."""
        return self.work.area if self.several else self.last.area

    @property
    def wall_time_s(self) -> float:
        """Wall-clock time of the job."""
        return self.last.wall_time_s

    @property
    def drives(self) -> tuple[Outcome, ...]:
        """All drives in order."""
        return (*self.last.earlier, self.last)

    @property
    def _ended(self) -> list[EndedDrive]:
        return [EndedDrive(each.report, each.contacts, each.reason) for each in self.drives]

    @property
    def strokes(self) -> list[PaintMarks]:
        """Paint of all drives, if requested."""
        return [stroke for each in self.drives for stroke in each.strokes]

    def figures(self, job: Job) -> dict[str, Any]:
        """Return the report, as `touchline run` gives it, over all drives."""
        if not self.several:
            return self.last.figures(job)
        figures = drives_figures(self._ended, self.work, self.last.wall_time_s)
        return {
            **figures,
            "plan": plan_figures(job.plan_report),
            "recording": self.last.recording,
            "hash": hash_figures(self.last.scenario_hash, self.last.report),
        }


class WayRoundDrives:
    """Drives of one job, as `Rerouting` asks for them.

    Args:
        emulator: The robot, just switched on.
        job: The planned job.

    Attributes:
        works: True work of ended drives.
        plans: Plan of each drive.
        driven: What the robot drove of the plan of each, by its own record.
    """

    def __init__(self, emulator: Emulator, job: Job) -> None:
        self._emulator, self._job, self._trajectory = emulator, job, job.trajectory
        self._following: GivenDrive | None = None
        self._way_round: WayRoundJob | None = None
        self.works, self.plans = list[Work](), list[Trajectory]()
        self.driven = list[Trajectory]()

    @property
    def way_round(self) -> WayRoundJob:
        """Behaviour of the robot, once the job has begun."""
        assert self._way_round is not None, "the job has begun"
        return self._way_round

    def begins(self, drive: GivenDrive, told: Callable[[], None]) -> None:
        """See `Rerouting`."""
        self._trajectory = drive.trajectory
        self.plans.append(drive.trajectory)
        if self._way_round is None:
            job = self._job
            self._way_round = WayRoundJob(self._emulator, job.template, job.trajectory, _cause(job), told)
        else:
            self._way_round.drives_on(drive.trajectory)

    def gives_up(self) -> str:
        """See `Rerouting`; once the robot has waited for long enough, and the rest has a plan."""
        if not self.way_round.look(attended=False):
            return ""
        request = self.way_round.rest()
        if request is None:
            return self.way_round.nothing_remains()
        try:
            planned = self._plan(request)
        except PlanningError as error:
            return self._finds_no_way(error)
        self._following = _drive(request, planned)
        return self.way_round.breaks_off(request, planned.trajectory, planned.report.left_out)

    def replacement(self) -> GivenDrive | None:
        """See `Rerouting`: this robot goes round things from where it stands."""
        return None

    def next_drive(self) -> GivenDrive | None:
        """See `Rerouting`: the way round, and after the last line, once, back to what was left out."""
        self.works.append(Work(self._emulator.work.ledger, self._emulator.work.track))
        self.driven.append(travelled_path(self._trajectory, self._emulator.onboard.status.arc_length_m))
        following, self._following = self._following, None
        if following is None and (draft := self.way_round.drive_ends()) is not None:
            following = self._return(self.way_round.request(draft, draft.rest()))
        return following

    def refused(self, why: str) -> None:
        """See `Rerouting`."""
        self.way_round.stays(why)

    def _return(self, request: RestRequest | None) -> GivenDrive | None:
        """Return the drive back to what was left out; None if there is none."""
        if request is None:
            self.way_round.nothing_remains()
            return None
        try:
            planned = self._plan(request)
        except PlanningError as error:
            self._finds_no_way(error)
            return None
        self.way_round.returns(request, planned.trajectory, planned.report.left_out)
        return _drive(request, planned)

    def _finds_no_way(self, error: PlanningError) -> str:
        return self.way_round.finds_no_way(str(error), nothing_reached=isinstance(error, NothingReachedError))

    def _plan(self, request: RestRequest) -> Plan:
        """Plan the rest; raises `PlanningError`."""
        company = Company.of_rest(request.rest.template, request.rest.pieces)
        return plan(request.template, self._job.vehicle, request.options, company=company)

    def done(self, ended: str) -> WorkDone:
        """Return the work of all drives, against the template; `ended` as in `PaintedDrives`."""
        vehicle, remains = self._job.vehicle, self.way_round.remains
        if isinstance(remains, UncoveredGround):
            return covered_areas(remains.template, vehicle, self.driven, self.works, remains.notes)
        return painted_drives(remains.template, vehicle, self.works, self.way_round.left_out.stretches, ended)


def _drive(request: RestRequest, planned: Plan) -> GivenDrive:
    return GivenDrive(planned.trajectory, request.rest.template, Taking.HERE, request.cause(planned.report))


def simulate_way_round(
    job: Job,
    emulator: Emulator,
    products: Products,
    progress: Progress = lambda done, doing: None,
    drives: WayRoundDrives | None = None,
) -> WayRoundOutcome:
    """Simulate a job once, as fast as possible.

    Args:
        job: The planned job.
        emulator: The robot, just switched on.
        products: Products besides the report.
        progress: Called with the fraction done of a drive and where the robot is.
        drives: Drives of the job; None: nobody answers the robot when it waits.

    Raises:
        CommandRefused: The robot does not take a plan.
        RecordingError: The recording cannot be written.
    """
    given = GivenDrive(job.trajectory, job.template, Taking.CARRIED, _cause(job))
    rerouting = drives or WayRoundDrives(emulator, job)
    last = carry_out(emulator, given, products, progress, rerouting)
    last = replace(last, scenario_hash=scenario_hash(emulator.setup, job.template, job.options))
    return WayRoundOutcome(last, rerouting.done(ended_early(last.reason)), tuple(rerouting.plans))


def _cause(job: Job) -> PlanCause:
    return PlanCause.of(job.options, job.plan_report)


def _rms(values: Sequence[float], times_s: Sequence[float]) -> float:
    """Return the root mean square of drives over all their time."""
    total_s = math.fsum(times_s)
    squares = math.fsum(value * value * time_s for value, time_s in zip(values, times_s, strict=True))
    return math.sqrt(squares / total_s) if total_s else 0.0


def simulate_job(
    job: Job, emulator: Emulator, products: Products, progress: Progress = lambda done, doing: None
) -> Outcome | WayRoundOutcome:
    """Simulate a job once, as fast as possible; the robot goes round things in its way if it has a lidar.

    Arguments and errors are those of `simulate_way_round`.
    """
    if goes_round(job.vehicle, job.template):
        return simulate_way_round(job, emulator, products, progress)
    return simulate_with(emulator, job, products, progress)
