"""A trajectory as the robot drives it: checked once at load, then plain arrays."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.core.plain_sum import plain_sum
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.interface import TICK_S, Checkpoint
from touchline.onboard.trajectory.path import Leg, cut_path, pose_at
from touchline.onboard.trajectory.profiles import (
    actuation_steps,
    check_speeds,
    check_spray_direction,
    check_spray_speed,
    check_stops,
    painted_rows,
    speed_at,
    speed_rows,
    turns_on_the_spot,
    velocities,
)
from touchline.onboard.trajectory.smoothing import smooth_leg
from touchline.onboard.trajectory.turn import TurnInPlace
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Actuation, Trajectory
from touchline.schemas.swath_ids import area_id_of
from touchline.schemas.vehicles import Vehicle


@dataclass(frozen=True)
class LoadedTrajectory:
    """Checked trajectory as arrays: path, speeds, actuation and times.

    Attributes:
        path: (n, 7) rows of `path.cut_path`, one per segment.
        legs: Parts that are driven without stopping, in order.
        pieces: (m, COLUMNS) of `smoothing.smooth_leg` by leg, which the robot follows.
        turns: Turns on the spot, by index of their leg.
        speeds: (m, 2) arc length [m] and speed [m/s]; v² is linear in between.
        times_s: (m,) time at each of these arc lengths, without turns on the spot.
        switch_m: Arc lengths at which the actuation changes, ascending.
        actuation: Actuation from each of them on.
        ids: Segment ids in path order.
        total_length_m: Arc length of the whole path.
        total_time_s: Driving time at the profile's speeds.
    """

    path: NDArray[np.float64]
    legs: list[Leg]
    pieces: list[NDArray[np.float64]]
    turns: dict[int, TurnInPlace]
    speeds: NDArray[np.float64]
    times_s: NDArray[np.float64]
    switch_m: list[float]
    actuation: list[int]
    ids: list[str]
    total_length_m: float
    total_time_s: float

    def actuation_at(self, arc_length_m: float) -> int:
        """Return the bit mask of `Actuation` at an arc length; nothing before the first entry."""
        index = bisect.bisect_right(self.switch_m, arc_length_m) - 1
        return self.actuation[index] if index >= 0 else Actuation.NONE

    def first_spray_between(self, from_m: float, to_m: float) -> float | None:
        """Find the first arc length at which the plan sprays; None if it does not.

        Args:
            from_m: Arc length at which the search begins.
            to_m: Arc length at which it ends.
        """
        if self.actuation_at(from_m) & Actuation.VALVE:
            return from_m
        for index in range(bisect.bisect_right(self.switch_m, from_m), len(self.switch_m)):
            if self.switch_m[index] > to_m:
                return None
            if self.actuation[index] & Actuation.VALVE:
                return self.switch_m[index]
        return None

    @property
    def works(self) -> bool:
        """True if anything is worked on along the path: it is actuated, or a segment is a swath of an area."""
        return self.works_beyond(0.0) or any(area_id_of(each) for each in self.ids)

    def works_beyond(self, arc_length_m: float) -> bool:
        """Return True if the plan actuates anything from an arc length on."""
        return bool(self.actuation_at(arc_length_m)) or any(
            self.actuation[bisect.bisect(self.switch_m, arc_length_m) :]
        )

    def speed_at(self, arc_length_m: float) -> float:
        """Return the planned speed [m/s] at an arc length."""
        return float(speed_at(self.speeds, np.array([arc_length_m]))[0])

    def distance_m(self, arc_length_m: float, seconds: float) -> float:
        """Compute the distance that the profile's speeds cover before an arc length of a leg.

        Args:
            arc_length_m: Arc length at the end of the distance.
            seconds: Time to cover it.
        """
        distance_m = 0.0
        for _ in range(round(seconds / TICK_S)):
            distance_m += TICK_S * self.speed_at(arc_length_m - distance_m)
        return distance_m

    def time_at(self, arc_length_m: float, leg: int) -> float:
        """Compute the time [s] from the start to an arc length at the profile's speeds.

        Args:
            arc_length_m: Arc length of the path.
            leg: Index of the leg; its own turn on the spot is not included.
        """
        s, v = self.speeds[:, 0], self.speeds[:, 1]
        i = min(max(int(np.searchsorted(s, arc_length_m, side="right")) - 1, 0), len(s) - 2)
        (begin_m, end_m), (v_begin, v_end) = s[i : i + 2].tolist(), v[i : i + 2].tolist()
        span = end_m - begin_m
        ds = min(max(arc_length_m - begin_m, 0.0), span)
        squared = v_begin * v_begin + (v_end * v_end - v_begin * v_begin) * (ds / span if span > 0.0 else 0.0)
        pace = v_begin + math.sqrt(max(squared, 0.0))
        turned_s = plain_sum(turn.time_s for index, turn in self.turns.items() if index < leg)
        return float(self.times_s[i] + (2.0 * ds / pace if pace > 0.0 else 0.0)) + turned_s


def load_trajectory(trajectory: Trajectory, vehicle: Vehicle) -> LoadedTrajectory:
    """Check a trajectory and convert it to arrays.

    Args:
        trajectory: Path, speeds and actuation.
        vehicle: Vehicle that is to drive it.

    Raises:
        CommandRefused: It cannot be driven; the reason names the segment or profile entry.
    """
    segments = trajectory.path.segments
    if not segments:
        raise CommandRefused("the trajectory has no segments")
    drive = drive_of(vehicle)
    path, legs = cut_path(segments, vehicle)
    total = float(path[-1, 4] + path[-1, 5])
    linear, angular = velocities(trajectory)
    turns = turns_on_the_spot(legs, angular, segments, drive)
    speeds = speed_rows(linear, total)
    check_stops(legs, speeds, segments)
    switch_m, actuation = actuation_steps(trajectory, total)
    check_speeds(path, speeds, segments, drive)
    check_spray_speed(speeds, switch_m, actuation, total)
    check_spray_direction(legs, switch_m, actuation, total, segments)
    pace = speeds[1:, 1] + speeds[:-1, 1]
    times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(speeds[:, 0]) / np.where(pace > 0.0, pace, 1.0))))
    ids = [segment.id for segment in segments]
    total_time_s = float(times[-1]) + plain_sum(turn.time_s for turn in turns.values())
    painted = painted_rows(path, switch_m, actuation)
    pieces = [np.ascontiguousarray(smooth_leg(path, leg, painted)) for leg in legs]
    return LoadedTrajectory(path, legs, pieces, turns, speeds, times, switch_m, actuation, ids, total, total_time_s)


def resume_pose(trajectory: Trajectory, vehicle: Vehicle, checkpoint: Checkpoint) -> tuple[float, float, float]:
    """Compute the robot's pose at a checkpoint.

    Args:
        trajectory: Trajectory that the checkpoint is of.
        vehicle: Vehicle that drives it.
        checkpoint: Leg and arc length.

    Returns:
        x [m], y [m], map frame, and heading [rad].

    Raises:
        CommandRefused: The trajectory has no such leg.
    """
    path, legs = cut_path(trajectory.path.segments, vehicle)
    if not 0 <= checkpoint.leg < len(legs):
        raise CommandRefused(f"cannot resume on leg {checkpoint.leg}: the path has no such place")
    return pose_at(path, legs[checkpoint.leg], checkpoint.arc_length_m)
