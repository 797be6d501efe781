"""Tasks of a sweep: preparing them, and performing one in any process."""

from collections.abc import Sequence
from dataclasses import dataclass

from touchline.jobs.single.simulation import Job, Products, Progress
from touchline.jobs.sweep.combinations import RANDOM_FAULTS, SweepCase
from touchline.jobs.sweep.goal_job import GoalJob, arrival_run_figures
from touchline.jobs.sweep.team_job import TeamJob, swept_figures
from touchline.jobs.way_round.way_round_simulation import simulate_job
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import AreaReport, PoseGoal, TraversalReport
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.team import TeamScenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator

SweepJob = Job | GoalJob | TeamJob


@dataclass(frozen=True)
class Task:
    """Run to do; ``case`` and ``job`` are indices."""

    case: int
    job: int
    scenario: Scenario
    config: OnboardConfig


@dataclass(frozen=True)
class SweepRun:
    """Finished run; ``figures`` is empty if it failed, for the ``reason`` given."""

    case: int
    seed: int
    success: bool
    reason: str
    figures: dict[str, float]
    scenario_hash: str = ""


def prepare(
    cases: Sequence[SweepCase],
    seeds: int,
    vehicle: Vehicle | None = None,
    progress: Progress = lambda done, doing: None,
) -> tuple[list[SweepJob], list[Task]]:
    """Plan every template once for each set of options, and list the runs: ``seeds`` of each case, with one vehicle.

    To a goal each run plans for itself, as its robot believes to stand elsewhere; here only its feasibility is checked.

    Args:
        cases: The combinations.
        seeds: Number of runs of each.
        vehicle: Vehicle of all runs; None: the shipped one.
        progress: Called with the fraction done and the present stage.

    Raises:
        SpecError: A template is invalid.
        PlanningError: A template cannot be planned.
    """
    jobs: dict[str, SweepJob] = {}
    vehicle = vehicle or Vehicle()
    tasks: list[Task] = []
    for index, case in enumerate(cases):
        begin = case.scenario.start if isinstance(case.work, PoseGoal) else ""
        key = f"{case.work!r} {begin!r} {case.options.model_dump_json()}"
        if key not in jobs:
            jobs[key] = _job(case, vehicle, progress)
        job = list(jobs).index(key)
        first = case.scenario.seed
        tasks += [
            Task(index, job, case.scenario.model_copy(update={"seed": seed}), case.config)
            for seed in range(first, first + seeds)
        ]
    return list(jobs.values()), tasks


def _job(case: SweepCase, vehicle: Vehicle, progress: Progress) -> SweepJob:
    if isinstance(case.work, str | Template):
        template = case.work if isinstance(case.work, Template) else load_template(case.work)
        return Job.prepare(template, case.options, vehicle, progress)
    if isinstance(case.work, TeamScenario):
        return TeamJob(case.work, RANDOM_FAULTS in case.setting)
    return GoalJob.prepare(case.work, case.options, vehicle, case.scenario.standing())


def perform(jobs: list[SweepJob], task: Task) -> SweepRun:
    """Simulate one task; a refusal by the robot becomes a failed result."""
    job = jobs[task.job]
    try:
        if isinstance(job, TeamJob):
            return _as_a_team(job, task)
        return _worked(job, task) if isinstance(job, Job) else _driven(job, task)
    except TouchlineError as error:
        return SweepRun(task.case, task.scenario.seed, False, str(error), {})


def lost_run(task: Task, why: str) -> SweepRun:
    """Return the failed run of a task whose process died."""
    return SweepRun(task.case, task.scenario.seed, False, why, {})


def _as_a_team(job: TeamJob, task: Task) -> SweepRun:
    done = job.drive(task.scenario)
    return SweepRun(task.case, task.scenario.seed, done["success"], done["reason"], swept_figures(done))


def _driven(job: GoalJob, task: Task) -> SweepRun:
    done = job.drive(task.scenario, task.config)
    report, cause = done.outcome.report, done.outcome.scenario_hash
    figures = {**arrival_run_figures(done), **drive_figures(report)}
    return SweepRun(task.case, task.scenario.seed, not done.problem, done.problem, figures, cause)


def _worked(job: Job, task: Task) -> SweepRun:
    outcome = simulate_job(job, Emulator(job.vehicle, task.scenario, task.config), Products())
    told, figures = outcome.figures(job), run_figures(outcome.report, outcome.area)
    return SweepRun(task.case, task.scenario.seed, told["success"], told["reason"], figures, told["hash"]["scenario"])


def run_figures(report: TraversalReport, area: AreaReport | None = None) -> dict[str, float]:
    """Return the main figures of a run, named as in its reports."""
    return {
        **(_paint_figures(report) if area is None else _area_figures(area)),
        "lateral_error_mean_m": report.lateral_error_mean_m,
        "lateral_error_p95_m": report.lateral_error_p95_m,
        "lateral_error_max_m": report.lateral_error_max_m,
        **drive_figures(report),
    }


def drive_figures(report: TraversalReport) -> dict[str, float]:
    """Return the figures that every drive has."""
    return {
        "position_rmse_m": report.position_rmse_m,
        "heading_rmse_rad": report.heading_rmse_rad,
        "total_time_s": report.total_time_s,
        "follower_fallbacks": float(report.follower_fallbacks),
    }


def _area_figures(area: AreaReport) -> dict[str, float]:
    return {
        "of_field_pct": area.coverage_pct,
        "of_reachable_pct": area.of_reachable_pct,
        "of_planned_pct": area.of_planned_pct,
        "missed_m2": area.missed_m2,
        "overlap_m2": area.overlap_m2,
        "body_outside_m": area.body_outside_m,
    }


def _paint_figures(report: TraversalReport) -> dict[str, float]:
    return {
        "coverage_pct": report.coverage_pct,
        "area_coverage_pct": report.area_coverage_pct,
        "within_tolerance_pct": report.within_tolerance_pct,
        "gap_m": report.gap_m,
        "overspray_m2": report.overspray_m2,
        "double_paint_m2": report.double_paint_m2,
    }
