"""Wet paint: how often a wheel or a caster runs over a line that is not dry yet."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath

# Tracks are looked at this often (m): less than half the width of a line.
STEP_M = 0.04
# Columns of a painted line: start, heading, curvature, length, when its painting began and its speed.
X, Y, HEADING, CURVATURE, LENGTH, BEGUN, SPEED = range(7)


@dataclass(frozen=True)
class Wheels:
    """What touches the ground, (n, 2) in the body's frame, m; half a line's width, m; how long paint stays wet, s."""

    contacts: Floats
    half_width_m: float
    drying_s: float

    @classmethod
    def of(cls, vehicle: Vehicle, line_width_m: float, drying_s: float) -> "Wheels":
        """What a vehicle touches the ground with."""
        return cls(np.array(vehicle.drive.contacts_m), 0.5 * line_width_m, drying_s)

    @property
    def never_dry(self) -> "Wheels":
        """The same, where paint stays wet for ever."""
        return replace(self, drying_s=math.inf)

    def crossings(self, path: PiecePath, begun_s: float, seconds: float, painted: Floats) -> Ints:
        """How often each of the `painted` lines (rows) is run over on a path that is driven from `begun_s` on."""
        if not len(painted) or not path.length_m:
            return np.zeros(len(painted), dtype=np.int64)
        station = np.linspace(0.0, path.length_m, 2 + math.ceil(path.length_m / STEP_M))
        x, y, heading, _ = path.sample(station)
        poses = np.column_stack((x, y, heading, station))
        for piece, start, knot in zip(path.pieces, path.stations, path.knots, strict=False):
            if piece.spin_rad:
                poses = self._with_spin(poses, start, knot, piece.spin_rad)
        poses[:, 3] = begun_s + seconds * poses[:, 3] / path.length_m
        figures = self.half_width_m, self.drying_s, STEP_M
        return np.asarray(wet_crossings(poses, self.contacts, painted, boxes_of(painted), *figures))

    def _with_spin(self, poses: Floats, station_m: float, at: PathPose, angle_rad: float) -> Floats:
        """Poses (n, 4), their last column the station, with those of a turn on the spot."""
        count = 2 + math.ceil(abs(angle_rad) * float(np.hypot(*self.contacts.T).max()) / STEP_M)
        spin = np.tile((at.x_m, at.y_m, 0.0, station_m), (count, 1))
        spin[:, 2] = at.heading_rad + np.linspace(0.0, angle_rad, count)
        before = int(np.searchsorted(poses[:, 3], station_m))
        return np.concatenate((poses[:before], spin, poses[before:]))


def wet_rows(nozzles: Iterable[Curve]) -> Floats:
    """(n, 7) rows of lines that are there from the beginning."""
    rows = [(n.x_m, n.y_m, n.heading_rad, n.curvature_1pm, n.length_m, -1.0, math.inf) for n in nozzles]
    return np.array(rows).reshape(-1, 7)


@kernel
def _beside(px: float, py: float, line: Floats, c: float, s: float) -> float:
    """How far to the left of a line or arc, of which the heading's cosine and sine are given, P is."""
    dx, dy = px - line[X], py - line[Y]
    left: float = c * dy - s * dx
    k = line[CURVATURE]
    if k == 0.0:
        return left
    radius = 1.0 / k
    ahead, inward = c * dx + s * dy, radius - left
    return float((abs(radius) - math.sqrt(ahead * ahead + inward * inward)) * math.copysign(1.0, k))


@kernel
def _along(px: float, py: float, line: Floats, c: float, s: float) -> float:
    """How far along a line or arc, of which the heading's cosine and sine are given, P is."""
    dx, dy = px - line[X], py - line[Y]
    ahead: float = c * dx + s * dy
    k = line[CURVATURE]
    if k == 0.0:
        return ahead
    angle = math.atan2(ahead, (1.0 / k - (c * dy - s * dx)) * math.copysign(1.0, k))
    middle = 0.5 * line[LENGTH] * abs(k)
    angle -= 2.0 * math.pi * math.floor((angle - middle) / (2.0 * math.pi) + 0.5)
    return float(angle / abs(k))


