"""Running leg of a trajectory, from which another drive begins: its next stretch as sent, and a stop on it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from touchline.schemas.curves import Curve, spin_rad
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LeavingTrajectory, LinearDirection, PlanOptions, Trajectory, VelocityType
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.driven_part import DrivenPart
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.segments.section import TRANSITION, Section
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.path_grid import course
from touchline.services.planner.speed.timing import SpeedProfile, keeps_entry, speed_profile
from touchline.services.planner.steering.method import CurveEnd

# Default time (s) for which the running trajectory is kept: planning, sending and the robot's check take less.
KEEP_S = 2.0
# A robot brakes with the largest of these fractions of its acceleration that path and wheels allow.
BRAKING_SHARES = (1.0, 0.9, 0.75, 0.6, 0.45, 0.3, 0.2)
# Shorter stretches (m) and slower drives (m/s) count as rest.
LEAST_M, LEAST_MPS = 1e-6, 1e-3


class RunningCurve(NamedTuple):
    """Line or arc of the running leg, and its interval of arc length."""

    curve: Curve
    start_m: float
    end_m: float


@dataclass(frozen=True)
class RunningLeg:
    """Part of the running trajectory up to the next standstill.

    Attributes:
        curves: Curves as travelled.
        direction: +1 forward, −1 backward.
        profile: Speeds of the whole trajectory.
    """

    curves: tuple[RunningCurve, ...]
    direction: int
    profile: SpeedProfile

    @classmethod
    def of(cls, leaving: LeavingTrajectory) -> "RunningLeg":
        """Find the leg that holds the robot's arc length.

        Raises:
            PlanningError: The trajectory has no such arc length, or cannot be read.
        """
        at_m = leaving.arc_length_m
        try:
            legs = list(_legs(leaving.trajectory))
        except ValueError as error:
            raise PlanningError("", "has an unusable leaving.trajectory", f"give the running one: {error}") from error
        for curves, direction in legs:
            if curves[0].start_m - LEAST_M <= at_m < curves[-1].end_m - LEAST_M:
                return cls(curves, direction, _profile(leaving.trajectory))
        raise PlanningError(
            "",
            f"has leaving.arc_length_m = {at_m:g}, where the trajectory to be left has no path to come",
            "give the arc length at which the robot is, or plan from its pose once it stands",
        )

    @property
    def end_m(self) -> float:
        """Arc length of the standstill (m)."""
        return self.curves[-1].end_m

    def part(self, from_m: float, to_m: float) -> DrivenPart:
        """Cut out the stretch between two arc lengths, as sent."""
        cut = [
            (each.curve, max(from_m - each.start_m, 0.0), min(to_m, each.end_m) - each.start_m)
            for each in self.curves
            if each.end_m > from_m + LEAST_M and each.start_m < to_m - LEAST_M
        ]
        sent: list[Sent] = []
        for number, (curve, first_m, last_m) in enumerate(cut):
            x, y, heading, _ = (float(value) for value in curve.at(first_m))
            start = sent[-1].end_m if sent else 0.0
            span = (start, start + last_m - first_m) * 2
            driven = Curve(x, y, heading, curve.curvature_1pm, last_m - first_m)
            sent.append(
                Sent(f"kept{number}", TRANSITION, driven, *span, abs(curve.curvature_1pm), 0.0, None, self.direction)
            )
        pieces = tuple(
            Piece(each.curve.length_m, self.direction * each.curve.curvature_1pm, 0.0, self.direction) for each in sent
        )
        path = PiecePath(self._heading(sent[0].curve), pieces)
        inside = (self.profile.station_m > from_m + LEAST_M) & (self.profile.station_m < to_m - LEAST_M)
        station = np.concatenate(([from_m], self.profile.station_m[inside], [to_m]))
        speed = self.profile.speed_at(station)
        return DrivenPart([Section(TRANSITION, path)], sent, SpeedProfile(station - from_m, speed))

    def _heading(self, curve: Curve) -> PathPose:
        """Pose of the robot at the start of a curve."""
        return PathPose(curve.x_m, curve.y_m, curve.heading_rad + (0.0 if self.direction > 0 else math.pi))

    def end_of(self, part: DrivenPart) -> CurveEnd:
        """Pose, curvature and speed (m/s) at which a part of this leg ends."""
        path = part.sections[-1].path
        return CurveEnd(path.end, path.pieces[-1].curvature_1pm, float(part.speeds.speed_mps[-1]))

    def kept(self, leaving: LeavingTrajectory) -> tuple[DrivenPart, float]:
        """Return the stretch that is kept in any case, and the arc length at its end.

        Raises:
            PlanningError: The time for which it is kept is not usable.
        """
        keep_s = leaving.keep_s or KEEP_S
        if not 0.0 < keep_s < math.inf:
            raise PlanningError("", f"has leaving.keep_s = {leaving.keep_s:g}", "give seconds, or 0 for the default")
        at_m = max(leaving.arc_length_m, self.curves[0].start_m)
        whole = self._to_end(at_m)
        to_m = at_m + whole.speeds.station_at(keep_s)
        if to_m >= self.end_m - LEAST_M or whole.speeds.speed_at(to_m - at_m) < LEAST_MPS:
            return whole, self.end_m
        return self.part(at_m, to_m), to_m

    def stopped(self, from_m: float, vehicle: Vehicle) -> DrivenPart:
        """Stretch from an arc length, at which the robot moves, to the earliest standstill."""
        limits = Limits.of(vehicle, PlanOptions())
        speed_mps = float(self.profile.speed_at(from_m))
        for share in BRAKING_SHARES:
            to_m = from_m + speed_mps**2 / (2.0 * share * limits.acceleration_mps2)
            if to_m >= self.end_m:
                break
            part = self.part(from_m, to_m)
            speeds = speed_profile(course(part.sections, part.sent, (), limits), (), limits, speed_mps)
            if keeps_entry(speeds, speed_mps):
                return DrivenPart(part.sections, part.sent, speeds)
        return self._to_end(from_m)

    def _to_end(self, from_m: float) -> DrivenPart:
        """Stretch up to the standstill, as sent; a law that ends moving gets a stop."""
        part = self.part(from_m, self.end_m)
        speeds = np.append(part.speeds.speed_mps[:-1], 0.0)
        return DrivenPart(part.sections, part.sent, SpeedProfile(part.speeds.station_m, speeds))


def _legs(trajectory: Trajectory) -> Iterator[tuple[tuple[RunningCurve, ...], int]]:
    """Curves between standstills and their direction, without turns on the spot."""
    found: list[RunningCurve] = []
    direction, at_m = 0, 0.0
    for segment in trajectory.path.segments:
        turn = spin_rad(segment.curve)
        sense = 0 if turn is not None else -1 if segment.direction.value == LinearDirection.BACKWARD else 1
        if found and sense != direction:
            yield tuple(found), direction
            found = []
        direction = sense
        if turn is None:
            curve = Curve.from_message(segment.curve)
            found.append(RunningCurve(curve, at_m, at_m + curve.length_m))
            at_m += curve.length_m
    if found:
        yield tuple(found), direction


def _profile(trajectory: Trajectory) -> SpeedProfile:
    """Speeds over arc length.

    Raises:
        PlanningError: The trajectory has no speeds.
    """
    entries = [
        (entry.arc_length, entry.velocity.value)
        for entry in trajectory.velocity_profile.parameters
        if entry.velocity.type.value == VelocityType.LINEAR
    ]
    table: Floats = np.array(entries, dtype=np.float64).reshape(-1, 2)
    if len(table) < 2 or not np.all(np.isfinite(table)) or np.any(np.diff(table[:, 0]) < 0.0):
        raise PlanningError("", "has a leaving.trajectory without speeds", "give the running one, as it was sent")
    return SpeedProfile(table[:, 0], np.maximum(table[:, 1], 0.0))
