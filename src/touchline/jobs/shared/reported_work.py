"""True path and paint that a robot of a shared job reports, as work to be evaluated."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.bus import Bus
from touchline.bus.inbox import Sample
from touchline.jobs.shared.joint_paint import Work, ledger_of
from touchline.jobs.shared.pose_history import PoseHistory
from touchline.jobs.single.recorded_paint import joined
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas import topics
from touchline.schemas.layout import Payloads
from touchline.schemas.messages import Odometry, PaintMarks
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim import layouts
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.tick_log import period

Floats = NDArray[np.float64]

_BATCH_S: Final = period(topics.PAINT) / TICKS_PER_S
"""Time within which paint is reported."""
_PLACES: Final = {
    "header.stamp.sec": 1,
    "header.stamp.nanosec": 1,
    "pose.pose.position.x": 2,
    "pose.pose.orientation.z": 2,
}


class ReportedTruth:
    """True path and paint reported during an assignment of an emulated robot.

    Attributes:
        poses: Its true poses.
        time_s: Sim time of the last report, on its own clock.
        ahead_s: Lead of the clock that all robots share.
    """

    def __init__(self, bus: Bus, vehicle: Vehicle) -> None:
        """Subscribe; nothing is reported yet."""
        self._vehicle = vehicle
        self._truth, self._marked = bus.inbox([topics.TRUTH]), bus.inbox([topics.PAINT])
        self.poses, self.time_s = PoseHistory(), -math.inf
        self._carried = False
        self._rows: list[Floats] = []
        self._batches: list[PaintMarks] = []
        self._since_s, self.ahead_s = -math.inf, 0.0

    def listen(self) -> None:
        """Collect reports that have arrived since the last call."""
        if samples := self._truth.drain():
            rows = _poses(samples)
            self._rows.append(rows)
            self.time_s = float(rows[-1, 0])
            if not self._carried:
                sent_s = [1e-9 * sample.source_time_ns for sample in samples]
                self.poses.add(np.column_stack((sent_s, rows[:, 1:])))
        for _, marks in self._marked.messages():
            if isinstance(marks, PaintMarks) and marks.header.stamp.seconds > self._since_s:
                self._batches.append(marks)

    def carry(self) -> None:
        """Note that the robot is being carried; it obstructs nobody meanwhile."""
        self._carried = True
        self.poses.forget()

    def put_down(self) -> None:
        """Note that the robot is where its assignment begins."""
        self._carried = False

    def begin(self, now_s: float, shared_s: float) -> None:
        """Begin another assignment now.

        Args:
            now_s: Present time by the robot's own clock.
            shared_s: Present time by the shared clock.
        """
        self._since_s, self.ahead_s, self._batches = now_s, shared_s - now_s, []

    def strokes(self) -> list[PaintMarks]:
        """Return the robot's paint, from the reported batches."""
        return joined(self._batches)

    def drives(self, template: Template, ends_s: Sequence[float]) -> list[tuple[list[PaintMarks], Work]]:
        """Return strokes and work of several drives, one after another since `begin`.

        Args:
            template: Template of all of them.
            ends_s: Sim time at which the report of each was made.
        """
        path, found = np.concatenate((np.zeros((0, 4)), *self._rows)), list[tuple[list[PaintMarks], Work]]()
        for from_s, to_s in zip([self._since_s, *ends_s[:-1]], ends_s, strict=True):
            batches = [each for each in self._batches if from_s < each.header.stamp.seconds <= to_s]
            strokes, own = joined(batches), path[(path[:, 0] > from_s) & (path[:, 0] <= to_s)]
            found.append((strokes, reported_work(template, self._vehicle, strokes, batches, own)))
        return found

    def work(self, template: Template, strokes: Sequence[PaintMarks]) -> Work:
        """Return the robot's work on the assignment, on the shared clock.

        Args:
            template: The assigned template.
            strokes: All its paint.
        """
        self._rows = [np.concatenate((np.zeros((0, 4)), *self._rows))]
        path = self._rows[0][self._rows[0][:, 0] > self._since_s]
        return reported_work(template, self._vehicle, strokes, self._batches, path, self.ahead_s)


def _poses(samples: Sequence[Sample]) -> Floats:
    """Return (n, 4) sim time (s), x (m), y (m), heading (rad), decoded all at once."""
    payloads = Payloads.of([sample.payload for sample in samples])
    sec, nanosec, at, turned = layouts.ODOMETRY.columns(payloads, _PLACES)
    heading = 2.0 * np.arctan2(turned[:, 0], turned[:, 1])
    return np.column_stack((sec[:, 0] + 1e-9 * nanosec[:, 0], at, heading))


def pose_of(place: Odometry) -> tuple[float, float, float]:
    """Return the pose in odometry: x (m), y (m), heading (rad)."""
    at, turned = place.pose.pose.position, place.pose.pose.orientation
    return at.x, at.y, 2.0 * math.atan2(turned.z, turned.w)


def reported_work(
    template: Template,
    vehicle: Vehicle,
    strokes: Sequence[PaintMarks],
    batches: Sequence[PaintMarks],
    path: Floats,
    ahead_s: float = 0.0,
) -> Work:
    """Return the work of one assignment.

    Args:
        template: The assigned template.
        vehicle: The robot's vehicle.
        strokes: Whole strokes.
        batches: The strokes as reported, each batch with the time by which it was laid.
        path: (n, 4) true poses: sim time (s), x (m), y (m), heading (rad).
        ahead_s: Lead of the shared clock over the robot's.
    """
    ledger, track = ledger_of(template, vehicle, strokes), Track()
    laid = np.interp(*_counted(batches, path[:, 0]))
    # Points are counted in the ledger as in the robot's, except for those that two strokes have in common.
    lengths = [len(stroke.x_m) for stroke in strokes]
    firsts = np.array([float(stroke.first_index) for stroke in strokes])
    begins = np.concatenate(([0.0], np.cumsum(lengths)))
    robots = np.column_stack((firsts, firsts + lengths)).ravel()
    points = np.interp(laid, robots, np.column_stack((begins[:-1], begins[1:])).ravel()) if lengths else laid
    for (time_s, x, y, heading), count in zip(path.tolist(), points.tolist(), strict=True):
        track.enter(round((time_s + ahead_s) * TICKS_PER_S), (x, y, heading), int(count))
    return Work(ledger, track)


def _counted(batches: Sequence[PaintMarks], times_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Return times, and times and counts for `interp`: numbers of points that were reported as laid by then."""
    reported_s, counts = [0.0], [0.0]
    for batch in batches:
        end_s = batch.header.stamp.seconds
        reported_s += [max(end_s - _BATCH_S, reported_s[-1]), end_s]
        counts += [max(float(batch.first_index), counts[-1]), float(batch.first_index + len(batch.x_m))]
    return times_s, np.array(reported_s), np.array(counts)