@kernel
def boxes_of(painted: Floats) -> Floats:
    """(n, 4) the least and greatest x and y of a box round each painted line."""
    boxes = np.empty((len(painted), 4))
    for j in range(len(painted)):
        line = painted[j]
        half = 0.5 * line[CURVATURE] * line[LENGTH]
        # The chord, and how far the curve is beside it.
        chord = line[LENGTH] * (math.sin(half) / half if half else 1.0)
        aside = math.tan(0.5 * half) * 0.5 * chord
        x, y = line[X], line[Y]
        if abs(half) > 0.5 * math.pi:
            # More than a half circle: all of the circle.
            radius = 1.0 / line[CURVATURE]
            x, y = x - radius * math.sin(line[HEADING]), y + radius * math.cos(line[HEADING])
            chord, aside = 0.0, abs(radius)
        to_x, to_y = x + chord * math.cos(line[HEADING] + half), y + chord * math.sin(line[HEADING] + half)
        boxes[j, 0], boxes[j, 1] = min(x, to_x) - abs(aside), max(x, to_x) + abs(aside)
        boxes[j, 2], boxes[j, 3] = min(y, to_y) - abs(aside), max(y, to_y) + abs(aside)
    return boxes


@kernel
def wet_crossings(
    poses: Floats,
    contacts: Floats,
    painted: Floats,
    boxes: Floats,
    half_width: float,
    drying: float,
    step: float,
) -> Ints:
    """How often a contact enters the wet part of each painted line; `poses` are x, y, heading, time, `step` m apart.

    `boxes` are those of the lines.
    """
    counts = np.zeros(len(painted), dtype=np.int64)
    reach = 0.0
    for k in range(len(contacts)):
        reach = max(reach, math.hypot(contacts[k, 0], contacts[k, 1]))
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for i in range(len(poses)):
        low_x, high_x = min(low_x, poses[i, 0]), max(high_x, poses[i, 0])
        low_y, high_y = min(low_y, poses[i, 1]), max(high_y, poses[i, 1])
    low_x, high_x = low_x - reach - half_width, high_x + reach + half_width
    low_y, high_y = low_y - reach - half_width, high_y + reach + half_width
    # Where the contacts are at each pose, once that is asked for.
    places, known = np.empty((len(poses), len(contacts), 2)), np.zeros(len(poses), dtype=np.bool_)
    on = np.empty(len(contacts), dtype=np.bool_)
    for j in range(len(painted)):
        box = boxes[j]
        if box[1] < low_x or box[0] > high_x or box[3] < low_y or box[2] > high_y:
            continue
        line = painted[j]
        length = line[LENGTH]
        cos, sin = math.cos(line[HEADING]), math.sin(line[HEADING])
        on[:] = False
        i = 0
        while i < len(poses):
            x, y = poses[i, 0], poses[i, 1]
            far = max(box[0] - x, x - box[1], box[2] - y, y - box[3]) - reach - half_width
            if far <= 2.0 * step:
                far = max(far, abs(_beside(x, y, line, cos, sin)) - reach - half_width)
                if line[CURVATURE] == 0.0:
                    along = _along(x, y, line, cos, sin)
                    far = max(far, max(-along, along - length) - reach - half_width)
            if far > 2.0 * step:
                # No contact gets there within so many poses.
                on[:] = False
                i += int(far / step)
                continue
            if not known[i]:
                known[i] = True
                c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
                for k in range(len(contacts)):
                    places[i, k, 0] = x + c * contacts[k, 0] - s * contacts[k, 1]
                    places[i, k, 1] = y + s * contacts[k, 0] + c * contacts[k, 1]
            for k in range(len(contacts)):
                px, py = places[i, k, 0], places[i, k, 1]
                over = False
                if abs(_beside(px, py, line, cos, sin)) <= half_width:
                    along = _along(px, py, line, cos, sin)
                    over = 0.0 <= along <= length
                    if over and not on[k]:
                        age = poses[i, 3] - line[BEGUN] - along / line[SPEED]
                        counts[j] += 1 if 0.0 <= age <= drying else 0
                on[k] = over
            i += 1
    return counts
