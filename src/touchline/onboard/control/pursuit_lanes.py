"""Lane pursuit of a published study on a clay roller, as a baseline: see docs/explanation/onboard.md.

A lane is what is driven in one direction of travel, from edge to edge. Along it the speed is a function of the place
(`lane_profile`), and the robot steers for a point of the path a fixed distance ahead in the direction of travel. In the
robot's frame that point is at (x, y); the circle through it that is tangent to the robot's axis has curvature 2·y/(x² +
y²), ahead or behind. Beyond an edge the path is extended straight, and the point with it.

There is no feed-forward and no integral, so every change of curvature is cut: an S of 5 m by up to 0.7 m.
"""

from __future__ import annotations

import math
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.control.follower import BodyTwist, PathPlace
from touchline.onboard.control.lane_profile import lane_speed_mps
from touchline.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.tracking_state import COMMAND, HEADING_ERROR, LATERAL, REFERENCE_SPEED
from touchline.onboard.trajectory.path import SPIN, Leg
from touchline.onboard.trajectory.path_projection import CREEP_MPS, piece_at, pose_on
from touchline.schemas.onboard import LanePursuit, OnboardConfig
from touchline.schemas.vehicles import Vehicle

STEERED_RAD = 0.02
"""Steering error below which a lane may begin."""

Floats = NDArray[np.float64]


class LaneState(Enum):
    """State of the supervisor."""

    SEARCHING = auto()
    """Looks for the next edge: start and end of the lane, and its direction of travel."""
    INITIALISING = auto()
    """Restarts progress and profile."""
    STABILISING = auto()
    """Stands until the steering has the lane's angle."""
    TRAVELLING = auto()


class LanePursuitFollower:
    """Follower by the study's lane pursuit.

    Attributes:
        state: State of the supervisor.
    """

    name = "pursuit-lanes"
    can_fail = False
    timed = False
    problem = ""

    def __init__(self, vehicle: Vehicle) -> None:
        """Make a follower at rest, with the study's settings."""
        self._settings = LanePursuit()
        self._drive = drive_of(vehicle)
        self._fastest_mps = vehicle.drive.max_speed_mps
        self._turning = PurePursuitFollower(vehicle)
        self.ahead_rows, self.fine_rows = self._turning.ahead_rows, self._turning.fine_rows
        self.fallbacks = 0
        """Always 0: turns on the spot, which the study does not have, are no failures."""
        self.state = LaneState.SEARCHING
        self._path: PathPlace | None = None
        self._lane: Leg | None = None
        self._begun_m = 0.0

    def configure(self, config: OnboardConfig) -> None:
        """See `ConfiguredFollower.configure`."""
        self._settings = config.lane_pursuit

    def take_path(self, path: PathPlace) -> None:
        """See `PathFollower.take_path`."""
        self._path = path
        self.reset()

    def reset(self) -> None:
        """Treat the rest of the lane as a lane of its own."""
        self.state = LaneState.SEARCHING
        self._turning.reset()

    def step(self, now: Floats, ahead: Floats) -> BodyTwist:
        """See `Follower.step`."""
        path = self._path
        if path is None or path.leg.sense == SPIN:
            self.state = LaneState.SEARCHING
            return self._turning.step(now, ahead)
        if self._lane is not path.leg:
            self.state = LaneState.SEARCHING
        if self.state is LaneState.SEARCHING:
            self._lane, self.state = path.leg, LaneState.INITIALISING
        if self.state is LaneState.INITIALISING:
            self._begun_m = path.arc_length_m
            self.state = LaneState.STABILISING if self._settings.steer_first else LaneState.TRAVELLING
        if self.state is LaneState.STABILISING:
            steering = self._steering(path, now)
            if steering is not None:
                return steering
            self.state = LaneState.TRAVELLING
        return self._travel(path, now)

    def _travel(self, path: PathPlace, now: Floats) -> BodyTwist:
        """Compute the twist by the place on the lane; stops and returns, unknown to the lane, have priority."""
        reference, sense = float(now[REFERENCE_SPEED]), path.leg.sense
        if reference * sense < 0.0:
            return BodyTwist(reference, reference * self._curvature(path, now, -1.0))
        place = path.arc_length_m
        speed = min(lane_speed_mps(place - self._begun_m, path.leg.end_m - place, self._settings), self._fastest_mps)
        speed = max(speed, CREEP_MPS) if abs(reference) >= CREEP_MPS else min(speed, abs(reference))
        return BodyTwist(sense * speed, sense * speed * self._curvature(path, now, 1.0))

    def _curvature(self, path: PathPlace, now: Floats, along: float) -> float:
        place, ahead_m = path.arc_length_m, along * self._settings.lookahead_m
        errors = float(now[LATERAL]), float(now[HEADING_ERROR])
        return float(pursuit_curvature_1pm(path.pieces, float(path.leg.sense), place, ahead_m, *errors))

    def _steering(self, path: PathPlace, now: Floats) -> BodyTwist | None:
        """Turn the steering to the lane's angle at standstill; None once it is there, or if nothing steers."""
        figures, commanded = self._drive.figures, now[COMMAND:]
        speed = path.leg.sense * self._settings.min_speed_mps
        curvature = self._curvature(path, now, 1.0)
        wanted = np.array(onboard_drive.actuators_of(figures, speed, speed * curvature, now))
        steers = np.array([onboard_drive.gain(figures, actuator, now)[0] == 0.0 for actuator in range(len(commanded))])
        wanted = np.clip(wanted, -self._drive.limit, self._drive.limit)
        if not np.any(steers & (np.abs(wanted - commanded) >= STEERED_RAD)):
            return None
        next_tick = np.clip(wanted, commanded - self._drive.reach, commanded + self._drive.reach)
        return BodyTwist(0.0, 0.0, tuple(np.where(steers, next_tick, 0.0).tolist()))


@kernel
def pursuit_curvature_1pm(
    pieces: Floats, sense: float, place_m: float, ahead_m: float, lateral_m: float, heading_error_rad: float
) -> float:
    """Compute the curvature of the circle that leads the robot to a point of its path.

    Args:
        pieces: (n, COLUMNS) pieces of the leg, of `smoothing`.
        sense: +1 if the leg is driven forward, −1 if backward.
        place_m: Arc length that the robot has reached.
        ahead_m: Distance from there to the point, along the path; negative if the robot goes back.
        lateral_m: Distance of the robot to the left of the path.
        heading_error_rad: Heading of the robot less the path's.
    """
    piece = piece_at(pieces, 0, place_m)
    x, y, heading = pose_on(pieces, sense, piece, place_m)
    goal_m = place_m + ahead_m
    goal_x, goal_y, _ = pose_on(pieces, sense, piece_at(pieces, piece, goal_m), goal_m)
    east = goal_x - (x - lateral_m * math.sin(heading))
    north = goal_y - (y + lateral_m * math.cos(heading))
    turned = heading + heading_error_rad
    across = -east * math.sin(turned) + north * math.cos(turned)
    curvature: float = 2.0 * across / (east * east + north * north)
    return curvature
