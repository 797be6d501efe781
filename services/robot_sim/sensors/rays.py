"""Ranges of a plane of beams among solids and moving discs: every solid writes the beams between its two bearings.

The sensor moves during a scan, so each beam has an origin of its own. A solid's bearings are those from one reference
origin, widened by what the others see differently; within them every beam is intersected exactly, so the ranges are
those that a test of every beam against every solid would find.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.services.robot_sim.world.objects.solids import DARK, HEIGHT, RADIUS, X1, X2, Y1, Y2, SolidGrid

Floats = NDArray[np.float64]

_TURN: Final = 2.0 * math.pi
_BEARING_ERROR: Final = 1e-3  # bound on the error of `_bearing`, with room for rounding [rad]


class CastBeams(NamedTuple):
    """CastBeams of a scan, and what each has met.

    Attributes:
        rays: (n, 4) origin (east, north) [m] and unit vector of each, map frame.
        drop: (n,) descent of each per metre of range.
        age_s: (n,) time from each to the end of the scan.
        ranges: (n,) range to the nearest thing; inf if there is none.
        dark: (n,) 1 if its surface is dark.
        first_rad: Direction of the first beam at the reference, map frame.
        step_rad: Angle from beam to beam.
        height_m: Height at which they begin.
        most_m: Longest range.
    """

    rays: Floats
    drop: Floats
    age_s: Floats
    ranges: Floats
    dark: Floats
    first_rad: float
    step_rad: float
    height_m: float
    most_m: float


class ScanOrigin(NamedTuple):
    """Origin that bearings are computed from.

    Attributes:
        east_m: Its place.
        north_m: Its place.
        moved_m: Largest distance of a beam's origin from it.
        turned_rad: Largest difference of a beam's direction from that at the reference.
    """

    east_m: float
    north_m: float
    moved_m: float
    turned_rad: float


@kernel
def _bearing(x: float, y: float) -> float:
    """Compute the angle of a vector, to within 3e-4 rad, in a fraction of the time of atan2."""
    ax, ay = abs(x), abs(y)
    most = max(ax, ay)
    if most == 0.0:
        return 0.0
    ratio = min(ax, ay) / most
    square = ratio * ratio
    angle = ((-0.0464964749 * square + 0.15931422) * square - 0.327622764) * square * ratio + ratio
    if ay > ax:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@kernel
def range_to_edge(ray: Floats, x1: float, y1: float, x2: float, y2: float) -> float:
    """Compute the distance along a ray to an edge of an outline, from outside; inf if it misses it.

    Args:
        ray: (4,) origin and unit vector.
        x1: First end [m], counter-clockwise along the outline, with `y1`.
        y1: See `x1`.
        x2: Other end [m], with `y2`.
        y2: See `x2`.
    """
    ex, ey, wx, wy = x2 - x1, y2 - y1, x1 - ray[0], y1 - ray[1]
    across = ray[2] * ey - ray[3] * ex
    if across >= 0.0:  # along it, or from within the outline
        return math.inf
    along = (wx * ray[3] - wy * ray[2]) / across
    distance = (wx * ey - wy * ex) / across
    return distance if 0.0 <= along <= 1.0 and distance >= 0.0 else math.inf


@kernel
def range_to_disc(ray: Floats, x: float, y: float, radius: float) -> float:
    """Compute the distance along a ray to a disc; 0 from within, inf if it misses it.

    Args:
        ray: (4,) origin and unit vector.
        x: Centre [m], with `y`.
        y: See `x`.
        radius: Radius of the disc [m].
    """
    wx, wy = x - ray[0], y - ray[1]
    ahead = wx * ray[2] + wy * ray[3]
    aside = wx * ray[3] - wy * ray[2]
    depth = radius * radius - aside * aside
    if depth < 0.0:
        return math.inf
    half = math.sqrt(depth)
    if ahead + half < 0.0:
        return math.inf
    distance: float = max(ahead - half, 0.0)
    return distance


@borrowing
def _write(beams: CastBeams, beam: int, distance: float, height_m: float, dark: float) -> None:
    """Enter a hit, if it is the nearest so far and the thing is as high as the beam is there."""
    if distance < beams.ranges[beam] and beams.height_m - beams.drop[beam] * distance <= height_m:
        beams.ranges[beam], beams.dark[beam] = distance, dark


@borrowing
def _between(beams: CastBeams, low_rad: float, high_rad: float, turn: int) -> tuple[int, int]:
    """Return the first beam and the one after the last between two directions, map frame, a turn apart."""
    low = low_rad - beams.first_rad
    shift = -_TURN * math.floor(low / _TURN) - _TURN * turn
    last = math.floor((high_rad - beams.first_rad + shift) / beams.step_rad)
    first = math.ceil((low + shift) / beams.step_rad)
    return max(int(first), 0), min(int(last) + 1, len(beams.ranges))


@borrowing
def meet_disc(
    beams: CastBeams,
    reference: ScanOrigin,
    disc: tuple[float, float, float],
    velocity: tuple[float, float],
    height_m: float,
    dark: float,
) -> None:
    """Enter a disc that moves evenly.

    Args:
        beams: Ranges and surfaces are updated.
        reference: Origin that bearings are computed from.
        disc: Centre at the end of the scan, and radius [m].
        velocity: East and north [m/s].
        height_m: Height of the thing.
        dark: 1 for a dark surface.
    """
    x, y, radius = disc
    wx, wy = x - reference.east_m, y - reference.north_m
    distance = math.sqrt(wx * wx + wy * wy)
    moved = reference.moved_m + math.hypot(velocity[0], velocity[1]) * beams.age_s[0]
    if distance - radius - moved > beams.most_m:
        return
    low, high = 0.0, 2.0 * _TURN
    if distance > 2.0 * (radius + moved):
        # asin x ≤ 1.05 x for x ≤ 0.5
        wide = 1.05 * (radius + moved) / distance + reference.turned_rad + _BEARING_ERROR
        low = _bearing(wx, wy) - wide
        high = low + 2.0 * wide
    for turn in range(2):
        first, last = _between(beams, low, high, turn)
        for beam in range(first, last):
            age = beams.age_s[beam]
            met = range_to_disc(beams.rays[beam], x - velocity[0] * age, y - velocity[1] * age, radius)
            _write(beams, beam, met, height_m, dark)


@borrowing
def _meet_edge(beams: CastBeams, reference: ScanOrigin, solid: Floats) -> None:
    """Enter an edge of an outline."""
    ax, ay = solid[X1] - reference.east_m, solid[Y1] - reference.north_m
    bx, by = solid[X2] - reference.east_m, solid[Y2] - reference.north_m
    ex, ey = bx - ax, by - ay
    square, outside = ex * ex + ey * ey, ex * ay - ey * ax
    if outside < 0.0 and outside * outside > reference.moved_m * reference.moved_m * square:
        return  # every beam begins on its inner side
    share = min(max(-(ax * ex + ay * ey) / square, 0.0), 1.0) if square > 0.0 else 0.0
    nx, ny = ax + share * ex, ay + share * ey
    nearest = math.sqrt(nx * nx + ny * ny)
    if nearest - reference.moved_m > beams.most_m:
        return
    low, high = 0.0, 2.0 * _TURN
    if nearest > 2.0 * reference.moved_m and nearest > 0.0:
        wide = 1.05 * reference.moved_m / nearest + reference.turned_rad + _BEARING_ERROR
        low, high = _bearing(ax, ay), _bearing(bx, by)
        if low > high:
            low, high = high, low
        span = high - low
        if span > math.pi:
            low, high = high, low + _TURN
        low, high = low - wide, high + wide
        if abs(span - math.pi) < 2.0 * _BEARING_ERROR:  # it may pass on either side
            low, high = 0.0, 2.0 * _TURN
    for turn in range(2):
        first, last = _between(beams, low, high, turn)
        for beam in range(first, last):
            if beams.ranges[beam] <= nearest - reference.moved_m:
                continue
            met = range_to_edge(beams.rays[beam], solid[X1], solid[Y1], solid[X2], solid[Y2])
            _write(beams, beam, met, solid[HEIGHT], solid[DARK])


@borrowing
def _meet_cell(beams: CastBeams, reference: ScanOrigin, grid: SolidGrid, cell: int, scan: int) -> None:
    """Enter the solids of a cell that were not looked at in this scan."""
    for place in range(grid.first[cell], grid.first[cell + 1]):
        index = grid.items[place]
        if grid.looked_at[index] != scan:
            grid.looked_at[index] = scan
            solid = grid.solids[index]
            if solid[RADIUS] > 0.0:
                disc = (solid[X1], solid[Y1], solid[RADIUS])
                meet_disc(beams, reference, disc, (0.0, 0.0), solid[HEIGHT], solid[DARK])
            else:
                _meet_edge(beams, reference, solid)


@borrowing
def _any_beyond(beams: CastBeams, distance: float) -> bool:
    """Return True if a beam has met nothing within a distance."""
    beam = 0
    while beam < len(beams.ranges) and beams.ranges[beam] < distance:
        beam += 1
    return beam < len(beams.ranges)


@borrowing
def solids_in_reach(reference: ScanOrigin, grid: SolidGrid, most_m: float) -> bool:
    """Return whether beams of this length may meet a solid; False is certain.

    Args:
        reference: Origin that the beams' own are not far from.
        grid: The solids.
        most_m: Longest range.
    """
    if len(grid.items) == 0:
        return False
    east, north = reference.east_m - grid.corner[0], reference.north_m - grid.corner[1]
    aside_east = max(-east, east - grid.size[0] * grid.cell_m, 0.0)
    aside_north = max(-north, north - grid.size[1] * grid.cell_m, 0.0)
    return math.hypot(aside_east, aside_north) <= most_m + reference.moved_m


@borrowing
def meet_solids(beams: CastBeams, reference: ScanOrigin, grid: SolidGrid) -> None:
    """Enter all solids within range, from near to far: ring by ring of cells until every beam has met something nearer.

    Args:
        beams: Ranges and surfaces are updated.
        reference: Origin that bearings are computed from.
        grid: The solids.
    """
    looked_at, reach = grid.looked_at, beams.most_m + reference.moved_m
    looked_at[-1] += 1
    scan = looked_at[-1]
    middle_column = math.floor((reference.east_m - grid.corner[0]) / grid.cell_m)
    middle_row = math.floor((reference.north_m - grid.corner[1]) / grid.cell_m)
    first = max(-middle_column, middle_column - grid.size[0] + 1, -middle_row, middle_row - grid.size[1] + 1, 0)
    for ring in range(first, int(reach / grid.cell_m) + 2):
        if not _any_beyond(beams, (ring - 1) * grid.cell_m - reference.moved_m):
            return
        for row in range(max(middle_row - ring, 0), min(middle_row + ring, grid.size[1] - 1) + 1):
            whole = abs(row - middle_row) == ring
            for column in range(
                max(middle_column - ring, 0) if whole else middle_column - ring,
                (min(middle_column + ring, grid.size[0] - 1) if whole else middle_column + ring) + 1,
                1 if whole else max(2 * ring, 1),
            ):
                if 0 <= column < grid.size[0]:
                    _meet_cell(beams, reference, grid, row * grid.size[0] + column, scan)
