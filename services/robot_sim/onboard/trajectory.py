"""A trajectory as the robot drives it: checked once at load, then plain arrays."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from schemas.curves import Curve, PathTable, wrap_angle
from schemas.errors import CommandRefused
from schemas.messages import Actuation, CurveType, LinearDirection, Segment, Trajectory, VelocityType
from schemas.vehicle import Vehicle

MAX_GAP_M = 1e-3
MAX_KINK_RAD = 1e-3
MAX_PROFILE_OVERHANG_M = 0.01
MIN_SPRAY_SPEED_MPS = 0.05
MIN_SEGMENT_M = 1e-6
_WHEEL_LIMIT_SLACK = 1.001


@dataclass(frozen=True)
class LoadedTrajectory:
    """Everything that is needed to drive, spray and tell the time.

    Attributes:
        path: (n, 7) rows of `PathTable.array` with the headings unwrapped along the path.
        speeds: (m, 2) arc length [m] and speed [m/s]; v² is linear in between.
        times_s: (m,) time at each of these arc lengths.
        switch_m: Arc lengths at which the actuation changes, ascending.
        actuation: The actuation from each of them on.
        ids: Segment ids in path order.
        total_length_m: Arc length of the whole path.
        total_time_s: Driving time at the profile's speeds.
    """

    path: NDArray[np.float64]
    speeds: NDArray[np.float64]
    times_s: NDArray[np.float64]
    switch_m: list[float]
    actuation: list[int]
    ids: list[str]
    total_length_m: float
    total_time_s: float

    def actuation_at(self, arc_length_m: float) -> int:
        """Bit mask of `Actuation` at an arc length; nothing before the first entry."""
        index = bisect.bisect_right(self.switch_m, arc_length_m) - 1
        return self.actuation[index] if index >= 0 else Actuation.NONE

    def first_spray_between(self, from_m: float, to_m: float) -> float | None:
        """The first arc length from `from_m` on, up to `to_m`, at which the plan sprays; None if it does not."""
        if self.actuation_at(from_m) & Actuation.VALVE:
            return from_m
        for index in range(bisect.bisect_right(self.switch_m, from_m), len(self.switch_m)):
            if self.switch_m[index] > to_m:
                return None
            if self.actuation[index] & Actuation.VALVE:
                return self.switch_m[index]
        return None

    def speed_at(self, arc_length_m: float) -> float:
        """Planned speed [m/s] at an arc length."""
        return float(_speed_at(self.speeds, np.array([arc_length_m]))[0])

    def time_at(self, arc_length_m: float) -> float:
        """Seconds from the start to an arc length at the profile's speeds."""
        s, v = self.speeds[:, 0], self.speeds[:, 1]
        i = min(max(int(np.searchsorted(s, arc_length_m, side="right")) - 1, 0), len(s) - 2)
        ds = min(max(arc_length_m - s[i], 0.0), s[i + 1] - s[i])
        span = s[i + 1] - s[i]
        squared = v[i] ** 2 + (v[i + 1] ** 2 - v[i] ** 2) * (ds / span if span > 0.0 else 0.0)
        pace = v[i] + math.sqrt(max(squared, 0.0))
        return float(self.times_s[i] + (2.0 * ds / pace if pace > 0.0 else 0.0))


def load_trajectory(trajectory: Trajectory, vehicle: Vehicle) -> LoadedTrajectory:
    """Check a trajectory and turn it into arrays.

    Raises:
        CommandRefused: It cannot be driven; the reason names the segment or profile entry.
    """
    segments = trajectory.path.segments
    if not segments:
        raise CommandRefused("the trajectory has no segments")
    curves = [_curve(i, segment, vehicle) for i, segment in enumerate(segments)]
    _check_joints(segments, curves)
    path = PathTable.from_curves(curves).array.copy()
    _unwrap(path)
    total = float(path[-1, 4] + path[-1, 5])
    speeds = _speeds(trajectory, total)
    switch_m, actuation = _actuation(trajectory, total)
    _check_wheels(path, speeds, segments, vehicle)
    _check_spray_speed(speeds, switch_m, actuation, total)
    pace = speeds[1:, 1] + speeds[:-1, 1]
    times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(speeds[:, 0]) / np.where(pace > 0.0, pace, 1.0))))
    ids = [segment.id for segment in segments]
    return LoadedTrajectory(path, speeds, times, switch_m, actuation, ids, total, float(times[-1]))


