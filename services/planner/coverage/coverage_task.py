"""What a coverage method is asked to cover."""

import math
from dataclasses import dataclass, replace

import shapely

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Area, Template
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.machine_of import machine_of
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.plan_task import PlanTask

# Where nobody says how much shall be covered: what is cheap (% of what can be reached).
CHEAP_PCT = 99.0


@dataclass(frozen=True)
class CoverageTask:
    """One area, where the body may be, and how to cover it.

    Attributes:
        area: To be covered (m, map frame); of one that robots share, the part of this one, which may be in pieces.
        boundary: That the body does not leave (m, map frame); without one of the template, the area's own outline.
        obstacles: That the body keeps off (m, map frame): the template's, and the holes of all of its areas.
        machine: That covers it.
        forward_only: Whether it shall not reverse.
        overlap_m: Least overlap of neighbouring lanes.
        margin_m: Least distance of the body from boundary and obstacles; a body that begins to turn may use up some.
        laps: Along the outline, one inside the other; None: one.
        swath_angle_deg: Direction of the lanes, counter-clockwise from +x; None: which suits best.
        coverage_pct: What is missed is touched up until so much of what can be reached is covered.
        begins_rad: Direction of the side with which laps begin (rad); None: whichever suits best.
        start: Where the machine stands before (m, rad, map frame); None: it is carried to where the route begins.
        left: What of it is left to be covered, as the rest has been before; None: all of it.
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
    left: Ground | None = None

    @property
    def wanted(self) -> Ground:
        """What of the area is to be covered."""
        return self.area if self.left is None else self.left

    @classmethod
    def of(cls, task: PlanTask, area: Area) -> "CoverageTask":
        """One area of a template, for a machine that is carried to where its route begins.

        Raises:
            PlanningError: An option is out of its range; it names the option.
        """
        options, machine = task.options, machine_of(task.vehicle, task.limits)
        if options.forward_only:
            machine = replace(machine, spin_lever_m=math.inf)
        _check(options, machine.width_m)
        angle = options.swath_angle_deg.tolist() or [area.angle_deg]
        grounds, left = task.company.grounds, task.company.left
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
            left=None if left is None else left[area.id],
        )


def _outline(template: Template, area: Area) -> shapely.Polygon:
    return shapely.Polygon(template.boundary.corners) if template.boundary else shapely.Polygon(area.outline)


def _kept_out(template: Template) -> tuple[shapely.Polygon, ...]:
    """What stands in a hole is often an obstacle besides: each outline once."""
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
