"""The path as the robot drives it: rows for the kernels, cut into legs between standstills.

A leg is driven forward, driven backward or turned on the spot. Rows are those of `PathTable.array`, except for the
heading, which is the robot's own (a reversing robot keeps it opposite to its tangent) and unwrapped along the path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.drives.onboard_drive import OnboardDrive, drive_of
from touchline.schemas.curves import Curve, spin_rad, wrap_angle
from touchline.schemas.errors import CommandRefused
from touchline.schemas.given_angles import FULL_TURN_RAD, instead_of_degrees
from touchline.schemas.messages import CurveType, LinearDirection, Segment
from touchline.schemas.vehicles import Vehicle

MAX_GAP_M = 1e-3
MAX_KINK_RAD = 1e-3
MIN_SEGMENT_M = 1e-6
FORWARD, BACKWARD, SPIN = 1, -1, 0


@dataclass(frozen=True)
class Leg:
    """Part of the path that is driven without stopping.

    Attributes:
        first, last: Rows (= segments) first … last − 1.
        sense: FORWARD, BACKWARD or SPIN.
        start_m, end_m: Arc lengths; equal for a turn on the spot.
        heading_rad: Heading of the robot at the start, unwrapped.
        turn_rad: Angle of a turn on the spot.
    """

    first: int
    last: int
    sense: int
    start_m: float
    end_m: float
    heading_rad: float
    turn_rad: float = 0.0


def segment_name(index: int, segment: Segment) -> str:
    """Return the name of a segment in refusals.

    Args:
        index: Index of the segment in the path.
        segment: The segment.
    """
    return f'segment {index} ("{segment.id}")'


def cut_path(segments: tuple[Segment, ...], vehicle: Vehicle) -> tuple[NDArray[np.float64], list[Leg]]:
    """Convert segments to rows and cut them into legs.

    Args:
        segments: Path of the trajectory, map frame.
        vehicle: Vehicle that is to drive them.

    Returns:
        Rows (n, 7), one per segment, and the legs.

    Raises:
        CommandRefused: A segment cannot be driven or does not continue the one before.
    """
    drive = drive_of(vehicle)
    rows = np.zeros((len(segments), 7))
    spins = np.zeros(len(segments))
    at_m = 0.0
    for i, segment in enumerate(segments):
        rows[i, 5] = at_m
        turn = spin_rad(segment.curve)
        if turn is not None:
            spins[i] = _checked_turn(i, segment, turn)
            start = segment.curve.arc[0].start
            rows[i, :2] = start.x, start.y
            continue
        curve = _curve(i, segment, drive)
        backward = segment.direction.value == LinearDirection.BACKWARD
        heading = wrap_angle(curve.heading_rad + (math.pi if backward else 0.0))
        rows[i, :5] = curve.x_m, curve.y_m, heading, curve.curvature_1pm, curve.length_m
        rows[i, 6] = BACKWARD if backward else FORWARD
        at_m += curve.length_m
    _head(rows, spins)
    _check_joints(segments, rows, spins)
    return rows, _legs(rows, spins)


def _checked_turn(index: int, segment: Segment, turn_rad: float) -> float:
    start = segment.curve.arc[0].start
    if not all(map(math.isfinite, (start.x, start.y, turn_rad))):
        raise CommandRefused(f"{segment_name(index, segment)} has a coordinate that is not finite")
    if abs(turn_rad) > 4.0 * math.pi:
        raise CommandRefused(f"{segment_name(index, segment)} turns on the spot by more than twice round")
    return turn_rad


def _curve(index: int, segment: Segment, drive: OnboardDrive) -> Curve:
    name = segment_name(index, segment)
    points = (
        [p for line in segment.curve.line for p in (line.start, line.end)]
        if segment.curve.type.value == CurveType.LINE
        else [p for arc in segment.curve.arc for p in (arc.start, arc.center)]
    )
    numbers = [c for p in points for c in (p.x, p.y)] + [arc.sweep_angle for arc in segment.curve.arc]
    if not all(map(math.isfinite, numbers)):
        raise CommandRefused(f"{name} has a coordinate that is not finite")
    for arc in segment.curve.arc:
        if abs(arc.sweep_angle) > FULL_TURN_RAD:
            remedy = f"give sweep_angle {instead_of_degrees(arc.sweep_angle)}"
            raise CommandRefused(f"{name} turns by {arc.sweep_angle:g} rad, more than once round; {remedy}")
    try:
        curve = Curve.from_message(segment.curve)
    except ValueError as error:
        raise CommandRefused(f"{name}: {error}") from error
    if curve.length_m < MIN_SEGMENT_M:
        raise CommandRefused(f"{name} has no length")
    drive.check_curvature(name, curve.curvature_1pm)
    return curve


def _head(rows: NDArray[np.float64], spins: NDArray[np.float64]) -> None:
    """Unwrap the headings along the path, so that differences are turns; those of spins follow from neighbours."""
    driven = np.flatnonzero(rows[:, 6])
    if not len(driven):
        raise CommandRefused("the trajectory only turns on the spot, which does not say from which heading")
    first = int(driven[0])
    heading = rows[first, 2] - spins[:first].sum()
    for i in range(len(rows)):
        if rows[i, 6] != SPIN:
            heading += wrap_angle(rows[i, 2] - heading)
        rows[i, 2] = heading
        heading += spins[i] + rows[i, 3] * rows[i, 4]


def _end(row: NDArray[np.float64]) -> tuple[float, float]:
    """Return the end point of a row [m]."""
    x, y, heading, curvature, length, _, sense = row.tolist()
    half = 0.5 * curvature * length
    chord = sense * length * float(np.sinc(half / math.pi))
    return x + chord * math.cos(heading + half), y + chord * math.sin(heading + half)


def _check_joints(segments: tuple[Segment, ...], rows: NDArray[np.float64], spins: NDArray[np.float64]) -> None:
    for i in range(1, len(rows)):
        before, after = rows[i - 1], rows[i]
        x, y = _end(before)
        gap = math.hypot(after[0] - x, after[1] - y)
        kink = abs(float(after[2] - before[2] - before[3] * before[4] - spins[i - 1]))
        names = f"{segment_name(i - 1, segments[i - 1])} and {segment_name(i, segments[i])}"
        if gap > MAX_GAP_M:
            raise CommandRefused(f"there is a gap of {gap * 1e3:.1f} mm between {names}; at most 1 mm is allowed")
        if kink > MAX_KINK_RAD:
            raise CommandRefused(f"there is a kink of {kink:.4f} rad between {names}; at most 0.001 rad is allowed")


def _legs(rows: NDArray[np.float64], spins: NDArray[np.float64]) -> list[Leg]:
    legs: list[Leg] = []
    first = 0
    for i in range(1, len(rows) + 1):
        sense = int(rows[first, 6])
        if i < len(rows) and sense != SPIN and rows[i, 6] == sense:
            continue
        end_m = float(rows[i - 1, 5] + rows[i - 1, 4])
        legs.append(Leg(first, i, sense, float(rows[first, 5]), end_m, float(rows[first, 2]), float(spins[first])))
        first = i
    return legs


def poses_along(rows: NDArray[np.float64], along_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the robot's poses at a distance along each row.

    Args:
        rows: (n, 7) rows of `cut_path`.
        along_m: (n,) distance from the start of each row.

    Returns:
        (n, 3) x, y [m], map frame, and heading [rad].
    """
    half = 0.5 * rows[:, 3] * along_m
    chord = rows[:, 6] * along_m * np.sinc(half / math.pi)
    x, y = rows[:, 0] + chord * np.cos(rows[:, 2] + half), rows[:, 1] + chord * np.sin(rows[:, 2] + half)
    return np.column_stack((x, y, rows[:, 2] + 2.0 * half))


def pose_at(rows: NDArray[np.float64], leg: Leg, arc_length_m: float) -> tuple[float, float, float]:
    """Compute the robot's pose at an arc length of a leg; on a turn on the spot, the pose before the turn.

    Args:
        rows: (n, 7) rows of `cut_path`.
        leg: Leg of the path.
        arc_length_m: Arc length of the path.

    Returns:
        x [m], y [m], map frame, and heading [rad].
    """
    own = rows[leg.first : leg.last]
    row = own[max(int(np.searchsorted(own[:, 5], arc_length_m, side="right")) - 1, 0)].copy()
    row[4] = arc_length_m - row[5]
    return *_end(row), float(row[2] + row[3] * row[4])
