"""Ground of a shared job that is left, and its plan."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Self

import shapely
from shapely.geometry.base import BaseGeometry

from touchline.core.robust_overlay import buffer, difference, intersection, union
from touchline.core.tool_reach import free_ground, reachable
from touchline.jobs.shared.errand import ErrandStatus
from touchline.jobs.shared.left_work import Floats, LeftWork, Progress, round_standing
from touchline.jobs.shared.remains import Standing
from touchline.jobs.shared.shared_areas import share_areas
from touchline.jobs.shared.shared_job import APART_M, ASTRAY_M, SharedJob
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.drum_sweep import swept
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.coverage.shapes import as_area
from touchline.services.planner.plan_task import PlanTask
from touchline.services.planner.sharing.ground_parts import Grounds, size_m2, wide_parts
from touchline.services.robot_sim.accounting.planned_way import planned_way
from touchline.services.robot_sim.accounting.swept_ground import swept_ground

HAIR_M: Final = 0.2
"""What is narrower comes of rounding, of tools that are a little beside their way, and of what joints overlap."""
STRAIGHT_M: Final = 0.02
"""Edges along bends become straights that are so near to them."""
MITRE: Final = 2.0
"""Corners stay corners up to so many times the distance."""
SLIVER_M2: Final = 1.0
"""Pieces that are smaller are left out if they are nowhere half as wide as the tool: they lie where turns meet."""


@dataclass(frozen=True)
class GroundLeft(LeftWork):
    """Pieces of areas.

    Attributes:
        grounds: By their ids, what of each (m, map frame); of an area that is not named, nothing.
        given_up: What is left besides, and not planned.
    """

    grounds: Grounds = field(default_factory=dict)
    given_up: Grounds = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self.grounds)

    def __str__(self) -> str:
        """Their size."""
        return f"{size_m2(self.grounds):.1f} m²"

    @property
    def figures(self) -> dict[str, Any]:
        """Their size."""
        return {"left_out_m2": float(size_m2(self.grounds))}

    @property
    def names(self) -> list[str]:
        """How much of which areas."""
        return [f"{ground.area:.0f} m² of {name}" for name, ground in self.grounds.items()]

    def joined(self, job: SharedJob, told: Sequence[ErrandStatus]) -> Self:
        """This, and what robots have not driven over, by their plans up to where they believe to be.

        It overlaps what they have driven over as neighbouring lanes do.
        """
        driven = union([_swept(each, job) for each in told])
        shares = [area.polygon for each in told for area in each.errand.share.areas]
        found = dict[str, Ground]()
        for area in job.template.areas:
            before = self.grounds.get(area.id, shapely.Polygon())
            left = as_area(intersection(difference(union([before, *shares]), driven), area.polygon))
            found[area.id] = as_area(intersection(_pieces(left, job, job.options.overlap_m), area.polygon))
        return type(self)(_some(found))

    def with_ever_less(self) -> Iterator[Self]:
        """As of any work that is left: without the smallest, which may be a strip that nothing can be driven along."""
        by_size = sorted(self.grounds, key=lambda name: self.grounds[name].area)
        for fewer in range(1, len(by_size)):
            out = {name: self.grounds[name] for name in by_size[:fewer]}
            yield replace(self, grounds={name: self.grounds[name] for name in by_size[fewer:]}, given_up=out)

    def planned(
        self,
        job: SharedJob,
        crew: Sequence[Standing],
        standing: Sequence[Standing],
        painted: Floats,
        progress: Progress,
    ) -> tuple[SharedJob, Self]:
        """As of any work that is left; pieces of which nothing can be reached are left out from the first."""
        template = round_standing(job.template, job.vehicle, standing)
        task = PlanTask(template, job.vehicle, job.options)
        tasks = {area.id: CoverageTask.of(task, area) for area in template.areas}
        clear = _some({name: _within_reach(ground, tasks[name]) for name, ground in self.grounds.items()})
        if not clear:
            raise PlanningError("", "has nothing left that can be reached", "move the robots that stand there")
        made = share_areas(template, job.options, job.vehicle, [each.pose for each in crew], progress, clear)
        covered = swept([section.path for each in made.plans for section in each.sections], job.vehicle.tool.width_m)
        beside = union([_near(each, job) for each in standing])
        left = {
            name: _those_at(beside, _pieces(as_area(difference(ground, covered)), job))
            for name, ground in self.grounds.items()
        }
        return made, type(self)(_some({**left, **self.given_up}))


def _swept(told: ErrandStatus, job: SharedJob) -> Ground:
    """What a robot has driven over."""
    return as_area(swept_ground(planned_way(told.driven, job.vehicle)).swept)


def _pieces(ground: Ground, job: SharedJob, wider_m: float = 0.0) -> Ground:
    """The pieces that are worth their time, hairs left out, wider all round by so much."""
    opened = buffer(ground, -0.5 * HAIR_M, join_style="mitre", mitre_limit=MITRE)
    whole = shapely.simplify(buffer(opened, 0.5 * HAIR_M, join_style="mitre", mitre_limit=MITRE), STRAIGHT_M)
    wide = wide_parts(as_area(whole), 0.5 * job.vehicle.tool.width_m)
    large = [part for part in shapely.get_parts(whole) if part.area >= SLIVER_M2]
    return as_area(buffer(union([wide, *large]), wider_m, join_style="mitre", mitre_limit=MITRE))


def _near(standing: Standing, job: SharedJob) -> Ground:
    """Where a body that keeps off a robot that stands there may be in its way."""
    corners = standing.outline(job.vehicle, APART_M + ASTRAY_M).corners
    reach_m = max(math.hypot(*corner) for corner in job.vehicle.body.footprint_m)
    return as_area(buffer(shapely.Polygon(corners), reach_m))


def _those_at(place: BaseGeometry, ground: Ground) -> Ground:
    """The pieces of some ground that lie at a place."""
    return shapely.MultiPolygon([part for part in shapely.get_parts(ground) if part.intersects(place)])


def _within_reach(ground: Ground, task: CoverageTask) -> Ground:
    """The pieces of some ground of which the tool can reach enough to be worth it."""
    machine, free = task.machine, free_ground(task.boundary, task.obstacles, task.margin_m)
    at = as_area(reachable(ground, free, machine.outline, (0.0, 0.0), machine.width_m))
    kept = [part for part in shapely.get_parts(ground) if intersection(part, at).area >= SLIVER_M2]
    return shapely.MultiPolygon(kept)


def _some(grounds: Mapping[str, Ground]) -> Grounds:
    """Without what is empty."""
    return {name: ground for name, ground in grounds.items() if not ground.is_empty}