def _name(index: int, segment: Segment) -> str:
    return f'segment {index} ("{segment.id}")'


def _curve(index: int, segment: Segment, vehicle: Vehicle) -> Curve:
    name = _name(index, segment)
    if segment.direction.value == LinearDirection.BACKWARD:
        raise CommandRefused(f"{name} is to be driven backward, which this robot's executive does not do yet")
    kind = segment.curve.type.value
    points = (
        [p for line in segment.curve.line for p in (line.start, line.end)]
        if kind == CurveType.LINE
        else [p for arc in segment.curve.arc for p in (arc.start, arc.center)]
    )
    numbers = [c for p in points for c in (p.x, p.y)] + [arc.sweep_angle for arc in segment.curve.arc]
    if not all(map(math.isfinite, numbers)):
        raise CommandRefused(f"{name} has a coordinate that is not finite")
    if (
        kind == CurveType.ARC
        and len(points) == 2
        and math.dist((numbers[0], numbers[1]), (numbers[2], numbers[3])) < 1e-6
    ):
        raise CommandRefused(f"{name} is an arc without a radius")
    try:
        curve = Curve.from_message(segment.curve)
    except ValueError as error:
        raise CommandRefused(f"{name}: {error}") from error
    if curve.length_m < MIN_SEGMENT_M:
        raise CommandRefused(f"{name} has no length")
    if abs(curve.curvature_1pm) * vehicle.half_track_m > 1.0:
        raise CommandRefused(
            f"{name} has a radius of {abs(1 / curve.curvature_1pm):.3f} m, less than half the track "
            f"({vehicle.half_track_m:.3f} m): the inner wheel would have to run backward"
        )
    return curve


def _check_joints(segments: tuple[Segment, ...], curves: list[Curve]) -> None:
    for i, (before, after) in enumerate(pairwise(curves)):
        x, y, heading = before.end
        gap = math.hypot(after.x_m - x, after.y_m - y)
        kink = abs(wrap_angle(after.heading_rad - heading))
        names = f"{_name(i, segments[i])} and {_name(i + 1, segments[i + 1])}"
        if gap > MAX_GAP_M:
            raise CommandRefused(f"there is a gap of {gap * 1e3:.1f} mm between {names}; at most 1 mm is allowed")
        if kink > MAX_KINK_RAD:
            raise CommandRefused(f"there is a kink of {kink:.4f} rad between {names}; at most 0.001 rad is allowed")


def _unwrap(path: NDArray[np.float64]) -> None:
    """Headings continuous along the path, so that differences are turns."""
    for i in range(1, len(path)):
        end = path[i - 1, 2] + path[i - 1, 3] * path[i - 1, 4]
        path[i, 2] = end + wrap_angle(path[i, 2] - end)


def _speeds(trajectory: Trajectory, total_m: float) -> NDArray[np.float64]:
    parameters = trajectory.velocity_profile.parameters
    if not parameters:
        raise CommandRefused("the velocity profile is empty")
    for i, p in enumerate(parameters):
        if p.velocity.type.value == VelocityType.ANGULAR:
            raise CommandRefused(f"velocity profile entry {i} turns on the spot, which the executive does not do yet")
        if p.velocity.type.value != VelocityType.LINEAR:
            raise CommandRefused(f"velocity profile entry {i} is not of type LINEAR")
        if not (math.isfinite(p.arc_length) and math.isfinite(p.velocity.value)):
            raise CommandRefused(f"velocity profile entry {i} is not finite")
        if p.velocity.value < 0.0:
            raise CommandRefused(f"velocity profile entry {i} is negative ({p.velocity.value:.3f} m/s)")
    rows = [(p.arc_length, p.velocity.value) for p in parameters]
    _check_range([s for s, _ in rows], total_m, "velocity profile")
    if rows[0][0] > 0.0:
        rows.insert(0, (0.0, rows[0][1]))
    if rows[-1][0] < total_m:
        rows.append((total_m, rows[-1][1]))
    for i, (a, b) in enumerate(pairwise(rows)):
        if a[1] == 0.0 and b[1] == 0.0 and b[0] > a[0] + MAX_GAP_M:
            raise CommandRefused(f"the velocity profile stands still from {a[0]:.3f} m to {b[0]:.3f} m (entry {i})")
    return np.array(rows)


