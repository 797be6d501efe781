"""Areas planned for several robots that cover them: parts, a plan for each, and who goes first where they meet."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment

from touchline.schemas.errors import PlanningError
from touchline.services.fleet.traffic.timetable import timetable
from touchline.services.onboard.trajectory.trajectory import load_trajectory
from touchline.services.planner.coverage.lanes import lane_angle
from touchline.services.planner.coverage.shapes import as_area
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plan_task import Company, PlanTask
from touchline.services.planner.sharing.ground_parts import Grounds, cut, directions, share_template, size_m2
from touchline.services.planner.sharing.swept_plans import swept_by
from touchline.services.runs.sharing.shared_job import APART_M, ASTRAY_M, SharedJob, Start
from touchline.services.runs.sharing.timed_path import timed_path

MISSED_S_PER_M2: Final = 4.0
"""What a missed square metre is worth when ways to share are compared, as when lanes are joined."""
SHARE_PCT: Final = 99.7
"""Of what can be reached of each part; where the options do not say how much."""
TURNS: Final = 4
"""Laps may begin with the side in any of so many directions."""
WAITS_SHARE: Final = 0.02
"""Where robots wait for each other for no larger share of the time, laps need not begin elsewhere."""
EVEN_SHARE: Final = 0.03
"""Times of robots that differ by no larger share are even."""


class Parted(NamedTuple):
    """A way to share that was planned."""

    job: SharedJob
    shares: tuple[float, ...]
    angle_rad: float

    @property
    def cost_s(self) -> float:
        """By which ways are compared: when all are done, and what they miss."""
        job = self.job
        missed_m2 = sum(area.polygon.area for area in job.template.areas) - (job.covered_m2 or 0.0)
        return job.table.end_s + MISSED_S_PER_M2 * missed_m2


def share_ground(
    task: PlanTask, grounds: Grounds, starts: Sequence[Start | None], progress: Callable[[float, str], None]
) -> SharedJob:
    """Plan areas for several robots that are alike.

    Args:
        task: What is to be planned.
        grounds: What of each area is to be covered.
        starts: Of each robot, where it stands; None: it is carried to where its plan begins.
        progress: Told the fraction done, and what is being done.

    Raises:
        PlanningError: It cannot be shared or planned; it says why and what to do.
    """
    return _GroundSharing(task, grounds, starts, progress).best()


class _GroundSharing:
    """See `share_ground`."""

    def __init__(
        self, task: PlanTask, grounds: Grounds, starts: Sequence[Start | None], progress: Callable[[float, str], None]
    ) -> None:
        self.task, self.grounds, self.starts, self._progress = task, grounds, starts, progress
        options = task.options
        if not options.coverage_pct:
            options = options.model_copy(update={"coverage_pct": SHARE_PCT})
        self.asked = [options if at is None else options.model_copy(update={"start": np.array(at)}) for at in starts]
        self._overlap_m, self._width_m = options.overlap_m, task.vehicle.tool.width_m
        whole = as_area(shapely.union_all(list(grounds.values())))
        angle = options.swath_angle_deg.tolist() or [
            area.angle_deg for area in task.template.areas if area.id in grounds
        ]
        pitch_m = self._width_m - self._overlap_m
        self.angle_rad = lane_angle(whole, pitch_m) if angle[0] is None else math.radians(angle[0])
        self._problem: PlanningError | None = None
        self._done = 0

    def best(self) -> SharedJob:
        """The best of all ways."""
        robots = len(self.starts)
        even = (1.0 / robots,) * robots
        angles = directions(self.angle_rad) if robots > 1 else (self.angle_rad,)
        ways = [way for angle in angles for way in self._ways(even, angle)]
        best = min(ways, key=lambda way: way.cost_s, default=None)
        if best is not None and robots > 1:
            seconds = np.array([made.report.total_time_s for made in best.job.plans])
            if np.ptp(seconds) > EVEN_SHARE * seconds.max():
                shares = np.array(best.shares) / seconds
                again = self._ways(tuple((shares / shares.sum()).tolist()), best.angle_rad)
                best = min((best, *again), key=lambda way: way.cost_s)
        if best is None:
            apart = (
                f"cannot be shared among {robots} robots: however that is tried, one stands in another's way for good"
            )
            raise self._problem or PlanningError("", apart, "give fewer robots, or areas that lie apart")
        return best.job

    def _ways(self, shares: tuple[float, ...], angle_rad: float) -> Iterator[Parted]:
        """Laps begun in one direction after another, until nobody waits for long."""
        try:
            parts = self._parts(shares, angle_rad)
            for turn in range(TURNS if len(shares) > 1 else 1):
                begins_rad = angle_rad + (turn + 2) * math.tau / TURNS if len(shares) > 1 else None
                job = self._planned(parts, begins_rad)
                if job is None:
                    continue
                yield Parted(job, shares, angle_rad)
                if max(job.table.waits_s) <= WAITS_SHARE * job.table.end_s:
                    return
        except PlanningError as problem:
            self._problem = self._problem or problem

    def _parts(self, shares: tuple[float, ...], angle_rad: float) -> list[Grounds]:
        """Of each robot, the part near to which it stands."""
        parts = cut(self.grounds, shares, angle_rad, self._overlap_m, 0.5 * self._width_m)
        if not all(parts):
            size = f"{size_m2(self.grounds):.0f} m² to cover, too little for {len(shares)} robots"
            raise PlanningError("", f"has {size}", "give fewer robots")
        off = np.zeros((len(parts), len(parts)))
        for robot, start in enumerate(self.starts):
            if start is not None:
                off[robot] = [
                    min(shapely.distance(shapely.Point(start[:2]), ground) for ground in part.values())
                    for part in parts
                ]
        return [parts[k] for k in linear_sum_assignment(off)[1].tolist()]

    def _planned(self, parts: Sequence[Grounds], begins_rad: float | None) -> SharedJob | None:
        plans = [
            plan(
                self.task.template,
                self.task.vehicle,
                asked,
                partial(self._tell, robot),
                company=Company(grounds=part, begins_rad=begins_rad),
            )
            for robot, (part, asked) in enumerate(zip(parts, self.asked, strict=True))
        ]
        self._done += 1
        return self._joined(parts, plans)

    def _tell(self, robot: int, stage: str, fraction: float) -> None:
        done = self._done + (robot + fraction) / len(self.starts)
        self._progress(1.0 - 1.0 / (1.0 + 0.5 * done), f"Planning parts: {stage}")

    def _joined(self, parts: Sequence[Grounds], plans: Sequence[Plan]) -> SharedJob | None:
        """The job of these plans; None if one robot stands in another's way for good."""
        template, vehicle = self.task.template, self.task.vehicle
        paths = [timed_path(load_trajectory(each.trajectory, vehicle), vehicle) for each in plans]
        table = timetable(paths, APART_M + 2.0 * ASTRAY_M)
        if table is None:
            return None
        shares = tuple(share_template(template, part) for part in parts)
        whole = shapely.union_all([area.polygon for area in template.areas])
        covered = shapely.union_all([swept_by(each, self._width_m) for each in plans]).intersection(whole)
        return SharedJob(
            template, vehicle, self.task.options, shares, tuple(plans), tuple(paths), table, 0, covered_m2=covered.area
        )
