"""Crossings of wet paint: wheels and casters on lines that are not dry yet."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import CURVATURE, HEADING, LENGTH, X, Y, abreast, beside, chord_share, unit
from touchline.core.jit import borrowing, kernel
from touchline.schemas.curves import Curve
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath

# Sampling of tracks (m): less than half the width of a line.
STEP_M = 0.04
# Columns of a painted line, after those of `core.arcs`: time (s) at which its painting began, and its speed (m/s).
BEGUN, SPEED = 5, 6
# No painted line.
NO_LINES: Floats = np.zeros((0, 7))


class Contacts(NamedTuple):
    """Contacts with the ground in the form that kernels take.

    Attributes:
        places: (n, 2) positions in the body's frame, m.
        half_width: Half a line's width, m.
        drying: Drying time of the paint, s.
        step: Distance between poses of a track, m.
    """

    places: Floats
    half_width: float
    drying: float
    step: float


class WetLines(NamedTuple):
    """Painted lines in the form that kernels take: rows (n, 7), and their bounding boxes (n, 4) by `boxes_of`."""

    rows: Floats
    boxes: Floats


@dataclass(frozen=True)
class Wheels:
    """Contacts with the ground (n, 2) in the body's frame (m), half a line's width (m), drying time of paint (s)."""

    contacts: Floats
    half_width_m: float
    drying_s: float

    @classmethod
    def of(cls, vehicle: Vehicle, line_width_m: float, drying_s: float) -> "Wheels":
        """Wheels and casters of a vehicle."""
        return cls(np.array(vehicle.drive.contacts_m), 0.5 * line_width_m, drying_s)

    @property
    def never_dry(self) -> "Wheels":
        """Copy with paint that stays wet for ever."""
        return replace(self, drying_s=math.inf)

    def looked_at_every(self, step_m: float) -> Contacts:
        """Contacts in the form that kernels take, for tracks of poses that are `step_m` apart."""
        return Contacts(self.contacts, self.half_width_m, self.drying_s, step_m)

    def crossings(self, path: PiecePath, begun_s: float, seconds: float, painted: Floats) -> Ints:
        """Number of crossings of each of the `painted` lines (rows) on a path that is driven from `begun_s` on.

        Args:
            path: Path of the robot's centre (m, map frame).
            begun_s: Time at which it begins.
            seconds: Its duration.
            painted: (n, 7) rows of painted lines.
        """
        if not len(painted) or not path.length_m:
            return np.zeros(len(painted), dtype=np.int64)
        station = np.linspace(0.0, path.length_m, 2 + math.ceil(path.length_m / STEP_M))
        x, y, heading, _ = path.sample(station)
        poses = np.column_stack((x, y, heading, station))
        for piece, start, knot in zip(path.pieces, path.stations, path.knots, strict=False):
            if piece.spin_rad:
                poses = self._with_spin(poses, start, knot, piece.spin_rad)
        poses[:, 3] = begun_s + seconds * poses[:, 3] / path.length_m
        lines = WetLines(painted, boxes_of(painted))
        return np.asarray(wet_crossings(poses, self.looked_at_every(STEP_M), lines))

    def _with_spin(self, poses: Floats, station_m: float, at: PathPose, angle_rad: float) -> Floats:
        """Insert the poses of a turn on the spot into poses (n, 4), whose last column is the station."""
        count = 2 + math.ceil(abs(angle_rad) * float(np.hypot(*self.contacts.T).max()) / STEP_M)
        spin = np.tile((at.x_m, at.y_m, 0.0, station_m), (count, 1))
        spin[:, 2] = at.heading_rad + np.linspace(0.0, angle_rad, count)
        before = int(np.searchsorted(poses[:, 3], station_m))
        return np.concatenate((poses[:before], spin, poses[before:]))


def wet_rows(nozzles: Iterable[Curve]) -> Floats:
    """Rows (n, 7) of lines that are on the ground from the beginning."""
    rows = [(n.x_m, n.y_m, n.heading_rad, n.curvature_1pm, n.length_m, -1.0, math.inf) for n in nozzles]
    return np.array(rows).reshape(-1, 7)


@kernel
def boxes_of(painted: Floats) -> Floats:
    """Bounding boxes (n, 4) of painted lines: minimum and maximum x and y."""
    boxes = np.empty((len(painted), 4))
    for j in range(len(painted)):
        line = painted[j]
        half = 0.5 * line[CURVATURE] * line[LENGTH]
        # The chord, and the distance of the curve from it.
        chord = line[LENGTH] * chord_share(half)
        aside = math.tan(0.5 * half) * 0.5 * chord
        x, y = line[X], line[Y]
        if abs(half) > 0.5 * math.pi:
            # More than a half circle: take the whole circle.
            radius = 1.0 / line[CURVATURE]
            x, y = x - radius * math.sin(line[HEADING]), y + radius * math.cos(line[HEADING])
            chord, aside = 0.0, abs(radius)
        to_x, to_y = x + chord * math.cos(line[HEADING] + half), y + chord * math.sin(line[HEADING] + half)
        boxes[j, 0], boxes[j, 1] = min(x, to_x) - abs(aside), max(x, to_x) + abs(aside)
        boxes[j, 2], boxes[j, 3] = min(y, to_y) - abs(aside), max(y, to_y) + abs(aside)
    return boxes


class _Track(NamedTuple):
    """Poses (n, 4), positions of the contacts at them (n, contacts, 2), and for which poses they are known (n,)."""

    poses: Floats
    places: Floats
    known: NDArray[np.bool_]


@kernel
def wet_crossings(poses: Floats, contacts: Contacts, lines: WetLines) -> Ints:
    """Number of times (lines,) that a contact enters the wet part of each painted line.

    Args:
        poses: (n, 4) x (m), y (m), heading (rad), time (s), `contacts.step` apart.
        contacts: Contacts with the ground.
        lines: Painted lines with the times of their painting.
    """
    places, half_width = contacts.places, contacts.half_width
    counts = np.zeros(len(lines.rows), dtype=np.int64)
    reach = 0.0
    for k in range(len(places)):
        reach = max(reach, math.hypot(places[k, 0], places[k, 1]))
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for i in range(len(poses)):
        low_x, high_x = min(low_x, poses[i, 0]), max(high_x, poses[i, 0])
        low_y, high_y = min(low_y, poses[i, 1]), max(high_y, poses[i, 1])
    low_x, high_x = low_x - reach - half_width, high_x + reach + half_width
    low_y, high_y = low_y - reach - half_width, high_y + reach + half_width
    # Positions of the contacts are computed on first use.
    track = _Track(poses, np.empty((len(poses), len(places), 2)), np.zeros(len(poses), dtype=np.bool_))
    on = np.empty(len(places), dtype=np.bool_)
    for j in range(len(lines.rows)):
        box = lines.boxes[j]
        if box[1] < low_x or box[0] > high_x or box[3] < low_y or box[2] > high_y:
            continue
        counts[j] = _entered(track, contacts, lines.rows[j], box, reach, on)
    return counts


@borrowing
def _entered(track: _Track, contacts: Contacts, line: Floats, box: Floats, reach: float, on: NDArray[np.bool_]) -> int:
    """Number of times that a contact enters the wet part of one line; `on` (contacts,) is working space."""
    poses, half_width, step = track.poses, contacts.half_width, contacts.step
    length = line[LENGTH]
    facing = unit(line[HEADING])
    on[:] = False
    i, count = 0, 0
    while i < len(poses):
        x, y = poses[i, 0], poses[i, 1]
        far = max(box[0] - x, x - box[1], box[2] - y, y - box[3]) - reach - half_width
        if far <= 2.0 * step:
            far = max(far, abs(beside(complex(x, y), line, facing)) - reach - half_width)
            if line[CURVATURE] == 0.0:
                along = abreast(complex(x, y), line, facing)
                far = max(far, max(-along, along - length) - reach - half_width)
        if far > 2.0 * step:
            # No contact gets there within the skipped poses.
            on[:] = False
            i += int(far / step)
            continue
        if not track.known[i]:
            _locate(track, contacts.places, i)
        for k in range(len(contacts.places)):
            place = complex(track.places[i, k, 0], track.places[i, k, 1])
            over = False
            if abs(beside(place, line, facing)) <= half_width:
                along = abreast(place, line, facing)
                over = 0.0 <= along <= length
                if over and not on[k]:
                    age = poses[i, 3] - line[BEGUN] - along / line[SPEED]
                    count += 1 if 0.0 <= age <= contacts.drying else 0
            on[k] = over
        i += 1
    return count


@borrowing
def _locate(track: _Track, contacts: Floats, i: int) -> None:
    """Compute the positions of the contacts at pose `i`."""
    track.known[i] = True
    x, y = track.poses[i, 0], track.poses[i, 1]
    c, s = math.cos(track.poses[i, 2]), math.sin(track.poses[i, 2])
    for k in range(len(contacts)):
        track.places[i, k, 0] = x + c * contacts[k, 0] - s * contacts[k, 1]
        track.places[i, k, 1] = y + s * contacts[k, 0] + c * contacts[k, 1]
