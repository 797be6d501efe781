"""Areas planned for several covering robots: parts, a plan for each, and the order where they meet."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import shapely

from touchline.coordination.traffic.timetable import timetable
from touchline.core.robust_overlay import as_area, intersection, union
from touchline.jobs.shared.shared_job import (
    APART_M,
    ASTRAY_M,
    Progress,
    SharedJob,
    Start,
    no_order,
    refuse_poses,
)
from touchline.jobs.shared.timed_path import timed_path
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.lanes import lane_angle
from touchline.services.planner.coverage.swept_area import swept
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plan_task import Company, PlanTask
from touchline.services.planner.sharing.ground_parts import (
    Grounds,
    directions,
    parts_in,
    share_template,
    size_m2,
    strips,
)

MISSED_S_PER_M2: Final = 4.0
"""Cost of a missed square metre in the comparison of partitions, as when lanes are joined."""
SHARE_PCT: Final = 99.7
"""Coverage of the reachable ground of each part, percent, where the options give none."""
TURNS: Final = 4
"""Number of directions in which laps may begin."""
WAITS_SHARE: Final = 0.02
"""Share of the time for which robots may wait without laps being begun elsewhere."""
EVEN_SHARE: Final = 0.03
"""Largest relative difference of the robots' times that counts as even."""


class AreaPartition(NamedTuple):
    """Planned partition of the areas.

    Attributes:
        job: None if one robot obstructs another for good.
        least_s: Cost if no robot waited.
        shares, angle_rad: Shares and direction of the parts.
        turn: Index of the side with which laps begin.
        parts: Part number of each robot.
    """

    job: SharedJob | None
    least_s: float
    shares: tuple[float, ...]
    angle_rad: float
    turn: int
    parts: tuple[int, ...]

    @property
    def cost_s(self) -> float:
        """Cost for comparing partitions: time of the last robot, and what they miss."""
        if self.job is None:
            return math.inf
        return self.job.table.end_s + MISSED_S_PER_M2 * (self.job.area_m2 - self.job.covered_m2)

    @property
    def waits(self) -> bool:
        """True if robots wait so long that laps should begin elsewhere."""
        return self.job is None or max(self.job.table.waits_s) > WAITS_SHARE * self.job.table.end_s


def share_areas(
    template: Template,
    options: PlanOptions,
    vehicle: Vehicle,
    starts: Sequence[Start | None],
    progress: Progress = lambda done, doing: None,
    remaining: Grounds | None = None,
) -> SharedJob:
    """Plan a template's areas for several robots, or for one that does the remaining work.

    Args:
        template: In the map frame.
        options: Planning options.
        vehicle: Vehicle of every robot; its tool covers.
        starts: Pose of each robot: x (m), y (m), heading (rad); None: it is placed where its plan begins.
        progress: Called with the fraction done and the present stage.
        remaining: By area id, the ground to be covered (m, map frame); None: all of every area.

    Raises:
        PlanningError: It cannot be shared or planned; the message gives reason and remedy.
    """
    begun = time.perf_counter()
    refuse_poses(options)
    if not template.areas:
        raise PlanningError("", "has no area", f"give {vehicle.name} a template with an area to cover")
    if template.segments:
        problem = f'has the line "{template.segments[0].id}" beside its areas, and robots share areas alone'
        raise PlanningError("", problem, "leave the lines out, or leave out --robots")
    job = _AreaSharing(PlanTask(template, vehicle, options, Company(remaining=remaining)), starts, progress).best()
    return replace(job, planning_time_s=time.perf_counter() - begun)


