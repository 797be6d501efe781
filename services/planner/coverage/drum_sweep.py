"""Exactly: what the tool passes over along a path, and by how much the body leaves where it may be."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.core.robust_overlay import buffer, difference, intersections, union
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.shapes import Area, as_area
from touchline.services.planner.geometry.clothoid import Floats, PiecePath

# Along bends the tool is looked at this often (m): between two places its ends are within a tenth of a millimetre.
STEP_M = 0.05
# The body is looked at this often (m), and the distance to the border is measured at one of so many places.
BODY_STEP_M, BLOCK = 0.05, 20


def swept(paths: Iterable[PiecePath], width_m: float) -> Area:
    """What a tool of this width passes over that lies across the middle of its paths."""
    passes = [single for path in paths for single in _passes(path, width_m)]
    return as_area(union(passes)) if passes else shapely.Polygon()


def swept_twice(paths: Iterable[PiecePath], width_m: float) -> Area:
    """What a tool of this width passes over more than once, each piece of a path counted as one pass."""
    passes = np.array([single for path in paths for single in _passes(path, width_m)], dtype=object)
    first, second = shapely.STRtree(passes).query(passes, predicate="intersects")
    apart = first < second
    return as_area(union(intersections(passes[first[apart]], passes[second[apart]])))


def _passes(path: PiecePath, width_m: float) -> list[Area]:
    """What the tool passes over on each piece of a path that is not a point."""
    sides = [_sides(part, width_m) for part in _parts(path)]
    if not sides:
        return []
    corners = [np.concatenate((left, right[::-1])) for left, right in sides]
    ring_of = np.repeat(np.arange(len(corners)), [len(each) for each in corners])
    bands = np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(corners), indices=ring_of)))
    plain = np.asarray(shapely.is_valid(bands))
    return [band if fine else _folded(*each) for band, fine, each in zip(bands, plain, sides, strict=True)]


def _sides(part: PiecePath, width_m: float) -> tuple[Floats, Floats]:
    """(n, 2) places of the tool's left and right end along a path of one piece."""
    (piece,) = part.pieces
    bent = piece.curvature_1pm != 0.0 or piece.sharpness_1pm2 != 0.0
    count = 1 + math.ceil(piece.length_m / STEP_M) if bent else 2
    x, y, heading, _ = part.sample(np.linspace(0.0, piece.length_m, count))
    across = 0.5 * width_m * np.column_stack((-np.sin(heading), np.cos(heading)))
    middle = np.column_stack((x, y))
    return middle + across, middle - across


def _folded(left: Floats, right: Floats) -> Area:
    """What lies between the ends of a tool that turns about a place within its width, or over its own track."""
    shapes = np.asarray(shapely.polygons(np.stack((left[:-1], left[1:], right[1:], right[:-1]), axis=1)))
    # A quad that is folded is two triangles.
    folded = ~shapely.is_valid(shapes)
    shapes[folded] = [buffer(shape, 0.0) for shape in shapes[folded]]
    return as_area(union(shapes))


def _parts(path: PiecePath) -> Iterator[PiecePath]:
    """Its pieces that are not points, each a path."""
    for piece, start in zip(path.pieces, path.knots, strict=False):
        if piece.length_m > 0.0:
            yield PiecePath(start, (piece,))


def body_outside_m(paths: Iterable[PiecePath], machine: CoverageMachine, free: Area) -> float:
    """How far the body's corners and sides get out of the free area at most (m); negative: how far it keeps inside."""
    shapely.prepare(free)
    border = shapely.boundary(free)
    shapely.prepare(border)
    worst = -math.inf
    for path in paths:
        count = 2 + math.ceil(path.length_m / BODY_STEP_M)
        spun = path.spun(BODY_STEP_M / machine.reach_m)
        poses = np.column_stack(path.sample(np.linspace(0.0, path.length_m, count))[:3])
        poses, count = np.concatenate((poses, spun)), count + len(spun)
        # Where no part of the body comes nearer to the border than another already did, nobody needs to look.
        block = np.repeat(np.arange(0, count, BLOCK), BLOCK)[:count]
        within_m = np.hypot(*(poses[:, :2] - poses[block, :2]).T)
        middles = np.asarray(shapely.points(poses[::BLOCK, :2]))
        free_there = shapely.contains_properly(free, middles)[block // BLOCK]
        spare = shapely.distance(middles, border)[block // BLOCK] - within_m - machine.reach_m
        bodies = body_at(poses[~((spare > -worst) & free_there)], machine)
        inside = shapely.contains_properly(free, bodies)
        if inside.any():
            worst = max(worst, -float(shapely.distance(bodies[inside], border).min()))
        for body in bodies[~inside]:
            worst = max(worst, _out_m(body, free))
    return worst


def _out_m(body: shapely.Polygon, free: Area) -> float:
    """How far a body is out of the free area; what pokes into it, such as a post, is so far inside it."""
    out = difference(body, free)
    if out.is_empty:
        return 0.0
    corners = shapely.points(shapely.get_coordinates(out))
    return max(float(shapely.distance(corners, free).max()), _depth(body, free))


def _depth(body: shapely.Polygon, free: Area) -> float:
    corners = np.asarray(shapely.points(shapely.get_coordinates(free)))
    inside = corners[shapely.contains_properly(body, corners)]
    return float(shapely.distance(inside, body.exterior).max()) if len(inside) else 0.0


def body_at(poses: Floats, machine: CoverageMachine) -> NDArray[np.object_]:
    """The body as a polygon at each of the poses (n, 3)."""
    corners = np.array(machine.outline) @ np.array([[1.0], [1.0j]])
    turned = poses[:, 0, None] + 1j * poses[:, 1, None] + np.exp(1j * poses[:, 2, None]) * corners[:, 0]
    return np.asarray(shapely.polygons(np.stack((turned.real, turned.imag), axis=-1)))
