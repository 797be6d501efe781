"""A template planned for several robots: shares, a plan for each, and the order where they meet."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.traffic.conflicts import TimedPath
from touchline.coordination.traffic.timetable import Delay, Timetable, timetable
from touchline.core.plain_sum import plain_sum
from touchline.jobs.shared.timed_path import timed_path
from touchline.jobs.single.reports import left_out_figures
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LeftOutStretch, PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.marking import REFUSE, leaves_out, lines_reached, nothing_reached
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plan_task import Company, PlanTask
from touchline.services.planner.sequencing.wet_paint import NO_LINES, Wheels
from touchline.services.planner.sharing.shares import Sharing, sharings
from touchline.services.planner.sharing.wet_between import Clocked, crossings_between, painted_rows_of
from touchline.services.planner.tour import UnreachableError, crossing_cost_s, drying_s

APART_M: Final = 0.5
"""Clearance between bodies."""
ASTRAY_M: Final = 0.1
"""Allowance for each robot's unknown distance from its path."""

PRICES_S: Final = (1.25, 3.0, 6.0)
"""Prices of crossing a wet line: a robot that finishes before the others has time to spare."""
FULL_SHARINGS, MANY_LINES = 3, 60
"""Sharings planned in full; for a template with more lines than the second number only one, because it takes long."""

Progress = Callable[[float, str], None]
Floats = NDArray[np.float64]
Start = tuple[float, float, float]


@dataclass(frozen=True)
class SharedJob:
    """Planned job of several robots of one kind.

    Attributes:
        template: The whole template.
        vehicle, options: Common to all robots.
        shares: For each robot, the template with its swaths only.
        plans: Plan of each robot.
        paths: The plans as the traffic rules see them.
        table: Timetable: who waits where for whom.
        wet_between: Number of times that a robot meets wet paint of another or of before, by plans and timetable.
        planning_time_s: Wall clock.
        covered_m2: Ground that all plans cover together.
        left_out: Stretches of lines that are obstructed.
    """

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    shares: tuple[Template, ...]
    plans: tuple[Plan, ...]
    paths: tuple[TimedPath, ...]
    table: Timetable
    wet_between: int
    planning_time_s: float = 0.0
    covered_m2: float = 0.0
    left_out: tuple[LeftOutStretch, ...] = ()

    @property
    def area_m2(self) -> float:
        """Total of the areas, which do not overlap, m²; 0 for lines."""
        return plain_sum(area.polygon.area for area in self.template.areas)

    @property
    def wet_crossings(self) -> int:
        """Number of times that a wheel or caster meets wet paint, its own robot's or another's."""
        return sum(each.report.wet_crossings for each in self.plans) + self.wet_between

    @property
    def cost_s(self) -> float:
        """Cost for comparing jobs: time of the last robot, and a price for wet crossings."""
        return self.table.end_s + crossing_cost_s(self.options) * self.wet_crossings

    def figures(self) -> dict[str, Any]:
        """Return the figures of all robots together."""
        return {
            "total_time_s": self.table.end_s,
            "wet_crossings": {"total": self.wet_crossings, "between_robots": self.wet_between},
            "waits": len(self.table.gates),
            **({"coverage_pct": 100.0 * self.covered_m2 / self.area_m2} if self.template.areas else {}),
            **({"left_out": left_out_figures(self.left_out)} if self.left_out else {}),
            "planning_time_s": self.planning_time_s,
        }


def share_reachable(
    template: Template, options: PlanOptions, vehicle: Vehicle, robots: int, progress: Progress
) -> SharedJob:
    """Plan the reachable part of a template for several robots that are placed where their plans begin.

    The job's template has the parts of obstructed lines as separate lines.

    Args:
        template: In the map frame.
        options: Planning options.
        vehicle: Vehicle of every robot.
        robots: Number of robots.
        progress: Called with the fraction done and the present stage.

    Raises:
        PlanningError: It cannot be shared or planned; the message gives reason and remedy.
    """
    begun = time.perf_counter()
    refuse_poses(options)
    if template.areas or not leaves_out(options):
        return share_job(template, options, vehicle, [None] * robots, progress)
    lines = lines_reached(PlanTask(template, vehicle, options), lambda stage, done: progress(0.0, f"Looking: {stage}"))
    while lines.segments:
        part = template.model_copy(update={"segments": lines.segments})
        try:
            job = share_job(part, options, vehicle, [None] * robots, progress)
        except UnreachableError as error:
            lines = lines.shortened(error.parts, error.segment_id)
        else:
            return replace(job, left_out=lines.left_out, planning_time_s=time.perf_counter() - begun)
    raise nothing_reached(lines)


def share_job(
    template: Template,
    options: PlanOptions,
    vehicle: Vehicle,
    starts: Sequence[Start | None],
    progress: Progress = lambda done, doing: None,
    painted: Floats = NO_LINES,
) -> SharedJob:
    """Plan a template for several robots.

    Args:
        template: In the map frame.
        options: Planning options.
        vehicle: Vehicle of every robot.
        starts: Pose of each robot: x (m), y (m), heading (rad); None: it is placed where its plan begins.
        progress: Called with the fraction done and the present stage.
        painted: (n, 7) rows of `sequencing.wet_paint`: lines already on the ground, painted at times below 0.

    Raises:
        PlanningError: It cannot be shared or planned; the message gives reason and remedy.
    """
    begun = time.perf_counter()
    refuse_poses(options)
    progress(0.0, "Sharing")
    task = PlanTask(template, vehicle, options, Company(painted))
    robots = len(starts)
    candidates = sharings(task, robots) if robots > 1 else [Sharing((template,), (0.0,), 0.0)]
    best, planned = None, 0
    problem: PlanningError | None = None
    for number, sharing in enumerate(candidates):
        report = partial(_report, progress, number / len(candidates), 1.0 / len(candidates))
        try:
            job = _best_of(_planned(task, _assigned(sharing, starts), starts, report))
        except PlanningError as error:
            problem = problem or error
            continue
        best, planned = _best_of((best, job)), planned + (job is not None)
        if planned == (FULL_SHARINGS if len(template.segments) <= MANY_LINES else 1):
            break
    if best is None:
        raise problem or no_order(robots)
    if options.hard_drying and best.wet_crossings:
        wet = f"cannot be shared among {robots} robots without driving over wet paint"
        raise PlanningError("", wet, "shorten the drying time, or let wet paint be crossed")
    return replace(best, planning_time_s=time.perf_counter() - begun)


