"""Collision checks of the swept body along a path, against a boundary and obstacles."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath

# Between two poses that are looked at no point of the body moves further than twice this (m); the body is taken to be
# larger by as much all round, so that nothing is missed in between.
MARGIN_M = 0.02


class Collision(NamedTuple):
    """Where the body touches which outline."""

    pose: PathPose
    outline: str

    def __str__(self) -> str:
        return f'"{self.outline}" near ({self.pose.x_m:.2f}, {self.pose.y_m:.2f})'


@dataclass(frozen=True)
class CollisionChecker:
    """The outlines of a template, and the body that keeps off them.

    Attributes:
        edges: (n, 4) the outlines' edges x₁ y₁ x₂ y₂, m.
        owner: (n,) the outline that each edge belongs to, as an index of `names`.
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
        """The checker for a template's boundary and obstacles; None if it has none."""
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
        """The distance of the body's furthest corner from the axle's middle, metres."""
        return float(np.hypot(*self.body.T).max())

    def collision(self, path: PiecePath) -> Collision | None:
        """The first place where the body on `path` touches an outline, or is on its wrong side."""
        poses = self._poses(path)
        at, outline = first_touch(poses, self.edges, self.owner, self.bounded, self.body, MARGIN_M)
        return Collision(PathPose(*poses[at].tolist()), self.names[outline]) if at >= 0 else None

    def _poses(self, path: PiecePath) -> Floats:
        """(n, 3) poses so close that no point of the body moves more than 2·MARGIN_M from one to the next."""
        poses: list[Floats] = []
        for piece, start, knot in zip(path.pieces, path.stations, path.knots, strict=False):
            if piece.spin_rad:
                count = 2 + math.ceil(abs(piece.spin_rad) * self.reach_m / (2.0 * MARGIN_M))
                heading = knot.heading_rad + np.linspace(0.0, piece.spin_rad, count)
                poses.append(np.column_stack((np.full(count, knot.x_m), np.full(count, knot.y_m), heading)))
            if piece.length_m:
                bend = max(abs(piece.curvature_1pm), abs(piece.curvature_end_1pm))
                count = 2 + math.ceil(piece.length_m * (1.0 + bend * self.reach_m) / (2.0 * MARGIN_M))
                x, y, heading, _ = path.sample(start + np.linspace(0.0, piece.length_m, count)[:-1])
                poses.append(np.column_stack((x, y, heading)))
        poses.append(np.array([path.end]))
        return np.concatenate(poses)


@kernel
def _apart(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> float:
    """The least squared distance between segments AB and CD."""
    ux, uy, vx, vy, wx, wy = bx - ax, by - ay, dx - cx, dy - cy, cx - ax, cy - ay
    cross = ux * vy - uy * vx
    if cross != 0.0:
        s, t = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    least = min(_off(ax, ay, cx, cy, dx, dy), _off(bx, by, cx, cy, dx, dy))
    return float(min(least, _off(cx, cy, ax, ay, bx, by), _off(dx, dy, ax, ay, bx, by)))


@kernel
def _off(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """The squared distance of P from segment AB."""
    ux, uy = bx - ax, by - ay
    square = ux * ux + uy * uy
    share = ((px - ax) * ux + (py - ay) * uy) / square if square > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    x, y = px - ax - share * ux, py - ay - share * uy
    return x * x + y * y


@kernel
def _within(px: float, py: float, edges: Floats) -> bool:
    """Whether P is inside the closed outline."""
    inside = False
    for e in range(len(edges)):
        ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        if (ay > py) != (by > py) and px < ax + (py - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside


@kernel
def first_touch(
    poses: Floats, edges: Floats, owner: Ints, bounded: bool, body: Floats, margin: float
) -> tuple[int, int]:
    """The first pose at which the body is nearer than `margin` to an edge, and the outline; −1 if there is none.

    At the first pose it must also be inside the boundary, and no obstacle inside the body.
    """
    count = len(body)
    reach = 0.0
    for k in range(count):
        reach = max(reach, math.hypot(body[k, 0], body[k, 1]))
    x, y = np.empty(count + 1), np.empty(count + 1)
    outline = np.empty((count, 4))
    for p in range(len(poses)):
        c, s = math.cos(poses[p, 2]), math.sin(poses[p, 2])
        for k in range(count + 1):
            bx, by = body[k % count, 0], body[k % count, 1]
            x[k], y[k] = poses[p, 0] + c * bx - s * by, poses[p, 1] + s * bx + c * by
        for e in range(len(edges)):
            ax, ay, bx, by = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
            if _off(poses[p, 0], poses[p, 1], ax, ay, bx, by) > (reach + margin) ** 2:
                continue
            for k in range(count):
                if _apart(x[k], y[k], x[k + 1], y[k + 1], ax, ay, bx, by) < margin * margin:
                    return p, owner[e]
        if p == 0:
            for k in range(count):
                outline[k] = np.array([x[k], y[k], x[k + 1], y[k + 1]])
            first = 0
            for e in range(len(edges)):
                if e + 1 == len(edges) or owner[e + 1] != owner[e]:
                    ring = edges[first : e + 1]
                    within = _within(poses[p, 0], poses[p, 1], ring)
                    if bounded and owner[e] == 0:
                        if not within:
                            return p, owner[e]
                    elif within or _within(ring[0, 0], ring[0, 1], outline):
                        return p, owner[e]
                    first = e + 1
    return -1, -1
