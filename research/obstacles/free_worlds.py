"""Random worlds with a boundary and obstacles: rooms with doors, clutter, and U-shaped traps."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.geometry.clothoid import PathPose

SIZE_M = 16.0
Outline = Sequence[tuple[float, float]]

KINDS = ("rooms", "clutter", "traps")


def world(seed: int) -> ObstructedGround:
    """Ground of a seed; its kind is KINDS[seed % 3]."""
    rng = np.random.default_rng(seed)
    made = {"rooms": _rooms, "clutter": _clutter, "traps": _traps}[KINDS[seed % 3]](rng)
    return ObstructedGround.of(shapely.box(0.0, 0.0, SIZE_M, SIZE_M), made)


def random_pose(rng: np.random.Generator, ground: ObstructedGround, outline: Outline) -> PathPose:
    """Pose at which a body is 2 mm or more off everything."""
    while True:
        x, y = rng.uniform(0.0, SIZE_M, 2)
        pose = PathPose(float(x), float(y), rng.uniform(-math.pi, math.pi))
        if ground.free.contains(placed(outline, pose).buffer(0.002)):
            return pose


def placed(outline: Outline, pose: PathPose) -> shapely.Polygon:
    """Polygon of a body at a pose."""
    turned = shapely.affinity.rotate(shapely.Polygon(outline), pose.heading_rad, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(turned, pose.x_m, pose.y_m)


def box(x: float, y: float, length: float, width: float, angle: float) -> shapely.Polygon:
    """Rectangle about a point."""
    shape = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
    return shapely.affinity.translate(shapely.affinity.rotate(shape, angle, origin=(0, 0), use_radians=True), x, y)


def _rooms(rng: np.random.Generator) -> list[shapely.Polygon]:
    parts, found, half = int(rng.integers(2, 4)), [], 0.075
    cuts = [SIZE_M * (i + 1) / parts + rng.uniform(-0.8, 0.8) for i in range(parts - 1)]
    edges = [0.0, *cuts, SIZE_M]
    for axis in (0, 1):
        for cut in cuts:
            for a, b in pairwise(edges):
                door = rng.uniform(0.7, 1.4)
                at = rng.uniform(a + 1.0, b - 1.0 - door)
                for low, high in ((a, at), (at + door, b)):
                    wall = (low, cut - half, high, cut + half)
                    found.append(shapely.box(*wall) if axis == 0 else shapely.box(wall[1], low, wall[3], high))
    return found


def _clutter(rng: np.random.Generator) -> list[shapely.Polygon]:
    count = int(rng.integers(25, 45))
    sizes = [(rng.uniform(0.5, SIZE_M - 0.5, 2), rng.uniform(0.2, 2.2), rng.uniform(0.15, 0.8)) for _ in range(count)]
    return [box(at[0], at[1], length, width, rng.uniform(0.0, math.pi)) for at, length, width in sizes]


def _traps(rng: np.random.Generator) -> list[shapely.Polygon]:
    found = []
    for _ in range(int(rng.integers(5, 9))):
        at, turn, deep, wide = rng.uniform(2.0, SIZE_M - 2.0, 2), rng.uniform(0.0, math.tau), rng.uniform(1.5, 4.0), 0.2
        width = rng.uniform(0.9, 2.5)
        back = box(deep / 2, 0.0, wide, width + wide, 0.0)
        for wall in (back, box(0.0, width / 2, deep, wide, 0.0), box(0.0, -width / 2, deep, wide, 0.0)):
            shape = shapely.affinity.rotate(wall, turn, origin=(0, 0), use_radians=True)
            found.append(shapely.affinity.translate(shape, *at))
    return found
