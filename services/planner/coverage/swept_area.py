"""Exact geometry of a driven path: area swept by the tool, and excess of the body beyond the free ground."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.core.robust_overlay import as_area, buffer, difference, intersections, union
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.geometry.clothoid import Floats, PiecePath

# Sampling of the tool along bends (m): the chord error of its ends is below a tenth of a millimetre.
STEP_M = 0.05
# Sampling of the body (m); the distance to the border is measured at one of BLOCK samples.
BODY_STEP_M, BLOCK = 0.05, 20


def swept(paths: Iterable[PiecePath], width_m: float) -> Area:
    """Area swept by a tool of this width, centred on the paths."""
    passes = [single for path in paths for single in _passes(path, width_m)]
    return as_area(union(passes)) if passes else shapely.Polygon()


def swept_twice(paths: Iterable[PiecePath], width_m: float) -> Area:
    """Area that the tool sweeps more than once, each piece of a path counted as one pass."""
    passes = np.array([single for path in paths for single in _passes(path, width_m)], dtype=object)
    first, second = shapely.STRtree(passes).query(passes, predicate="intersects")
    apart = first < second
    return as_area(union(intersections(passes[first[apart]], passes[second[apart]])))


def _passes(path: PiecePath, width_m: float) -> list[Area]:
    """Area swept along each piece of a path that has a length."""
    sides = [_sides(part, width_m) for part in _parts(path)]
    if not sides:
        return []
    corners = [np.concatenate((left, right[::-1])) for left, right in sides]
    ring_of = np.repeat(np.arange(len(corners)), [len(each) for each in corners])
    bands = np.asarray(shapely.polygons(shapely.linearrings(np.concatenate(corners), indices=ring_of)))
    plain = np.asarray(shapely.is_valid(bands))
    return [band if fine else _folded(*each) for band, fine, each in zip(bands, plain, sides, strict=True)]


def _sides(part: PiecePath, width_m: float) -> tuple[Floats, Floats]:
    """Positions (n, 2) of the tool's left and right end along a path of one piece."""
    (piece,) = part.pieces
    bent = piece.curvature_1pm != 0.0 or piece.sharpness_1pm2 != 0.0
    count = 1 + math.ceil(piece.length_m / STEP_M) if bent else 2
    x, y, heading, _ = part.sample(np.linspace(0.0, piece.length_m, count))
    across = 0.5 * width_m * np.column_stack((-np.sin(heading), np.cos(heading)))
    middle = np.column_stack((x, y))
    return middle + across, middle - across


def _folded(left: Floats, right: Floats) -> Area:
    """Area swept by a tool that turns about a point within its width, or over its own track."""
    shapes = np.asarray(shapely.polygons(np.stack((left[:-1], left[1:], right[1:], right[:-1]), axis=1)))
    # A quad that is folded is two triangles.
    folded = ~shapely.is_valid(shapes)
    shapes[folded] = [buffer(shape, 0.0) for shape in shapes[folded]]
    return as_area(union(shapes))


def _parts(path: PiecePath) -> Iterator[PiecePath]:
    """Pieces that have a length, each as a path."""
    for piece, start in zip(path.pieces, path.knots, strict=False):
        if piece.length_m > 0.0:
            yield PiecePath(start, (piece,))


def body_outside_m(paths: Iterable[PiecePath], machine: CoverageMachine, free: Area) -> float:
    """Maximum distance of the body beyond the free area (m); negative: minimum clearance inside.

    Args:
        paths: Paths of the tool's middle (m, map frame).
        machine: Machine with its body.
        free: Free ground (m, map frame).
    """
    shapely.prepare(free)
    border = shapely.boundary(free)
    shapely.prepare(border)
    worst = -math.inf
    for path in paths:
        count = 2 + math.ceil(path.length_m / BODY_STEP_M)
        spun = path.spun(BODY_STEP_M / machine.reach_m)
        poses = np.column_stack(path.sample(np.linspace(0.0, path.length_m, count))[:3])
        poses, count = np.concatenate((poses, spun)), count + len(spun)
        # Bodies that cannot be nearer to the border than the worst one so far are skipped.
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
    """Distance of a body beyond the free area (m), or the depth of an obstacle, such as a post, inside the body."""
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
    """Polygons of the body at poses (n, 3)."""
    corners = np.array(machine.outline) @ np.array([[1.0], [1.0j]])
    turned = poses[:, 0, None] + 1j * poses[:, 1, None] + np.exp(1j * poses[:, 2, None]) * corners[:, 0]
    return np.asarray(shapely.polygons(np.stack((turned.real, turned.imag), axis=-1)))
