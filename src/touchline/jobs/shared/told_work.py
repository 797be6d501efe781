"""What a robot of a shared job has told of its true way and paint, as the work that is judged."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.bus import Bus
from touchline.bus.inbox import Sample
from touchline.jobs.shared.joint_paint import Work, ledger_of
from touchline.jobs.shared.sightings import Sightings
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
"""Paint is told of within so long."""
_PLACES: Final = {
    "header.stamp.sec": 1,
    "header.stamp.nanosec": 1,
    "pose.pose.position.x": 2,
    "pose.pose.orientation.z": 2,
}


class ToldTruth:
    """What an emulated robot tells of its true way and paint on its errand.

    Attributes:
        sightings: Where it truly was.
        time_s: Sim time of the last of that, on its own clock.
        ahead_s: By so much the clock that all robots share is ahead of that.
    """

    def __init__(self, bus: Bus, vehicle: Vehicle) -> None:
        """Listen; nothing is told yet."""
        self._vehicle = vehicle
        self._told, self._marked = bus.inbox([topics.TRUTH]), bus.inbox([topics.PAINT])
        self.sightings, self.time_s = Sightings(), -math.inf
        self._carried = False
        self._rows: list[Floats] = []
        self._batches: list[PaintMarks] = []
        self._since_s, self.ahead_s = -math.inf, 0.0

    def listen(self) -> None:
        """Take what it has told since."""
        if told := self._told.drain():
            rows = _way(told)
            self._rows.append(rows)
            self.time_s = float(rows[-1, 0])
            if not self._carried:
                sent_s = [1e-9 * sample.source_time_ns for sample in told]
                self.sightings.add(np.column_stack((sent_s, rows[:, 1:])))
        for _, marks in self._marked.messages():
            if isinstance(marks, PaintMarks) and marks.header.stamp.seconds > self._since_s:
                self._batches.append(marks)

    def carry(self) -> None:
        """It is carried from where it was; nobody is in its way meanwhile."""
        self._carried = True
        self.sightings.forget()

    def put_down(self) -> None:
        """It is where its errand begins."""
        self._carried = False

    def begin(self, now_s: float, shared_s: float) -> None:
        """Another errand begins: now by its own clock, and by one that all share."""
        self._since_s, self.ahead_s, self._batches = now_s, shared_s - now_s, []

    def strokes(self) -> list[PaintMarks]:
        """Its paint, as it was told bit by bit."""
        return joined(self._batches)

    def work(self, template: Template, strokes: Sequence[PaintMarks]) -> Work:
        """Its work on the errand, on the clock that all share.

        Args:
            template: What it was to do.
            strokes: All its paint.
        """
        self._rows = [np.concatenate((np.zeros((0, 4)), *self._rows))]
        way = self._rows[0][self._rows[0][:, 0] > self._since_s]
        return told_work(template, self._vehicle, strokes, self._batches, way, self.ahead_s)


def _way(told: Sequence[Sample]) -> Floats:
    """(n, 4) sim time (s), x (m), y (m), heading (rad) of what was told, looked into all at once."""
    payloads = Payloads.of([sample.payload for sample in told])
    sec, nanosec, at, turned = layouts.ODOMETRY.columns(payloads, _PLACES)
    heading = 2.0 * np.arctan2(turned[:, 0], turned[:, 1])
    return np.column_stack((sec[:, 0] + 1e-9 * nanosec[:, 0], at, heading))


def pose_of(place: Odometry) -> tuple[float, float, float]:
    """Where it is: x (m), y (m), heading (rad)."""
    at, turned = place.pose.pose.position, place.pose.pose.orientation
    return at.x, at.y, 2.0 * math.atan2(turned.z, turned.w)


def told_work(
    template: Template,
    vehicle: Vehicle,
    strokes: Sequence[PaintMarks],
    batches: Sequence[PaintMarks],
    way: Floats,
    ahead_s: float = 0.0,
) -> Work:
    """The work of one errand.

    Args:
        template: What the robot was to do on it.
        vehicle: The robot.
        strokes: Whole ones.
        batches: As they were told, each with the time by which it was laid.
        way: (n, 4) where it truly was: sim time (s), x (m), y (m), heading (rad).
        ahead_s: By so much the clock that all share is ahead of the robot's.
    """
    ledger, track = ledger_of(template, vehicle, strokes), Track()
    laid = np.interp(*_counted(batches, way[:, 0]))
    # Points are counted in the ledger as in the robot's, but for those that two strokes have in common.
    lengths = [len(stroke.x_m) for stroke in strokes]
    firsts = np.array([float(stroke.first_index) for stroke in strokes])
    begins = np.concatenate(([0.0], np.cumsum(lengths)))
    robots = np.column_stack((firsts, firsts + lengths)).ravel()
    points = np.interp(laid, robots, np.column_stack((begins[:-1], begins[1:])).ravel()) if lengths else laid
    for (time_s, x, y, heading), count in zip(way.tolist(), points.tolist(), strict=True):
        track.enter(round((time_s + ahead_s) * TICKS_PER_S), (x, y, heading), int(count))
    return Work(ledger, track)


def _counted(batches: Sequence[PaintMarks], times_s: Floats) -> tuple[Floats, Floats, Floats]:
    """For `interp`: times, and times and counts of points of which the robot has told how many were laid by then."""
    told_s, counts = [0.0], [0.0]
    for batch in batches:
        end_s = batch.header.stamp.seconds
        told_s += [max(end_s - _BATCH_S, told_s[-1]), end_s]
        counts += [max(float(batch.first_index), counts[-1]), float(batch.first_index + len(batch.x_m))]
    return times_s, np.array(told_s), np.array(counts)