class _AreaSharing:
    """Search for the best partition; see `share_areas`."""

    def __init__(self, task: PlanTask, starts: Sequence[Start | None], progress: Progress) -> None:
        self.task, self.starts, self.robots, self._progress = task, starts, len(starts), progress
        self._areas: Grounds = {area.id: area.polygon for area in task.template.areas}
        self.grounds = task.company.remaining or self._areas
        options = task.options
        self._asked = options if options.coverage_pct else options.model_copy(update={"coverage_pct": SHARE_PCT})
        self._overlap_m, self._width_m = options.overlap_m, task.vehicle.tool.width_m
        whole = as_area(union(list(self.grounds.values())))
        angle = options.swath_angle_deg.tolist() or [area.angle_deg for area in task.template.areas]
        pitch_m = self._width_m - self._overlap_m
        self.angle_rad = lane_angle(whole, pitch_m) if angle[0] is None else math.radians(angle[0])
        self._problem: PlanningError | None = None
        self._done, self._reported = 0, 0.0

    def best(self) -> SharedJob:
        """Return the best job of all partitions.

        A partition in which robots wait for each other is tried with laps that begin elsewhere, unless it would be no
        better than another one even without waiting.
        """
        even = (1.0 / self.robots,) * self.robots
        angles = directions(self.angle_rad) if self.robots > 1 else (self.angle_rad,)
        begun = [self._partition(even, angle, 0) for angle in angles]
        firsts = sorted((each for each in begun if each is not None), key=lambda each: each.least_s)
        best = min(firsts, key=lambda each: each.cost_s, default=None)
        for first in firsts:
            partition: AreaPartition | None = first
            for turn in range(1, TURNS):
                if partition is None or best is None or not partition.waits or first.least_s >= best.cost_s:
                    break
                partition = self._partition(even, first.angle_rad, turn)
                best = _better(best, partition)
        if best is None or best.job is None:
            raise self._problem or no_order(self.robots)
        seconds = np.zeros(self.robots)
        seconds[list(best.parts)] = [made.report.total_time_s for made in best.job.plans]
        if np.ptp(seconds) > EVEN_SHARE * seconds.max():
            shares = np.array(best.shares) / seconds
            again = self._partition(tuple((shares / shares.sum()).tolist()), best.angle_rad, best.turn)
            if again is not None and again.job is not None and again.cost_s < best.cost_s:
                return again.job
        return best.job

    def _partition(self, shares: tuple[float, ...], angle_rad: float, turn: int) -> AreaPartition | None:
        """Plan a partition with laps that begin in one direction; None if a part cannot be planned."""
        try:
            cut_up = self._parts(shares, angle_rad)
            of_robots = self._nearest(cut_up)
            parts = [cut_up[k] for k in of_robots]
            plans = self._plans(parts, angle_rad + (turn + 2) * math.tau / TURNS)
        except PlanningError as problem:
            self._problem = self._problem or problem
            return None
        self._done += 1
        whole = union(list(self.grounds.values()))
        covered = swept([section.path for each in plans for section in each.sections], self._width_m)
        covered_m2 = float(intersection(covered, whole).area)
        least_s = max(made.report.total_time_s for made in plans) + MISSED_S_PER_M2 * (whole.area - covered_m2)
        return AreaPartition(self._job(parts, plans, covered_m2), least_s, shares, angle_rad, turn, of_robots)

    def _parts(self, shares: tuple[float, ...], angle_rad: float) -> list[Company]:
        """Return the parts, a strip each; ground that is already covered does not change the straights."""
        cuts = strips(self.grounds, shares, angle_rad, self._overlap_m)
        half_m, remaining = 0.5 * self._width_m, self.task.company.remaining
        parts = [parts_in(self.grounds, strip, 0.0 if remaining else half_m) for strip in cuts]
        if not all(parts):
            size = f"{size_m2(self.grounds):.0f} m² to cover, too little for {self.robots} robots"
            raise PlanningError("", f"has {size}", "give fewer robots")
        if remaining is None:
            return [Company(grounds=part) for part in parts]
        return [
            Company(grounds=parts_in({name: self._areas[name] for name in part}, strip, 0.0), remaining=part)
            for part, strip in zip(parts, cuts, strict=True)
        ]

    def _nearest(self, parts: Sequence[Company]) -> tuple[int, ...]:
        """Return the part for each robot, near to where it stands; in order if they are placed."""
        if not any(self.starts):
            return tuple(range(len(parts)))
        from scipy.optimize import linear_sum_assignment  # here: it takes half a second

        places = [None if at is None else shapely.Point(at[:2]) for at in self.starts]
        off_m = [
            [0.0 if place is None else min(each.distance(place) for each in _ground(part).values()) for part in parts]
            for place in places
        ]
        return tuple(linear_sum_assignment(off_m)[1].tolist())

    def _plans(self, parts: Sequence[Company], begins_rad: float) -> list[Plan]:
        """Return a plan for each part."""
        return [
            plan(
                self.task.template,
                self.task.vehicle,
                self._asked if at is None else self._asked.model_copy(update={"start": np.array(at)}),
                partial(self._report, robot),
                company=replace(part, begins_rad=begins_rad),
            )
            for robot, (part, at) in enumerate(zip(parts, self.starts, strict=True))
        ]

    def _job(self, parts: Sequence[Company], plans: Sequence[Plan], covered_m2: float) -> SharedJob | None:
        """Return the job of these plans; None if one robot obstructs another for good."""
        template, vehicle = self.task.template, self.task.vehicle
        paths = [timed_path(load_trajectory(each.trajectory, vehicle), vehicle) for each in plans]
        table = timetable(paths, APART_M + 2.0 * ASTRAY_M)
        if table is None:
            return None
        shares = tuple(share_template(template, _ground(part)) for part in parts)
        return SharedJob(
            template,
            vehicle,
            self.task.options,
            shares,
            tuple(plans),
            tuple(paths),
            table,
            0,
            covered_m2=covered_m2,
        )

    def _report(self, robot: int, stage: str, fraction: float) -> None:
        done = self._done + (robot + fraction) / self.robots
        self._reported = max(self._reported, 1.0 - 1.0 / (1.0 + 0.5 * done))
        self._progress(self._reported, f"Planning parts: {stage}, partition {self._done + 1}, robot {robot + 1}")


def _ground(part: Company) -> Grounds:
    """Return the ground that a robot is to cover."""
    return part.remaining or part.grounds or {}


def _better(one: AreaPartition, other: AreaPartition | None) -> AreaPartition:
    """Return the one with the lower cost."""
    return one if other is None or one.cost_s <= other.cost_s else other
