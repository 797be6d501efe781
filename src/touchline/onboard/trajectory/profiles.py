"""Speed and actuation profiles of a trajectory: read from the message and checked against the path."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.trajectory.path import BACKWARD, MAX_GAP_M, SPIN, Leg, segment_name
from touchline.onboard.trajectory.turn import TurnInPlace
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Actuation, Segment, Trajectory, VelocityType

MAX_PROFILE_OVERHANG_M = 0.01
MIN_SPRAY_SPEED_MPS = 0.05
MAX_CUSP_SPEED_MPS = 0.05
MIN_TURN_RADPS = 0.05
SPIN_PLACE_M = 1e-3
"""Largest distance between a turn on the spot and its ANGULAR entries."""
_SPRAY_OVERLAP_M = 1e-3


def velocities(trajectory: Trajectory) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Read the LINEAR and the ANGULAR entries of the profile: arc length [m], value [m/s, rad/s].

    Raises:
        CommandRefused: There are none, or one is not finite, negative, out of order or of an unknown kind.
    """
    parameters = trajectory.velocity_profile.parameters
    if not parameters:
        raise CommandRefused("the velocity profile is empty")
    _check_range([p.arc_length for p in parameters], math.inf, "velocity profile")
    linear: list[tuple[float, float]] = []
    angular: list[tuple[float, float]] = []
    for i, p in enumerate(parameters):
        kind = p.velocity.type.value
        if kind not in (VelocityType.LINEAR, VelocityType.ANGULAR):
            raise CommandRefused(f"velocity profile entry {i} is neither LINEAR nor ANGULAR")
        if not (math.isfinite(p.arc_length) and math.isfinite(p.velocity.value)):
            raise CommandRefused(f"velocity profile entry {i} is not finite")
        if kind == VelocityType.LINEAR and p.velocity.value < 0.0:
            raise CommandRefused(f"velocity profile entry {i} is negative ({p.velocity.value:.3f} m/s)")
        (linear if kind == VelocityType.LINEAR else angular).append((p.arc_length, p.velocity.value))
    return linear, angular


def turns_on_the_spot(
    legs: list[Leg], angular: list[tuple[float, float]], segments: tuple[Segment, ...], drive: OnboardDrive
) -> dict[int, TurnInPlace]:
    """Find the turns on the spot, each at the fastest of the ANGULAR entries at its place.

    Args:
        legs: Legs of the path, in order.
        angular: ANGULAR entries: arc length [m], yaw rate [rad/s].
        segments: Segments of the path, to name them in a refusal.
        drive: Drive of the vehicle.

    Returns:
        Turns by the index of their leg.

    Raises:
        CommandRefused: A turn has no such entry or is too fast for the drive, or an entry has no turn.
    """
    turns: dict[int, TurnInPlace] = {}
    places: set[float] = set()
    for index, leg in enumerate(legs):
        if leg.sense != SPIN:
            continue
        name = segment_name(leg.first, segments[leg.first])
        rate = max((abs(value) for s, value in angular if abs(s - leg.start_m) <= SPIN_PLACE_M), default=0.0)
        if rate < MIN_TURN_RADPS:
            raise CommandRefused(f"{name} turns on the spot, but the velocity profile has no ANGULAR speed for it")
        drive.check_spin(name, rate)
        turns[index] = TurnInPlace(leg.turn_rad, rate, drive.spin_acceleration_radps2())
        places.add(leg.start_m)
    for s, _ in angular:
        if not any(abs(s - place) <= SPIN_PLACE_M for place in places):
            raise CommandRefused(
                f"the velocity profile turns on the spot at {s:.3f} m, where the path has no turn on the spot"
            )
    return turns


def check_stops(legs: list[Leg], speeds: NDArray[np.float64], segments: tuple[Segment, ...]) -> None:
    """Check that the profile stands still between two legs.

    Args:
        legs: Legs of the path, in order.
        speeds: (m, 2) arc length [m] and speed [m/s].
        segments: Segments of the path, to name them in a refusal.

    Raises:
        CommandRefused: It does not.
    """
    for leg in legs[1:]:
        speed = float(speed_at(speeds, np.array([leg.start_m]))[0])
        if speed > MAX_CUSP_SPEED_MPS:
            raise CommandRefused(
                f"{segment_name(leg.first, segments[leg.first])} changes direction at {speed:.2f} m/s; "
                f"the velocity profile must be 0 there"
            )


def speed_rows(linear: list[tuple[float, float]], total_m: float) -> NDArray[np.float64]:
    """Make the rows of the speed profile over the whole path.

    Args:
        linear: LINEAR entries: arc length [m], speed [m/s].
        total_m: Length of the path.

    Returns:
        (m, 2) arc length [m] and speed [m/s].

    Raises:
        CommandRefused: The entries are out of order, leave the path, or stand still over a stretch of it.
    """
    rows = list(linear) or [(0.0, 0.0)]
    _check_range([s for s, _ in rows], total_m, "velocity profile")
    if rows[0][0] > 0.0:
        rows.insert(0, (0.0, rows[0][1]))
    if rows[-1][0] < total_m:
        rows.append((total_m, rows[-1][1]))
    for i, (a, b) in enumerate(pairwise(rows)):
        if a[1] == 0.0 and b[1] == 0.0 and b[0] > a[0] + MAX_GAP_M:
            raise CommandRefused(f"the velocity profile stands still from {a[0]:.3f} m to {b[0]:.3f} m (entry {i})")
    return np.array(rows)


