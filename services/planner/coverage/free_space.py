"""Free space of a machine: inside the boundary and off obstacles, less a margin, for each heading."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area, buffer, intersection, union
from touchline.core.tool_reach import free_ground, headings_rad, places
from touchline.schemas.errors import PlanningError
from touchline.services.planner.collision.checker import first_touch
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.kernels.wall_clearance import Walls, edge_cells
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.coverage.swept_area import body_at
from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath

# Rounding of positions on a wall (m): the body may violate the margin by this much.
SLACK_M = 5e-4
# A body that begins to turn swings out: share of the margin that it may use in bends.
SWING_SHARE = 0.4
# Sampling (m) of a path when it is checked for contact.
TOUCH_STEP_M = 0.05
# Headings that differ by less (rad) are the same.
SAME_RAD = 1e-7
# A shorter stretch (m) does not count.
STRETCH_MIN_M = 1e-6


class FreeSpace:
    """Positions of the machine at which its body keeps the margin.

    Attributes:
        free: Ground less the margin, where the whole body has to be.
        machine: The machine.
        home: Connected part in which the middle of its tool stays; None: anywhere.
    """

    def __init__(
        self, boundary: shapely.Polygon, kept_out: Sequence[shapely.Polygon], machine: CoverageMachine, margin_m: float
    ) -> None:
        """Offset the outlines by the margin; their corners stay corners."""
        self.free = as_area(free_ground(boundary, kept_out, margin_m))
        self.machine = machine
        self._outlines = outlines = [boundary, *kept_out]
        self._edges = np.concatenate([_ring_edges(polygon.exterior) for polygon in outlines])
        self._owner = np.repeat(np.arange(len(outlines)), [len(p.exterior.coords) - 1 for p in outlines])
        self._margin_m, self._bends_m = margin_m, (1.0 - SWING_SHARE) * margin_m
        self.home: Area | None = None
        self._at: dict[int, Area] = {}
        self._room: dict[int, Area] = {}

    @property
    def swing_m(self) -> float:
        """Distance by which the body may swing out beside a wall (m)."""
        return self._margin_m - self._bends_m

    @cached_property
    def walls(self) -> Walls:
        """Walls in the form that kernels take."""
        body = np.array(self.machine.outline)
        cells = edge_cells(self._edges, self.machine.reach_m)
        return Walls(self._edges, self._owner, body, self._bends_m, self.machine.reach_m, cells)

    def settle(self, area: Area, start: PathPose | None = None) -> None:
        """Confine the machine to the connected part that holds most of an area, or its start pose.

        A start pose may be nearer to something than the margin; the margin in bends is reduced to that.

        Raises:
            PlanningError: The body touches something at the start pose.
        """
        if start is not None:
            self._stand_at(start)
        parts = shapely.get_parts(union([self.at(heading) for heading in headings_rad()]))
        if len(parts) > 1:
            if start is None:
                home = max(parts, key=lambda part: float(intersection(part, area).area))
            else:
                home = min(parts, key=lambda part: float(part.distance(shapely.Point(start[:2]))))
            self.home = as_area(home)
            self._at.clear()
            self._room.clear()

    def _stand_at(self, start: PathPose) -> None:
        boundary, *kept_out = self._outlines
        body = body_at(np.array([start]), self.machine)[0]
        ground = as_area(free_ground(boundary, kept_out))
        if not ground.contains_properly(body):
            at = f"x {start.x_m:.1f} m, y {start.y_m:.1f} m"
            problem = f"has a start pose ({at}) at which the body is out of the boundary or touches an obstacle"
            raise PlanningError("", problem, "move the machine to free ground")
        self._bends_m = min(self._bends_m, 0.5 * float(body.distance(ground.boundary)))

    def touched(self, path: PiecePath) -> bool:
        """True if the body violates the margin in bends anywhere along a path."""
        count = 2 + math.ceil(path.length_m / TOUCH_STEP_M)
        poses = np.column_stack(path.sample(np.linspace(0.0, path.length_m, count))[:3])
        poses = np.concatenate((poses, path.spun(TOUCH_STEP_M / self.machine.reach_m)))
        edges, owner, body, margin_m, *_ = self.walls
        return bool(first_touch(poses, edges, owner, True, body, margin_m - SLACK_M)[0] >= 0)

    def at(self, heading_rad: float) -> Area:
        """Area in which the middle of the tool may be at a heading."""
        key = _key(heading_rad)
        if key not in self._at:
            found = places(self.free, self.machine.outline, heading_rad)
            self._at[key] = as_area(found if self.home is None else intersection(found, self.home))
        return self._at[key]

    def stretches(self, pose: PathPose, ahead_m: float, behind_m: float) -> list[tuple[float, float]]:
        """Intervals (m, along the heading) of a straight through a pose on which the machine has room.

        Args:
            pose: Pose through which the straight leads (m, rad, map frame).
            ahead_m: Length of the straight ahead of the pose.
            behind_m: Length of the straight behind the pose.
        """
        direction = np.array((math.cos(pose.heading_rad), math.sin(pose.heading_rad)))
        line = shapely.LineString([np.array(pose[:2]) - behind_m * direction, np.array(pose[:2]) + ahead_m * direction])
        found = []
        for part in shapely.get_parts(intersection(self._room_at(pose.heading_rad), line)):
            points = shapely.get_coordinates(part)
            along = (points - np.array(pose[:2])) @ direction
            if len(points) > 1 and np.ptp(along) > STRETCH_MIN_M:
                found.append((float(along.min()), float(along.max())))
        return sorted(found)

    def _room_at(self, heading_rad: float) -> Area:
        """Area at a heading with its border, on which a line along a wall lies."""
        key = _key(heading_rad)
        if key not in self._room:
            self._room[key] = as_area(buffer(self.at(heading_rad), 0.5 * SLACK_M, join_style="mitre"))
        return self._room[key]


def _key(heading_rad: float) -> int:
    """Number of a heading, the same for headings that are the same but for rounding."""
    return round(math.remainder(heading_rad, math.tau) / SAME_RAD)


def _ring_edges(ring: shapely.LinearRing) -> Floats:
    corners = np.array(ring.coords)[:, :2]
    return np.hstack((corners[:-1], corners[1:]))
