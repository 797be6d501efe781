"""Runs a job in one process, without bus or wall clock, with the same bits as over Zenoh."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, Self

from touchline.core.stopwatch import Stopwatch
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.jobs.single.reports import (
    contact_figures,
    failing,
    hash_figures,
    plan_figures,
    traversal_figures,
    work_report,
)
from touchline.jobs.single.stall_detector import ADVANCED_M
from touchline.schemas.digest import scenario_hash
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import (
    AreaReport,
    ContactReport,
    PaintMarks,
    PlanOptions,
    PlanReport,
    Trajectory,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.drive_log import DriveLog
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.telemetry import Telemetry

Progress = Callable[[float, str], None]

#: Ticks between two progress reports.
_SLICE_TICKS = 1000
#: Ticks between two looks at what a robot meets.
_LOOK_TICKS = 10
#: Ticks without progress after which a robot is taken to wait for an operator who is not there.
_PATIENCE_TICKS = 18_000


@dataclass(frozen=True)
class Job:
    """Planned job: everything except the scenario and the computer's configuration.

    Attributes:
        trajectory: The plan.
        plan_report: Its figures, planning time included.
    """

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    trajectory: Trajectory
    plan_report: PlanReport

    @classmethod
    def prepare(
        cls,
        template: Template,
        options: PlanOptions,
        vehicle: Vehicle | None = None,
        progress: Progress = lambda done, doing: None,
    ) -> Self:
        """Plan ``template`` for the vehicle, by default the shipped one.

        Raises:
            PlanningError: It cannot be planned.
        """
        watch = Stopwatch()
        vehicle = vehicle or Vehicle()
        planned = plan(template, vehicle, options, lambda stage, fraction: progress(fraction, f"Planning: {stage}"))
        report = planned.report.model_copy(update={"planning_time_s": watch.elapsed_s})
        return cls(template, vehicle, options, planned.trajectory, report)


@dataclass(frozen=True)
class Outcome:
    """A finished run.

    Attributes:
        report: Its ``session_hash`` is empty if the run was neither recorded nor hashed.
        area: Report of its areas, if a covering tool has worked on some.
        contacts: Report of contacts with things, if there were any.
        reason: Why it ended early, or empty.
        wall_time_s: Wall-clock time of the drive, report included.
        recording: Path, messages and bytes of the recording, if there is one.
        strokes: The paint, if requested.
        scenario_hash: Hash of its inputs.
        earlier: Outcomes of the drives before the last one, if the robot was rerouted.
    """

    report: TraversalReport
    area: AreaReport | None
    contacts: ContactReport | None
    reason: str
    wall_time_s: float
    recording: dict[str, Any] | None
    strokes: tuple[PaintMarks, ...]
    scenario_hash: str = ""
    earlier: "tuple[Outcome, ...]" = ()

    def figures(self, job: Job) -> dict[str, Any]:
        """Return the report as ``touchline run`` gives it."""
        return {
            "success": self.report.success,
            "reason": self.reason or failing(self.report, self.area, self.contacts),
            "plan": plan_figures(job.plan_report),
            "traversal": traversal_figures(self.report, self.wall_time_s),
            **work_report(self.report, self.area, job.plan_report),
            **contact_figures(self.contacts),
            "recording": self.recording,
            "hash": hash_figures(self.scenario_hash, self.report),
        }


@dataclass(frozen=True)
class Products:
    """Requested products of a run besides its report.

    Attributes:
        hashed: Whether to compute the session hash; a recorded run always has one.
        record: MCAP file to write.
        strokes: Whether the outcome holds the paint itself.
        log: Log of all ticks to fill in, if one is wanted; the run is then hashed, too.
    """

    hashed: bool = False
    record: Path | None = None
    strokes: bool = False
    log: DriveLog | None = None


_REPORT_ALONE = Products()
REPLACED: Final = "another trajectory has taken over under way"
"""Reason of the end of a drive that was replaced."""


class GivenDrive(NamedTuple):
    """Trajectory for an emulated robot, and its context.

    Attributes:
        trajectory: The plan.
        template: Template against which its paint is evaluated, if any.
        taking: How the robot gets to the start.
        cause: Inputs of the plan, for the recording.
    """

    trajectory: Trajectory
    template: Template | None
    taking: Taking
    cause: PlanCause | None = None


def simulate(
    job: Job,
    scenario: Scenario,
    config: OnboardConfig | None = None,
    products: Products = _REPORT_ALONE,
    progress: Progress = lambda done, doing: None,
) -> Outcome:
    """Simulate ``job`` once, as fast as possible.

    Telemetry is made only to be hashed or recorded; that changes no figure.

    Args:
        job: The planned job.
        scenario: World, noise and faults.
        config: Configuration of the onboard computer; by default the shipped robot's.
        products: Products besides the report.
        progress: Called with the fraction done and where the robot is, every few seconds of sim time.

    Raises:
        CommandRefused: The robot does not take the plan.
        RecordingError: The recording cannot be written.
    """
    return simulate_with(Emulator(job.vehicle, scenario, config), job, products, progress)


def simulate_with(
    emulator: Emulator, job: Job, products: Products, progress: Progress = lambda done, doing: None
) -> Outcome:
    """Simulate ``job`` with a robot that has just been switched on; see `simulate`.

    Args:
        emulator: The robot.
        job: The planned job.
        products: Products besides the report.
        progress: As for `simulate`.

    Raises:
        CommandRefused: The robot does not take the plan.
        RecordingError: The recording cannot be written.
    """
    drive = GivenDrive(job.trajectory, job.template, Taking.CARRIED, PlanCause.of(job.options, job.plan_report))
    done = carry_out(emulator, drive, products, progress)
    return replace(done, scenario_hash=scenario_hash(emulator.setup, job.template, job.options))


class Rerouting(Protocol):
    """Choice of other drives than the one that was given, by what the robot meets."""

    def begins(self, drive: GivenDrive, told: Callable[[], None]) -> None:
        """Note that the robot has taken a drive; `told` is called after each of its reports, to publish it."""

    def gives_up(self) -> str:
        """Return why the present drive ends where the robot stands; "" to go on. Asked ten times a second."""

    def replacement(self) -> GivenDrive | None:
        """Return a drive that takes over under way from the present one; None: go on. Asked after `gives_up`."""

    def next_drive(self) -> GivenDrive | None:
        """Return the drive after one that has ended, from where the robot stands; None: that was the last."""

    def refused(self, why: str) -> None:
        """Note that the robot has not taken that drive, which ends the job."""


def carry_out(
    emulator: Emulator,
    drive: GivenDrive,
    products: Products = _REPORT_ALONE,
    progress: Progress = lambda done, doing: None,
    rerouting: Rerouting | None = None,
) -> Outcome:
    """Have an emulated robot drive a trajectory to its end, as fast as possible.

    Args:
        emulator: The robot, at rest.
        drive: The trajectory.
        products: Products besides the report.
        progress: As for `simulate`.
        rerouting: Choice of further drives; None: this is the only one.

    Returns:
        Outcome of the last drive, with those of the others before it.

    Raises:
        CommandRefused: The robot does not take the plan.
        RecordingError: The recording cannot be written.
    """
    watch = Stopwatch()
    telemetry = Telemetry(emulator, log=products.log)
    telemetry.go_on()
    listened = products.record is not None or products.hashed or products.log is not None
    before = [telemetry.setup(), *telemetry.standing(), *telemetry.awake()] if listened else []
    _take(emulator, drive)
    runner, done = FastRunner(emulator), list[Outcome]()
    slice_ticks = _SLICE_TICKS if rerouting is None else _LOOK_TICKS
    with PayloadRecorder(products.record) as listener:

        def publish() -> None:
            if products.record is None:
                telemetry.only_hashed()
            else:
                listener.hear("", telemetry.told())

        def run_slice() -> None:
            last = (emulator.tick_count // slice_ticks + 1) * slice_ticks
            if not listened:
                runner.run(last - emulator.tick_count)
                return
            while emulator.tick_count < last and emulator.active:
                ticks = min(telemetry.until_due(slice_ticks), last - emulator.tick_count)
                telemetry.hold(runner.step(ticks, telemetry.rows))
                if telemetry.full:
                    publish()
            publish()

        def told() -> None:
            if listened:
                listener.hear("", telemetry.news())

        def look() -> None:
            if rerouting is None:
                return
            if why := rerouting.gives_up():
                emulator.abort(why)
                told()
            elif (other := rerouting.replacement()) is not None:
                replaced = Outcome(*telemetry.reports(), REPLACED, 0.0, None, ())
                try:
                    _take(emulator, other)
                except CommandRefused:  # later it may
                    return
                done.append(replaced)
                listener.hear("", telemetry.loaded(other.trajectory, other.template))
                rerouting.begins(other, told)

        listener.hear("", before)
        while True:
            if listened:
                listener.hear("", telemetry.awake())
                listener.hear("", telemetry.loaded(drive.trajectory, drive.template))
            if rerouting is not None:
                rerouting.begins(drive, told)
            emulator.start()
            told()
            reason = _drive(emulator, run_slice, progress, slice_ticks, look)
            strokes = telemetry.strokes() if products.strokes else ()
            done.append(Outcome(*(telemetry.final or telemetry.reports()), reason, 0.0, None, strokes))
            following = rerouting.next_drive() if rerouting is not None else None
            if following is None:
                break
            drive = following
            try:
                _take(emulator, drive)
            except CommandRefused as error:  # it has been pushed since it was planned from where it stood
                done[-1] = replace(done[-1], reason=str(error))
                assert rerouting is not None, "it has given the drive"
                rerouting.refused(str(error))
                told()
                break
    return replace(done[-1], wall_time_s=watch.elapsed_s, recording=listener.figures(), earlier=tuple(done[:-1]))


def _take(emulator: Emulator, drive: GivenDrive) -> None:
    if drive.taking is not Taking.UNDER_WAY:
        emulator.check_load()
    emulator.take(emulator.prepare(drive.trajectory, drive.template, taking=drive.taking, cause=drive.cause))


def _drive(
    emulator: Emulator,
    run_slice: Callable[[], None],
    progress: Progress,
    slice_ticks: int,
    look: Callable[[], None],
) -> str:
    """Run to the end and return the reason; abort a robot that waits for a person, or does not move on for minutes.

    Args:
        emulator: The robot.
        run_slice: Runs the next ticks.
        progress: As for `simulate`.
        slice_ticks: Number of these ticks.
        look: Called between them; it may end the drive.
    """
    patience_slices = _PATIENCE_TICKS // slice_ticks
    reached, patience = -1.0, patience_slices
    while emulator.active:
        run_slice()
        status = emulator.onboard.status
        if status.total_length_m > 0.0 and emulator.tick_count % _SLICE_TICKS < slice_ticks:
            progress(status.arc_length_m / status.total_length_m, status.segment_id)
        patience -= 1
        if abs(status.arc_length_m - reached) > ADVANCED_M:
            reached, patience = status.arc_length_m, patience_slices
        if status.pause is not None and not status.pause.ends_by_itself:
            emulator.abort(f"aborted by the simulation, in which nobody resumes: {status.reason}")
            patience = patience_slices
        elif patience == 0:
            if status.state not in (TraversalStatus.RUNNING, TraversalStatus.PAUSED):
                break  # it ended, and rolls on
            why = status.reason or "it did not move on"
            emulator.abort(f"aborted by the simulation after {_PATIENCE_TICKS // 100} s without progress: {why}")
        else:
            look()
    return emulator.onboard.status.reason
