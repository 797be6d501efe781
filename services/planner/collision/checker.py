"""Collision checks of the swept body along a path, against a boundary and obstacles."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.polygons import apart_squared, off_squared, within
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath

# Half the maximum motion (m) of any point of the body between checked poses. The body is enlarged by as much all round,
# so that no contact in between is missed.
MARGIN_M = 0.02
# Poses in a row for which the edges near them are chosen at once.
RUN = 32

Complexes = NDArray[np.complex128]


class Collision(NamedTuple):
    """Contact of the body with an outline: pose, and id of the outline."""

    pose: PathPose
    outline: str

    def __str__(self) -> str:
        return f'"{self.outline}" near ({self.pose.x_m:.2f}, {self.pose.y_m:.2f})'


@dataclass(frozen=True)
class CollisionChecker:
    """Collision checks of a vehicle's body against the boundary and the obstacles of a template.

    Attributes:
        edges: (n, 4) edges of the outlines x₁ y₁ x₂ y₂, m.
        owner: (n,) outline of each edge, as an index of `names`.
        names: Ids of the outlines; the boundary, if there is one, comes first.
        bounded: Whether there is a boundary.
        body: (k, 2) corners of the body.
    """

    edges: Floats
    owner: Ints
    names: tuple[str, ...]
    bounded: bool
    body: Floats

    @classmethod
    def of(cls, template: Template, vehicle: Vehicle) -> "CollisionChecker | None":
        """Checker for a template's boundary and obstacles; None if it has none."""
        outlines = [*([template.boundary] if template.boundary else []), *template.obstacles]
        if not outlines:
            return None
        corners = [np.array(outline.corners) for outline in outlines]
        edges = np.concatenate([np.hstack((c, np.roll(c, -1, axis=0))) for c in corners])
        owner = np.repeat(np.arange(len(outlines)), [len(c) for c in corners])
        names = tuple(outline.id for outline in outlines)
        return cls(edges, owner, names, template.boundary is not None, np.array(vehicle.body.footprint_m))

    @property
    def reach_m(self) -> float:
        """Distance of the body's furthest corner from the axle's middle (m)."""
        return float(np.hypot(*self.body.T).max())

    def collision(self, path: PiecePath) -> Collision | None:
        """First collision on a path: the body touches an outline, or is on its wrong side."""
        poses = self._poses(path)
        at, outline = first_touch(poses, self.edges, self.owner, self.bounded, self.body, MARGIN_M)
        return Collision(PathPose(*poses[at].tolist()), self.names[outline]) if at >= 0 else None

    def touches(self, poses: Sequence[PathPose]) -> bool:
        """True if the body touches an outline, or is on its wrong side, at any of the poses."""
        at, _ = first_touch(np.array(poses), self.edges, self.owner, self.bounded, self.body, MARGIN_M)
        return bool(at >= 0)

    def is_clear(self, path: PiecePath) -> bool:
        """True if the body keeps off all outlines; the ends of pieces, where most contacts are, are checked first."""
        return not self.touches(path.knots) and self.collision(path) is None

    def _poses(self, path: PiecePath) -> Floats:
        """Poses (n, 3) so close that no point of the body moves by more than 2·MARGIN_M from one to the next."""
        arcs: list[Floats] = [np.zeros(0)]
        turns: list[Floats] = [np.zeros(0)]
        for piece, start in zip(path.pieces, path.stations, strict=False):
            if piece.spin_rad:
                count = 2 + math.ceil(abs(piece.spin_rad) * self.reach_m / (2.0 * MARGIN_M))
                arcs.append(np.full(count, start))
                turns.append(np.linspace(-piece.spin_rad, 0.0, count))  # a sample there has turned already
            if piece.length_m:
                bend = max(abs(piece.curvature_1pm), abs(piece.curvature_end_1pm))
                count = 1 + math.ceil(abs(piece.length_m) * (1.0 + bend * self.reach_m) / (2.0 * MARGIN_M))
                arcs.append(np.linspace(start, start + piece.length_m, count, endpoint=False))
                turns.append(np.zeros(count))
        x, y, heading, _ = path.sample(np.concatenate(arcs))
        return np.vstack((np.column_stack((x, y, heading + np.concatenate(turns))), path.end))


