"""Area method `zigzag`: the path of a roller over a field as in the published study, as a baseline.

Lanes lie W/η apart (η: passes over each place). At the end of a lane the machine changes to the next one by an S of
two arcs at full steering, β to one side and β back, in its direction of travel; there it reverses, and drives the next
lane in the opposite direction. The study steers by a costmap, sampled at the tool alone: 0 inside, rising towards the
edge ahead. Its rim is as wide as the S is long, so that the cost exceeds `pausing` where an S just fits, and `stopping`
only beyond the edge. The body behind the tool is ignored, and the arcs meet with a step in curvature: both are the
study's, and stand in the route's remarks.
"""

import cmath
import math
from dataclasses import dataclass

import shapely

from touchline.core.robust_overlay import intersection
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece
from touchline.services.planner.coverage.shapes import turned
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

# Rounding of lengths (m).
ROUNDING_M = 1e-9
REMARKS = (
    "the body is ignored: only the tool keeps inside the field",
    "curvature steps within a change of lane: the machine would have to stand to steer",
)


@dataclass(frozen=True)
class ZigzagOptions:
    """The study's figures.

    Attributes:
        overlapping: Passes over each place.
        pausing: A lane ends where the cost ahead exceeds this.
        stopping: Maximum cost at the end of a slide.
        stopping_bound_m: A lane nearer than this to the far edge is the last one.
    """

    overlapping: float = 1.0
    pausing: float = 2.0
    stopping: float = 50.0
    stopping_bound_m: float = 1.5


def slide_angle(apart_m: float, curvature_1pm: float) -> float:
    """Turning angle β (rad) of an S at full steering that changes to a lane at a distance.

    Raises:
        PlanningError: Lanes are further apart than two turning circles.
    """
    if apart_m * curvature_1pm > 4.0:
        problem = f"has lanes {apart_m:g} m apart, more than two turning circles ({4.0 / curvature_1pm:.2f} m)"
        raise PlanningError("", problem, "steer further or roll each place more often")
    # 1 − cos β = 2·sin²(β/2), which is exact for a small β too.
    return 2.0 * math.asin(0.5 * math.sqrt(apart_m * curvature_1pm))


def zigzag(
    area: shapely.Polygon, machine: CoverageMachine, options: ZigzagOptions | None = None, angle_rad: float = 0.0
) -> CoverageRoute:
    """Plan the study's route over an area, from its upper left corner as seen along the lanes.

    Args:
        area: Polygon (m, map frame); a lane that meets a hole ends there, and what lies behind it is missed.
        machine: Machine that covers it.
        options: The study's own by default.
        angle_rad: Direction of the first lane, counter-clockwise from +x of the map frame.

    Raises:
        PlanningError: The machine cannot reverse, the lanes are too far apart, or there is no room for a lane.
    """
    options = options or ZigzagOptions()
    if not machine.can_reverse:
        raise PlanningError("", "cannot be planned by zigzag forward only", "use another method, or let it reverse")
    apart, radius = machine.width_m / options.overlapping, 1.0 / machine.curvature_max_1pm
    beta = slide_angle(apart, machine.curvature_max_1pm)
    rim = _Rim(2.0 * radius * math.sin(beta), options)
    field = shapely.transform(area, lambda points: turned(points, -angle_rad))
    pieces: list[DrivePiece] = []
    _, low, _, high = field.bounds
    # Half a width inside, or half a lane where lanes overlap more than once.
    y, direction = high - 0.5 * apart, 1
    x = min((first for first, _ in _stretches(field, y)), default=0.0)
    while True:
        ahead = _end_ahead(field, x, y, direction)
        straight = rim.pause_m(direction * (ahead - x))
        slid = x + direction * (straight + rim.slide_m), y - apart
        last = y - low < options.stopping_bound_m or rim.cost(_margin(field, *slid)) > options.stopping
        name = f"lane {len(pieces) // 2 + 1}"
        if last:
            straight = direction * (ahead - x)
        if straight <= ROUNDING_M:
            break
        pose = _in_map(x, y, angle_rad)
        lane = PiecePath(pose, (Piece(straight, direction=direction),))
        pieces.append(DrivePiece(DriveKind.LANE, name, lane, worked=True))
        if last:
            break
        # Slide to the lower side in either direction: the first bend turns the direction of travel there.
        bend = Piece(beta * radius, -machine.curvature_max_1pm, direction=direction)
        slide = PiecePath(lane.end, (bend, bend.mirrored()))
        pieces.append(DrivePiece(DriveKind.TURN, f"{name}, change", slide, worked=False))
        (x, y), direction = slid, -direction
    if not pieces:
        raise PlanningError("", "has no room for a lane of zigzag", "turn the lanes or use another method")
    return CoverageRoute(tuple(pieces), area, REMARKS)


@dataclass(frozen=True)
class _Rim:
    """Rim of the costmap, as wide (m) as a change of lane is long."""

    slide_m: float
    options: ZigzagOptions

    def cost(self, inside_m: float) -> float:
        """Cost at a distance before the edge ahead: `pausing` at the rim, `stopping` at the edge, 100 beyond."""
        if inside_m < -ROUNDING_M:
            return 100.0
        ratio = self.options.pausing / self.options.stopping
        return float(self.options.stopping * ratio ** (inside_m / self.slide_m))

    def pause_m(self, ahead_m: float) -> float:
        """Distance to drive until the cost exceeds `pausing`."""
        return ahead_m - self.slide_m


def _stretches(field: shapely.Polygon, y: float) -> list[tuple[float, float]]:
    """Intervals (m) of a line along x inside the field, ascending."""
    left, _, right, _ = field.bounds
    inside = shapely.get_parts(intersection(field, shapely.LineString([(left, y), (right, y)])))
    return sorted((part.bounds[0], part.bounds[2]) for part in inside if part.length > ROUNDING_M)


def _end_ahead(field: shapely.Polygon, x: float, y: float, direction: int) -> float:
    """Position (m) at which a ray along x first leaves the field; `x` itself if it begins outside."""
    for first, last in _stretches(field, y):
        if first - ROUNDING_M <= x <= last + ROUNDING_M:
            return last if direction > 0 else first
    return x


def _margin(field: shapely.Polygon, x: float, y: float) -> float:
    """Signed distance of a point from the field's border (m): positive inside."""
    place = shapely.Point(x, y)
    distance = float(shapely.distance(place, field.boundary))
    return distance if field.covers(place) or distance < ROUNDING_M else -distance


def _in_map(x: float, y: float, angle_rad: float) -> PathPose:
    z = complex(x, y) * cmath.rect(1.0, angle_rad)
    return PathPose(z.real, z.imag, angle_rad)
