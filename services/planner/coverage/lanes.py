"""Lanes: parallel straights inside the laps, and the direction in which they take least."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from touchline.core.plain_sum import plain_sum
from touchline.core.robust_overlay import intersection
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.shapes import Area, extents, turned
from touchline.services.planner.coverage.uncovered_intervals import uncovered_intervals
from touchline.services.planner.geometry.clothoid import PathPose

# A turn costs as much as this many metres of a lane when directions are compared.
TURN_M = 12.0
# Step of the directions that are compared besides those of the edges (degrees).
ANGLE_STEP_DEG = 5.0
# Edges this close (rad) to the lanes' direction divide cells; a lower strip (m) is rounding.
PARALLEL_RAD, STRIP_MIN_M = 1e-3, 1e-3
# A shorter lane (m) is not laid: touching up covers it.
LANE_MIN_M = 0.3


@dataclass(frozen=True)
class CoverLane:
    """A lane, to be driven in either direction.

    Attributes:
        along: Stroke in the lanes' direction.
        back: Stroke in the opposite direction; it begins where the tail is at the wall.
        row: Number of its level, from the lowest.
    """

    along: CoverStroke
    back: CoverStroke
    row: int


def lane_angle(rest: Area, pitch_m: float) -> float:
    """Direction (rad) in which lanes over the area inside the laps take least, their turns included."""
    edges = [
        math.atan2(dy, dx) % math.pi
        for part in shapely.get_parts(rest)
        for dx, dy in np.diff(shapely.get_coordinates(part.exterior), axis=0).tolist()
    ]
    angles = [*dict.fromkeys(round(a, 9) for a in edges), *np.radians(np.arange(0.0, 180.0, ANGLE_STEP_DEG)).tolist()]
    return float(min(angles, key=lambda angle: _price_m(rest, angle, pitch_m)))


def _price_m(rest: Area, angle_rad: float, pitch_m: float) -> float:
    rows = list(_rows(_frame(rest, -angle_rad), pitch_m))
    return plain_sum(b - a + TURN_M for _, _, extents in rows for a, b in extents)


def lanes(
    rest: Area, angle_rad: float, pitch_m: float, space: FreeSpace, remaining: Area | None = None
) -> list[CoverLane]:
    """Lay lanes over the area inside the laps, evenly between its edges along them.

    They extend far enough to cross a lap.

    Args:
        rest: Area inside the laps (m, map frame).
        angle_rad: Direction of the lanes, counter-clockwise from +x of the map frame.
        pitch_m: Maximum distance of neighbouring lanes.
        space: Free space of the machine.
        remaining: Ground still to be covered (m, map frame); None: all of it.
    """
    found: list[CoverLane] = []
    beyond = 1.5 * space.machine.width_m
    ahead = complex(math.cos(angle_rad), math.sin(angle_rad))
    for row, (level, height, spans) in enumerate(_rows(_frame(rest, -angle_rad), pitch_m)):
        for a, b in (part for span in spans for part in _uncovered(span, level, height, angle_rad, remaining)):
            strokes = []
            for from_x, heading in ((a, angle_rad), (b, angle_rad + math.pi)):
                z = complex(from_x, level) * ahead
                pose = PathPose(z.real, z.imag, heading)
                stretch = max(
                    space.stretches(pose, b - a + beyond, beyond),
                    key=lambda s: min(s[1], b - a) - max(s[0], 0.0),
                    default=(0.0, 0.0),
                )
                strokes.append((pose.moved(complex(stretch[0], 0.0), 0.0), stretch[1] - stretch[0]))
            if min(length for _, length in strokes) >= LANE_MIN_M:
                label = f"lane {len(found) + 1}"
                along, back = (CoverStroke(DriveKind.LANE, label, start, length) for start, length in strokes)
                found.append(CoverLane(along, back, row))
    return found


def _uncovered(
    span: tuple[float, float], level: float, height: float, angle_rad: float, remaining: Area | None
) -> Iterator[tuple[float, float]]:
    """Parts of a lane along which something is still to be covered."""
    if remaining is None:
        yield span
        return
    z = complex(span[0], level) * complex(math.cos(angle_rad), math.sin(angle_rad))
    pose = PathPose(z.real, z.imag, angle_rad)
    for first, last in uncovered_intervals(remaining, pose, span[1] - span[0], 0.5 * height):
        yield span[0] + first, span[0] + last


def _rows(rest: Area, pitch_m: float) -> Iterator[tuple[float, float, list[tuple[float, float]]]]:
    """Levels (m) of lanes along x, the height of their bands (m), and the intervals along them in the area."""
    for low, high in pairwise(_borders(rest)):
        count = max(1, math.ceil((high - low) / pitch_m - 1e-6))
        height = (high - low) / count
        for k in range(count):
            level = low + (k + 0.5) * height
            band = shapely.box(-1e5, level - 0.5 * height + STRIP_MIN_M, 1e5, level + 0.5 * height - STRIP_MIN_M)
            lanes_in = [(a, b) for a, b in extents(intersection(rest, band), STRIP_MIN_M**2) if b - a >= LANE_MIN_M]
            yield level, height, lanes_in


def _borders(rest: Area) -> list[float]:
    """Levels (m) of the lowest and the highest point, and of the edges along the lanes."""
    _, low, _, high = rest.bounds
    found = [low, high]
    for part in shapely.get_parts(rest):
        for ring in (part.exterior, *part.interiors):
            points = shapely.get_coordinates(ring)
            for (ax, ay), (bx, by) in pairwise(points.tolist()):
                if abs(by - ay) <= PARALLEL_RAD * abs(bx - ax):
                    found.append(0.5 * (ay + by))
    kept = [low]
    for level in sorted(found):
        if level - kept[-1] > 0.25:
            kept.append(level)
    kept[-1] = high if high - kept[-1] <= 0.25 else kept[-1]
    return kept if kept[-1] == high else [*kept, high]


def _frame(shape: Area, angle_rad: float) -> Area:
    """Rotate a shape about the origin."""
    return shapely.transform(shape, lambda points: turned(points, angle_rad))
