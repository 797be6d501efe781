"""Where the machine may be: inside the boundary and off what is kept out, less a margin, heading by heading."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import shapely

from touchline.core.robust_overlay import buffer, intersection, union
from touchline.core.tool_reach import free_ground, headings_rad, places
from touchline.schemas.errors import PlanningError
from touchline.services.planner.collision.checker import first_touch
from touchline.services.planner.coverage.drum_sweep import body_at
from touchline.services.planner.coverage.kernels.body_room import Walls
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.shapes import Area, as_area
from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath

# Rounding of places on a wall (m): the body may be nearer by this than the margin.
SLACK_M = 5e-4
# A body that begins to turn swings out: in bends it may use up so much of the margin.
SWING_SHARE = 0.4
# A way is looked at this often (m) before it is taken.
TOUCH_STEP_M = 0.05
# Headings that differ by less (rad) are one.
SAME_RAD = 1e-7
# What is shorter (m) is no stretch.
HAIR_M = 1e-6


class FreeSpace:
    """Places of the machine at which its body keeps the margin.

    Attributes:
        free: Where any of the body may be, the margin taken off.
        machine: The machine.
        home: Where the middle of its tool stays; None: anywhere.
    """

    def __init__(
        self, boundary: shapely.Polygon, kept_out: Sequence[shapely.Polygon], machine: CoverageMachine, margin_m: float
    ) -> None:
        """Corners of what is kept out stay corners, a margin further out."""
        self.free = as_area(free_ground(boundary, kept_out, margin_m))
        self.machine = machine
        self._outlines = outlines = [boundary, *kept_out]
        self._edges = np.concatenate([_ring_edges(polygon.exterior) for polygon in outlines])
        self._owner = np.repeat(np.arange(len(outlines)), [len(p.exterior.coords) - 1 for p in outlines])
        self._margin_m, self._bends_m = margin_m, (1.0 - SWING_SHARE) * margin_m
        self.home: Area | None = None
        self._at: dict[int, Area] = {}

    @property
    def swing_m(self) -> float:
        """How far the body may swing out beside a wall that it keeps the margin from."""
        return self._margin_m - self._bends_m

    @cached_property
    def walls(self) -> Walls:
        """As the kernels take it."""
        body = np.array(self.machine.outline)
        return Walls(self._edges, self._owner, body, self._bends_m, self.machine.reach_m)

    def settle(self, area: Area, start: PathPose | None = None) -> None:
        """Stay where most of an area is, or where the machine stands, be that nearer to something than in bends.

        Between the parts that hang together at any heading there is no way.

        Raises:
            PlanningError: The body touches something where it stands.
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

    def _stand_at(self, start: PathPose) -> None:
        boundary, *kept_out = self._outlines
        body = body_at(np.array([start]), self.machine)[0]
        ground = as_area(free_ground(boundary, kept_out))
        if not ground.contains_properly(body):
            at = f"x {start.x_m:.1f} m, y {start.y_m:.1f} m"
            problem = f"has a start pose ({at}) at which the body is out of the boundary or touches an obstacle"
            raise PlanningError("", problem, "have the machine stand free")
        self._bends_m = min(self._bends_m, 0.5 * float(body.distance(ground.boundary)))

    def touched(self, path: PiecePath) -> bool:
        """Whether the body gets nearer to anything than it may in bends."""
        count = 2 + math.ceil(path.length_m / TOUCH_STEP_M)
        poses = np.column_stack(path.sample(np.linspace(0.0, path.length_m, count))[:3])
        poses = np.concatenate((poses, path.spun(TOUCH_STEP_M / self.machine.reach_m)))
        edges, owner, body, margin_m, _ = self.walls
        return bool(first_touch(poses, edges, owner, True, body, margin_m - SLACK_M)[0] >= 0)

    def at(self, heading_rad: float) -> Area:
        """Where the middle of the tool may be at a heading."""
        key = round(math.remainder(heading_rad, math.tau) / SAME_RAD)
        if key not in self._at:
            found = places(self.free, self.machine.outline, heading_rad)
            self._at[key] = as_area(found if self.home is None else intersection(found, self.home))
        return self._at[key]

    def stretches(self, pose: PathPose, ahead_m: float, behind_m: float) -> list[tuple[float, float]]:
        """From where to where (m, along the heading) the machine may stand on a straight through a pose."""
        direction = np.array((math.cos(pose.heading_rad), math.sin(pose.heading_rad)))
        line = shapely.LineString([np.array(pose[:2]) - behind_m * direction, np.array(pose[:2]) + ahead_m * direction])
        # A line along a wall lies on the border of where it may be: that border belongs to it.
        room = buffer(self.at(pose.heading_rad), 0.5 * SLACK_M, join_style="mitre")
        found = []
        for part in shapely.get_parts(intersection(room, line)):
            points = shapely.get_coordinates(part)
            along = (points - np.array(pose[:2])) @ direction
            if len(points) > 1 and np.ptp(along) > HAIR_M:
                found.append((float(along.min()), float(along.max())))
        return sorted(found)


def _ring_edges(ring: shapely.LinearRing) -> Floats:
    corners = np.array(ring.coords)[:, :2]
    return np.hstack((corners[:-1], corners[1:]))