def refuse_poses(options: PlanOptions) -> None:
    """Refuse a start or an end pose, because several robots would need one each.

    Raises:
        PlanningError: The options have one.
    """
    if len(options.start) or len(options.end):
        raise PlanningError("", "has a start or an end pose for several robots", "leave both out")


def no_order(robots: int) -> PlanningError:
    """Return the error for a template without a feasible timetable."""
    apart = f"cannot be shared among {robots} robots: in every order, one obstructs another for good"
    return PlanningError("", apart, "give fewer robots, or templates that lie apart")


def _report(progress: Progress, begun: float, part: float, stage: str, fraction: float) -> None:
    progress(begun + part * fraction, f"Planning shares: {stage}")


def _best_of(jobs: Iterable[SharedJob | None]) -> SharedJob | None:
    """Return the job with the lowest cost."""
    return min((job for job in jobs if job is not None), key=lambda job: job.cost_s, default=None)


def _assigned(sharing: Sharing, starts: Sequence[Start | None]) -> Sharing:
    """Return the same shares, each given to a robot that stands near it."""
    if not any(starts):
        return sharing
    from scipy.optimize import linear_sum_assignment  # here: it takes half a second

    off = np.zeros((len(starts), len(starts)))
    for robot, start in enumerate(starts):
        for number, share in enumerate(sharing.shares):
            ends = np.array([segment.curve().end[:2] for segment in share.segments])
            off[robot, number] = np.hypot(*(ends - start[:2]).T).min() if start is not None else 0.0
    chosen = linear_sum_assignment(off)[1].tolist()
    return replace(
        sharing, shares=tuple(sharing.shares[k] for k in chosen), seconds=tuple(sharing.seconds[k] for k in chosen)
    )


def _planned(
    task: PlanTask, sharing: Sharing, starts: Sequence[Start | None], progress: Callable[[str, float], None]
) -> Iterator[SharedJob | None]:
    """Yield the jobs of one sharing: at several prices of a wet crossing, then avoiding the others' wet paint."""
    # Shares are painted completely or refused: a part that one robot leaves out would not be painted at all.
    options = task.options.model_copy(update={"obstructed": REFUSE})
    asked = [options if at is None else options.model_copy(update={"start": np.array(at)}) for at in starts]

    def planned(robot: int, price_s: float, others: Sequence[Floats] = ()) -> Plan:
        company = Company(np.concatenate((task.company.painted, *others)), price_s)
        return plan(sharing.shares[robot], task.vehicle, asked[robot], progress, company=company)

    robots = range(len(starts))
    jobs = [_joined(task, sharing, [planned(k, price_s) for k in robots]) for price_s in PRICES_S]
    yield from jobs
    best = _best_of(jobs)
    price_s = next((price_s for price_s, job in zip(PRICES_S, jobs, strict=True) if job is best), 0.0)
    for robot in robots:
        if best is None or len(robots) < 2:
            return
        rows = [painted_rows_of(each) for k, each in enumerate(clocked(best)) if k != robot]
        plans = list(best.plans)
        plans[robot] = planned(robot, price_s, rows)
        job = _joined(task, sharing, plans)
        yield job
        best = _best_of((best, job))


def _joined(task: PlanTask, sharing: Sharing, plans: Sequence[Plan]) -> SharedJob | None:
    """Return the job of these plans; None if one robot obstructs another for good."""
    template, vehicle, options = task.template, task.vehicle, task.options
    paths = [timed_path(load_trajectory(each.trajectory, vehicle), vehicle) for each in plans]
    table = timetable(paths, APART_M + 2.0 * ASTRAY_M)
    if table is None:
        return None
    job = SharedJob(template, vehicle, options, sharing.shares, tuple(plans), tuple(paths), table, 0)
    wheels = Wheels.of(vehicle, template.line_width_m, drying_s(vehicle, options))
    between = crossings_between(clocked(job), wheels, task.company.painted)
    return replace(job, wet_between=between)


def clocked(job: SharedJob) -> list[Clocked]:
    """Return the plans with the timetable's times."""
    return [
        Clocked(each, partial(clock_s, path, late))
        for each, path, late in zip(job.plans, job.paths, job.table.delays, strict=True)
    ]


def clock_s(path: TimedPath, delays: tuple[Delay, ...], arc_m: Floats) -> Floats:
    """Return the times, s, at which a robot with these delays passes arc lengths (n,) of its path.

    Args:
        path: The robot's path.
        delays: Its delays in the timetable.
        arc_m: (n,) arc lengths.
    """
    from_m = np.array([each.from_m for each in delays])
    late_s = np.array([0.0, *(each.seconds for each in delays)])
    return np.asarray(np.interp(arc_m, path.arc_m, path.time_s) + late_s[np.searchsorted(from_m, arc_m, side="left")])