@kernel
def first_touch(
    poses: Floats, edges: Floats, owner: Ints, bounded: bool, body: Floats, margin: float
) -> tuple[int, int]:
    """Find the first pose at which the body is nearer than `margin` to an edge.

    At the first pose it must also be inside the boundary, and no obstacle inside the body.

    Args:
        poses: (n, 3) x (m), y (m), heading (rad) of the middle of the axle.
        edges: (edges, 4) x₁ y₁ x₂ y₂, m, outline by outline.
        owner: (edges,) outline of each edge.
        bounded: Whether outline 0 is a boundary.
        body: (corners, 2) in the body's frame, m.
        margin: Clearance (m).

    Returns:
        Index of the pose and number of the outline; −1 if there is none.
    """
    reach = 0.0
    for k in range(len(body)):
        reach = max(reach, math.hypot(body[k, 0], body[k, 1]))
    corners, near, count = np.empty(len(body) + 1, np.complex128), np.empty(len(edges), np.int64), 0
    for p in range(len(poses)):
        if p % RUN == 0:
            count = _choose_near(poses[p : p + RUN], edges, reach + margin, near)
        _place(poses[p], body, corners)
        middle = complex(poses[p, 0], poses[p, 1])
        outline = _touched(middle, corners, edges, owner, near[:count], reach + margin, margin)
        if outline < 0 and p == 0:
            outline = _wrong_side(complex(poses[p, 0], poses[p, 1]), corners, edges, owner, bounded)
        if outline >= 0:
            return p, outline
    return -1, -1


@kernel
def _choose_near(poses: Floats, edges: Floats, far: float, near: Ints) -> int:
    """Write the numbers of the edges that may be within `far` of one of the poses, in order; return how many."""
    # Numba's `min` of a column needs a part of Numba, without which no code can be kept.
    west, south, east, north, count = math.inf, math.inf, -math.inf, -math.inf, 0
    for p in range(len(poses)):
        west, south = min(west, poses[p, 0] - far), min(south, poses[p, 1] - far)
        east, north = max(east, poses[p, 0] + far), max(north, poses[p, 1] + far)
    for e in range(len(edges)):
        x, y, other_x, other_y = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        beside = max(x, other_x) < west or min(x, other_x) > east
        if not beside and max(y, other_y) >= south and min(y, other_y) <= north:
            near[count] = e
            count += 1
    return count


@kernel
def _place(pose: Floats, body: Floats, corners: Complexes) -> None:
    """Write the body's corners at a pose, the first one repeated at the end."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for k in range(len(corners)):
        x, y = body[k % len(body), 0], body[k % len(body), 1]
        corners[k] = complex(pose[0] + c * x - s * y, pose[1] + s * x + c * y)


@kernel
def _touched(
    middle: complex, corners: Complexes, edges: Floats, owner: Ints, near: Ints, far: float, margin: float
) -> int:
    """First outline nearer to the body than `margin`, −1 if there is none, of the edges `near`; `far` skips most."""
    for e in near:
        a, b = complex(edges[e, 0], edges[e, 1]), complex(edges[e, 2], edges[e, 3])
        if off_squared(middle, a, b) > far**2:
            continue
        for k in range(len(corners) - 1):
            if apart_squared(corners[k], corners[k + 1], a, b) < margin * margin:
                return int(owner[e])
    return -1


@kernel
def _wrong_side(middle: complex, corners: Complexes, edges: Floats, owner: Ints, bounded: bool) -> int:
    """First outline violated as a whole: body outside the boundary, or around or inside an obstacle; −1: none."""
    outline = np.empty((len(corners) - 1, 4))
    for k in range(len(outline)):
        outline[k, 0], outline[k, 1] = corners[k].real, corners[k].imag
        outline[k, 2], outline[k, 3] = corners[k + 1].real, corners[k + 1].imag
    first = 0
    for e in range(len(edges)):
        if e + 1 < len(edges) and owner[e + 1] == owner[e]:
            continue
        ring = edges[first : e + 1]
        first = e + 1
        inside, boundary = within(middle, ring), bounded and owner[e] == 0
        if boundary and not inside:
            return int(owner[e])
        if not boundary and (inside or within(complex(ring[0, 0], ring[0, 1]), outline)):
            return int(owner[e])
    return -1
