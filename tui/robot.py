"""Latest messages of one robot since it started."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import topics
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.coverage_messages import AreaProgress, AreaReport
from touchline.schemas.messages.obstacle_messages import Obstacles
from touchline.schemas.messages.standard import BatteryState, Clock, Odometry, Time
from touchline.schemas.messages.touchline import (
    AboutToMove,
    GnssStatus,
    PauseStatus,
    SprayerState,
    TraversalReport,
    TraversalStatus,
    TrueCoverage,
    UnfinishedJob,
)
from touchline.schemas.messages.viewing_messages import PolygonStamped
from touchline.schemas.messages.way_round_messages import WayRound
from touchline.schemas.plain_text import plain
from touchline.tui.obstacle_view import ObstacleView, obstacle_views
from touchline.tui.spread import Spread
from touchline.tui.zone_outlines import NO_ZONES, ZoneOutlines, closed_outline

MOVING_MPS = 0.05
"""Speed below which the motion does not show the steering angle."""

BUSY_STATES = (TraversalStatus.RUNNING, TraversalStatus.PAUSED)
HALTED_STATES = (TraversalStatus.PAUSED, TraversalStatus.ESTOPPED, TraversalStatus.ABORTED)
"""States in which a job waits, or was aborted, for a reason."""


@dataclass(frozen=True)
class ShownPose:
    """Pose of the robot's axle centre in the map frame: metres, radians."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass
class Robot:
    """Last messages of a robot; a restarted robot begins with an empty one."""

    sim_time_s: float | None = None
    pose: ShownPose | None = None
    spread: Spread | None = None
    """Uncertainty of its position."""
    status: TraversalStatus | None = None
    truth: TrueCoverage | None = None
    """True paint, reported by emulated robots only."""
    report: TraversalReport | None = None
    area: AreaProgress | None = None
    """True coverage, reported by emulated robots only."""
    area_report: AreaReport | None = None
    motion: tuple[float, float] | None = None
    """Speed (m/s) and yaw rate (rad/s) of the last true motion."""
    gnss: GnssStatus | None = None
    battery: BatteryState | None = None
    sprayer: SprayerState | None = None
    claimed: NDArray[np.float64] | None = None
    """Points (n, 2) along the stretch of its path that others keep off, in metres of the map frame."""
    pause: PauseStatus = field(default_factory=PauseStatus)
    """Cause and end of a pause; the cause is NONE without a pause or a report."""
    warning: AboutToMove = field(default_factory=AboutToMove)
    """Warning before it moves off."""
    obstacles: tuple[ObstacleView, ...] = ()
    """Unknown and missing obstacles that it reported last."""
    obstacles_s: float = -math.inf
    """Sim time of that report."""
    zones: ZoneOutlines = NO_ZONES
    """Zones of its protection that it reported last."""
    zones_s: float = -math.inf
    """Sim time of that report."""
    way_round: WayRound = field(default_factory=WayRound)
    """Its handling of things in its way."""
    planned_drive: int = 0
    """Number of the drive of its job whose plan came last; 0 if unknown."""
    unfinished: UnfinishedJob | None = None
    """Job that it could continue; without a length, there is none."""
    stopped_by: str = ""
    """Reason of the job's first stop; a later emergency stop and reset have changed the status's reason."""

    @property
    def fractions(self) -> dict[str, float]:
        """Painted share 0…1 by segment id, as estimated by the robot."""
        if not self.status:
            return {}
        shares = zip(self.status.painted_ids, self.status.painted_fraction.tolist(), strict=False)
        return {name: min(max(share, 0.0), 1.0) for name, share in shares if math.isfinite(share)}

    @property
    def driven_fraction(self) -> float | None:
        """Driven share of the path 0…1."""
        status = self.status
        if not status or not (status.total_length_m > 0 and math.isfinite(status.arc_length_m)):
            return None
        if status.state == TraversalStatus.DONE:
            return 1.0
        return min(max(status.arc_length_m / status.total_length_m, 0.0), 1.0)

    def _clock(self, message: Clock) -> None:
        self.sim_time_s = seconds(message.clock)

    def _odometry(self, message: Odometry) -> None:
        position, q = message.pose.pose.position, message.pose.pose.orientation
        heading = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        if all(map(math.isfinite, (position.x, position.y, heading))):
            self.pose = ShownPose(position.x, position.y, heading)
            self.spread = Spread.of(message.pose.covariance)
        speed_mps, yaw_rate_radps = message.twist.twist.linear.x, message.twist.twist.angular.z
        if abs(speed_mps) >= MOVING_MPS and math.isfinite(yaw_rate_radps):
            self.motion = speed_mps, yaw_rate_radps

    def _status(self, message: TraversalStatus) -> None:
        before = self.status.state if self.status else None
        if message.state in BUSY_STATES and before not in BUSY_STATES:
            self.report = self.area_report = None
        reason = plain(message.reason)
        if message.state not in HALTED_STATES:
            self.stopped_by = ""
        elif not self.stopped_by:
            self.stopped_by = reason
        self.status = message if reason == message.reason else message.model_copy(update={"reason": reason})

    def _pause(self, message: PauseStatus) -> None:
        self.pause = message

    def _warning(self, message: AboutToMove) -> None:
        self.warning = message

    def _obstacles(self, message: Obstacles) -> None:
        self.obstacles, self.obstacles_s = obstacle_views(message), seconds(message.header.stamp)

    def _stop_zone(self, message: PolygonStamped) -> None:
        self.zones = replace(self.zones, stop=closed_outline(message))
        self.zones_s = seconds(message.header.stamp)

    def _slow_zone(self, message: PolygonStamped) -> None:
        self.zones = replace(self.zones, slow=closed_outline(message))
        self.zones_s = seconds(message.header.stamp)

    def take_plan(self, *, follows: bool) -> bool:
        """Note that a plan has come; return True if it is of the next drive of the same job.

        The robot's count of drives comes before the plan or after it.

        Args:
            follows: Whether the robot had a plan before.
        """
        told = self.way_round
        counted = told.drives > self.planned_drive > 0
        same_job = follows and (counted or told.continues)
        self.planned_drive = told.drives + (same_job and not counted)
        return same_job

    def _way_round(self, message: WayRound) -> None:
        if message.drives < self.way_round.drives or not self.planned_drive:  # of another job, or the first heard
            self.planned_drive = message.drives
        self.way_round = message.model_copy(update={"things": tuple(map(plain, message.things))})

    def _truth(self, message: TrueCoverage) -> None:
        self.truth = message

    def _unfinished(self, message: UnfinishedJob) -> None:
        self.unfinished = message

    def _report(self, message: TraversalReport) -> None:
        self.report = message

    def _area(self, message: AreaProgress) -> None:
        self.area = message

    def _area_report(self, message: AreaReport) -> None:
        self.area_report = message

    def _gnss(self, message: GnssStatus) -> None:
        self.gnss = message

    def _battery(self, message: BatteryState) -> None:
        self.battery = message

    def _sprayer(self, message: SprayerState) -> None:
        self.sprayer = message