def actuation_steps(trajectory: Trajectory, total_m: float) -> tuple[list[float], list[int]]:
    """Read the actuation profile.

    Args:
        trajectory: The message.
        total_m: Length of the path.

    Returns:
        Arc lengths [m] at which the actuation changes, and the actuation from each on.

    Raises:
        CommandRefused: An entry is not finite, out of order or off the path.
    """
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


def speed_at(speeds: NDArray[np.float64], s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate speeds; v² is linear between the rows.

    Args:
        speeds: (m, 2) arc length [m] and speed [m/s].
        s: Arc lengths [m].

    Returns:
        Speeds at `s` [m/s].
    """
    return np.sqrt(np.interp(s, speeds[:, 0], speeds[:, 1] ** 2))


def check_speeds(
    path: NDArray[np.float64], speeds: NDArray[np.float64], segments: tuple[Segment, ...], drive: OnboardDrive
) -> None:
    """Check the speeds on all segments against the drive's limits.

    v² is piecewise linear, so its largest value on a segment is at an entry or at an end of the segment.

    Args:
        path: (n, 7) rows of `path.cut_path`.
        speeds: (m, 2) arc length [m] and speed [m/s].
        segments: Segments of the path, to name them in a refusal.
        drive: Drive of the vehicle.

    Raises:
        CommandRefused: A segment is too fast.
    """
    starts, ends = path[:, 5], path[:, 5] + path[:, 4]
    fastest = np.maximum(speed_at(speeds, starts), speed_at(speeds, ends))
    owner = np.clip(np.searchsorted(starts, speeds[:, 0], side="right") - 1, 0, len(path) - 1)
    np.maximum.at(fastest, owner, np.where(speeds[:, 0] < ends[owner], speeds[:, 1], 0.0))
    drive.check_speeds(fastest, path[:, 3], lambda worst: segment_name(worst, segments[worst]))


def check_spray_speed(speeds: NDArray[np.float64], switch_m: list[float], actuation: list[int], total_m: float) -> None:
    """Check that nothing is sprayed so slowly that it makes a puddle.

    Args:
        speeds: (m, 2) arc length [m] and speed [m/s].
        switch_m: Arc lengths at which the actuation changes.
        actuation: Bit masks of `Actuation` from each of them on.
        total_m: Length of the path.

    Raises:
        CommandRefused: Something is.
    """
    ends = [*switch_m[1:], total_m]
    for start, end, mask in zip(switch_m, ends, actuation, strict=False):
        if not mask & Actuation.VALVE or end <= start:
            continue
        inside = (speeds[:, 0] > start) & (speeds[:, 0] < end)
        slowest = float(min(*speed_at(speeds, np.array([start, end])), *speeds[inside, 1], math.inf))
        middle = float(speed_at(speeds, np.array([0.5 * (start + end)]))[0])
        if (slowest < MIN_SPRAY_SPEED_MPS and bool(inside.any())) or middle < MIN_SPRAY_SPEED_MPS:
            raise CommandRefused(
                f"the plan sprays from {start:.3f} m to {end:.3f} m at less than {MIN_SPRAY_SPEED_MPS} m/s: it would "
                "make a puddle"
            )


def painted_rows(path: NDArray[np.float64], switch_m: list[float], actuation: list[int]) -> NDArray[np.bool_]:
    """Find the rows of the path on which the valve is to be open over more than half of their length.

    It is also opened on the row before a line, early by its delay.

    Args:
        path: (n, 7) rows of `path.cut_path`.
        switch_m: Arc lengths at which the actuation changes.
        actuation: Bit masks of `Actuation` from each of them on.

    Returns:
        (n,) True for such rows.
    """
    starts, ends = path[:, 5], path[:, 5] + path[:, 4]
    sprayed = np.zeros(len(path))
    for start, end, mask in zip(switch_m, [*switch_m[1:], math.inf], actuation, strict=False):
        if mask & Actuation.VALVE:
            sprayed += np.maximum(np.minimum(ends, end) - np.maximum(starts, start), 0.0)
    most: NDArray[np.bool_] = sprayed > 0.5 * path[:, 4]
    return most


def check_spray_direction(
    legs: list[Leg], switch_m: list[float], actuation: list[int], total_m: float, segments: tuple[Segment, ...]
) -> None:
    """Check that only legs driven forward are painted.

    Args:
        legs: Legs of the path, in order.
        switch_m: Arc lengths at which the actuation changes.
        actuation: Bit masks of `Actuation` from each of them on.
        total_m: Length of the path.
        segments: Segments of the path, to name them in a refusal.

    Raises:
        CommandRefused: Another leg is.
    """
    borders = [*switch_m, total_m]
    for (start, end), mask in zip(pairwise(borders), actuation, strict=True):
        if not mask & Actuation.VALVE:
            continue
        for leg in legs:
            if leg.sense == BACKWARD and min(end, leg.end_m) - max(start, leg.start_m) > _SPRAY_OVERLAP_M:
                name = segment_name(leg.first, segments[leg.first])
                raise CommandRefused(f"the plan sprays while driving backward, from {name} on; only forward paints")
            if leg.sense == SPIN and start + _SPRAY_OVERLAP_M < leg.start_m < end - _SPRAY_OVERLAP_M:
                name = segment_name(leg.first, segments[leg.first])
                raise CommandRefused(f"the plan sprays while turning on the spot, at {name}")