def _actuation(trajectory: Trajectory, total_m: float) -> tuple[list[float], list[int]]:
    parameters = trajectory.actuation_profile.parameters
    where = [p.arc_length for p in parameters]
    for i, s in enumerate(where):
        if not math.isfinite(s):
            raise CommandRefused(f"actuation profile entry {i} is not finite")
    _check_range(where, total_m, "actuation profile")
    return where, [p.actuation.value for p in parameters]


def _check_range(where: list[float], total_m: float, name: str) -> None:
    for i, (a, b) in enumerate(pairwise(where)):
        if b < a:
            raise CommandRefused(f"the {name} is not sorted: entry {i + 1} at {b:.3f} m comes after {a:.3f} m")
    if where and (where[0] < -MAX_PROFILE_OVERHANG_M or where[-1] > total_m + MAX_PROFILE_OVERHANG_M):
        raise CommandRefused(
            f"the {name} reaches from {where[0]:.3f} m to {where[-1]:.3f} m, the path from 0 to {total_m:.3f} m"
        )


def _speed_at(speeds: NDArray[np.float64], s: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.sqrt(np.interp(s, speeds[:, 0], speeds[:, 1] ** 2))


def _check_wheels(
    path: NDArray[np.float64], speeds: NDArray[np.float64], segments: tuple[Segment, ...], vehicle: Vehicle
) -> None:
    """v² is piecewise linear, so its largest value on a segment is at an entry or at an end of the segment."""
    starts, ends = path[:, 5], path[:, 5] + path[:, 4]
    fastest = np.maximum(_speed_at(speeds, starts), _speed_at(speeds, ends))
    owner = np.clip(np.searchsorted(starts, speeds[:, 0], side="right") - 1, 0, len(path) - 1)
    np.maximum.at(fastest, owner, np.where(speeds[:, 0] < ends[owner], speeds[:, 1], 0.0))
    rim = fastest * (1.0 + np.abs(path[:, 3]) * vehicle.half_track_m)
    worst = int(np.argmax(rim))
    if rim[worst] > vehicle.max_rim_speed_mps * _WHEEL_LIMIT_SLACK:
        raise CommandRefused(
            f"{_name(worst, segments[worst])}: {fastest[worst]:.2f} m/s at curvature {path[worst, 3]:.3f} 1/m needs a "
            f"wheel speed of {rim[worst] / vehicle.wheel_radius_m:.2f} rad/s; the limit is "
            f"{vehicle.max_wheel_speed_radps:.2f} rad/s"
        )


def _check_spray_speed(
    speeds: NDArray[np.float64], switch_m: list[float], actuation: list[int], total_m: float
) -> None:
    ends = [*switch_m[1:], total_m]
    for start, end, mask in zip(switch_m, ends, actuation, strict=False):
        if not mask & Actuation.VALVE or end <= start:
            continue
        inside = (speeds[:, 0] > start) & (speeds[:, 0] < end)
        slowest = float(min(*_speed_at(speeds, np.array([start, end])), *speeds[inside, 1], math.inf))
        middle = float(_speed_at(speeds, np.array([0.5 * (start + end)]))[0])
        if (slowest < MIN_SPRAY_SPEED_MPS and bool(inside.any())) or middle < MIN_SPRAY_SPEED_MPS:
            raise CommandRefused(
                f"the plan sprays from {start:.3f} m to {end:.3f} m at less than {MIN_SPRAY_SPEED_MPS} m/s: it would "
                "make a puddle"
            )