ROBOT_TOPICS: Mapping[str, Callable[[Robot, Any], None]] = {
    topics.CLOCK.name: Robot._clock,
    topics.ODOMETRY.name: Robot._odometry,
    topics.STATUS.name: Robot._status,
    topics.PAUSE_STATUS.name: Robot._pause,
    topics.ABOUT_TO_MOVE.name: Robot._warning,
    topics.OBSTACLES.name: Robot._obstacles,
    topics.STOP_ZONE.name: Robot._stop_zone,
    topics.SLOW_ZONE.name: Robot._slow_zone,
    topics.WAY_ROUND.name: Robot._way_round,
    topics.TRUE_COVERAGE.name: Robot._truth,
    topics.UNFINISHED.name: Robot._unfinished,
    topics.REPORT.name: Robot._report,
    topics.AREA.name: Robot._area,
    topics.AREA_REPORT.name: Robot._area_report,
    topics.GNSS_STATUS.name: Robot._gnss,
    topics.BATTERY.name: Robot._battery,
    topics.SPRAYER.name: Robot._sprayer,
}
"""Handlers of the topics about the robot itself."""


def take(robot: Robot, topic: str, message: Message) -> bool:
    """Note a message; false if its topic is not about the robot itself."""
    handler = ROBOT_TOPICS.get(topic)
    if handler is not None:
        handler(robot, message)
    return handler is not None


def seconds(time: Time) -> float:
    """Convert a time stamp to seconds."""
    return time.sec + time.nanosec * 1e-9
