"""Remaining ground of a shared job, and its plan."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import shapely
from shapely.geometry.base import BaseGeometry

from touchline.core.ground_pieces import pieces_within_reach, worthwhile_pieces
from touchline.core.robust_overlay import as_area, buffer, difference, intersection, union
from touchline.core.tool_reach import free_ground
from touchline.jobs.shared.assignment import AssignmentStatus
from touchline.jobs.shared.remaining_work import Floats, Progress, RemainingWork, round_standing
from touchline.jobs.shared.shared_areas import share_areas
from touchline.jobs.shared.shared_job import APART_M, ASTRAY_M, SharedJob
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.coverage.swept_area import swept
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.sharing.ground_parts import Grounds, size_m2
from touchline.services.robot_sim.accounting.planned_tool_path import planned_tool_path
from touchline.services.robot_sim.accounting.swept_ground import swept_ground


@dataclass(frozen=True)
class RemainingGround(RemainingWork):
    """Remaining pieces of areas.

    Attributes:
        grounds: Remaining ground by area id (m, map frame); a missing id means nothing remains.
        skipped: Further remaining pieces, not planned.
    """

    grounds: Grounds = field(default_factory=dict)
    skipped: Grounds = field(default_factory=dict)

    def __bool__(self) -> bool:
        """True if any ground remains."""
        return bool(self.grounds)

    def __str__(self) -> str:
        """Return the size as text."""
        return f"{size_m2(self.grounds):.1f} m²"

    @property
    def figures(self) -> dict[str, Any]:
        """Size as a figure of a report."""
        return {"left_out_m2": float(size_m2(self.grounds))}

    @property
    def names(self) -> list[str]:
        """Size of the remaining ground of each area, as text."""
        return [f"{ground.area:.0f} m² of {name}" for name, ground in self.grounds.items()]

    def joined(self, job: SharedJob, statuses: Sequence[AssignmentStatus]) -> Self:
        """Add the ground that robots have not driven over, by their plans up to their estimated places.

        It overlaps driven ground as neighbouring lanes do.

        Args:
            job: The job of the robots.
            statuses: Status of each of their assignments.
        """
        driven = union([_swept(each, job) for each in statuses])
        shares = [area.polygon for each in statuses for area in each.assignment.share.areas]
        found = dict[str, Ground]()
        for area in job.template.areas:
            before = self.grounds.get(area.id, shapely.Polygon())
            remaining = as_area(intersection(difference(union([before, *shares]), driven), area.polygon))
            pieces = worthwhile_pieces(remaining, job.vehicle.tool.width_m, job.options.overlap_m)
            found[area.id] = as_area(intersection(pieces, area.polygon))
        return type(self)(_some(found))

    def with_ever_less(self) -> Iterator[Self]:
        """Yield the pieces with ever fewer of the small ones, which may be strips that no path fits in."""
        by_size = sorted(self.grounds, key=lambda name: self.grounds[name].area)
        for fewer in range(1, len(by_size)):
            out = {name: self.grounds[name] for name in by_size[:fewer]}
            yield replace(self, grounds={name: self.grounds[name] for name in by_size[fewer:]}, skipped=out)

    def planned(
        self,
        job: SharedJob,
        crew: Sequence[Standing],
        standing: Sequence[Standing],
        painted: Floats,
        progress: Progress,
    ) -> tuple[SharedJob, Self]:
        """See `RemainingWork.planned`; pieces that the tool cannot reach are left out from the start."""
        template = round_standing(job.template, job.vehicle, standing)
        task = PlanTask(template, job.vehicle, job.options)
        tasks = {area.id: CoverageTask.of(task, area) for area in template.areas}
        clear = _some({name: _within_reach(ground, tasks[name]) for name, ground in self.grounds.items()})
        if not clear:
            raise PlanningError("", "has no remaining work within reach", "move the robots that stand there")
        made = share_areas(template, job.options, job.vehicle, [each.pose for each in crew], progress, clear)
        covered = swept([section.path for each in made.plans for section in each.sections], job.vehicle.tool.width_m)
        beside = union([_near(each, job) for each in standing])
        remaining = {
            name: _those_at(beside, worthwhile_pieces(as_area(difference(ground, covered)), job.vehicle.tool.width_m))
            for name, ground in self.grounds.items()
        }
        return made, type(self)(_some({**remaining, **self.skipped}))


def _swept(status: AssignmentStatus, job: SharedJob) -> Ground:
    """Return the ground that a robot has driven over."""
    return as_area(swept_ground(planned_tool_path(status.driven, job.vehicle)).swept)


def _near(standing: Standing, job: SharedJob) -> Ground:
    """Return the ground in which a standing robot could obstruct another's body."""
    corners = standing.outline(job.vehicle, APART_M + ASTRAY_M).corners
    reach_m = max(math.hypot(*corner) for corner in job.vehicle.body.footprint_m)
    return as_area(buffer(shapely.Polygon(corners), reach_m))


def _those_at(place: BaseGeometry, ground: Ground) -> Ground:
    """Return the pieces of ground that lie at a place."""
    return shapely.MultiPolygon([part for part in shapely.get_parts(ground) if part.intersects(place)])


def _within_reach(ground: Ground, task: CoverageTask) -> Ground:
    """Return the pieces of ground of which the tool can reach a worthwhile part."""
    machine, free = task.machine, free_ground(task.boundary, task.obstacles, task.margin_m)
    return pieces_within_reach(ground, free, machine.outline, (0.0, 0.0), machine.width_m)


def _some(grounds: Mapping[str, Ground]) -> Grounds:
    """Return the grounds that are not empty."""
    return {name: ground for name, ground in grounds.items() if not ground.is_empty}
