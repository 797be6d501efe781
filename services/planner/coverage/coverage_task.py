"""Task of a coverage method."""

import math
from dataclasses import dataclass, replace

import shapely

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Area, Template
from touchline.services.planner.coverage.coverage_machine import CoverageMachine, machine_of
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.plan_task import PlanTask

# Coverage by default (% of the reachable area): what costs little.
CHEAP_PCT = 99.0


@dataclass(frozen=True)
class CoverageTask:
    """One area, where the body may be, and how to cover it.

    Attributes:
        area: Area to cover (m, map frame); where robots share one, this robot's part, which may be in pieces.
        boundary: Polygon that the body does not leave (m, map frame): the template's, else the area's outline.
        obstacles: Polygons that the body keeps off (m, map frame): the template's, and the holes of all its areas.
        machine: Machine that covers it.
        forward_only: Whether it shall not reverse.
        overlap_m: Minimum overlap of neighbouring lanes.
        margin_m: Minimum clearance of the body from boundary and obstacles; a body that begins to turn may use some.
        laps: Number of laps along the outline, one inside the other; None: one.
        swath_angle_deg: Direction of the lanes, counter-clockwise from +x; None: the best one.
        coverage_pct: Coverage of the reachable area up to which missed patches are touched up.
        begins_rad: Direction of the side with which laps begin (rad); None: the best one.
        start: Pose of the machine (m, rad, map frame); None: it is placed where the route begins.
        remaining: Part of it that is still to be covered; None: all of it.
    """

    area: Ground
    boundary: shapely.Polygon
    obstacles: tuple[shapely.Polygon, ...]
    machine: CoverageMachine
    forward_only: bool = False
    overlap_m: float = 0.03
    margin_m: float = 0.05
    laps: int | None = None
    swath_angle_deg: float | None = None
    coverage_pct: float = CHEAP_PCT
    begins_rad: float | None = None
    start: PathPose | None = None
    remaining: Ground | None = None

    @property
    def wanted(self) -> Ground:
        """Ground to cover: the area, or its remaining part."""
        return self.area if self.remaining is None else self.remaining

    @classmethod
    def of(cls, task: PlanTask, area: Area) -> "CoverageTask":
        """Task for one area of a template, without a start pose.

        Raises:
            PlanningError: An option is out of its range, or is not for coverage methods.
        """
        options, machine = task.options, machine_of(task.vehicle, task.limits)
        if options.forward_only:
            machine = replace(machine, spin_lever_m=math.inf)
        _check(options, machine.width_m)
        angle = options.swath_angle_deg.tolist() or [area.angle_deg]
        grounds, remaining = task.company.grounds, task.company.remaining
        return cls(
            area.polygon if grounds is None else grounds[area.id],
            _outline(task.template, area),
            _kept_out(task.template),
            machine,
            options.forward_only or not task.vehicle.drive.can_reverse,
            options.overlap_m,
            options.margin_m,
            options.laps if options.laps >= 0 else None,
            angle[0],
            options.coverage_pct or CHEAP_PCT,
            task.company.begins_rad,
            remaining=None if remaining is None else remaining[area.id],
        )


def _outline(template: Template, area: Area) -> shapely.Polygon:
    return shapely.Polygon(template.boundary.corners) if template.boundary else shapely.Polygon(area.outline)


def _kept_out(template: Template) -> tuple[shapely.Polygon, ...]:
    """Obstacles and holes; an obstacle that fills a hole counts once."""
    holes = (hole for area in template.areas for hole in area.holes)
    outlines = (*(obstacle.corners for obstacle in template.obstacles), *holes)
    return tuple(dict.fromkeys(shapely.Polygon(corners) for corners in outlines))


def _check(options: PlanOptions, width_m: float) -> None:
    asked = (
        ("overlap_m", options.overlap_m, 0.0, 0.9 * width_m, "m"),
        ("margin_m", options.margin_m, 0.0, 10.0, "m"),
        ("laps", options.laps, -1, 100, "laps"),
        ("coverage_pct", options.coverage_pct, 0.0, 100.0, "%"),
        *(("swath_angle_deg", angle, -360.0, 360.0, "degrees") for angle in options.swath_angle_deg.tolist()),
    )
    for name, given in (
        ("an end pose", len(options.end)),
        ("to return to its start", options.return_to_start),
        ("the given order", options.order == "given"),
    ):
        if given:
            raise PlanningError("", f"asks for {name}, and a coverage method chooses that itself", "leave it out")
    for name, value, low, high, unit in asked:
        if not low <= value <= high:
            raise PlanningError("", f"has {name} = {value:g}", f"give {low:g} to {high:g} {unit}")
