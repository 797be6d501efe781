"""Fake robot that reports a half-painted pitch, and records when an emergency stop reaches it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from touchline.bus import Bus, HealthReporter, Publisher
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template

REFUSED = m.CommandResponse(success=False, message="cannot reset while running; only while emergency-stopped")
TOLD = (
    topics.STATUS,
    topics.CLOCK,
    topics.ODOMETRY,
    topics.PAINT,
    topics.EVENTS,
    topics.TEMPLATE,
    topics.TRUE_COVERAGE,
)


class TalkingRobot:
    """Fake robot that reports its state, some paint and the same event ten times a second; call `turn` in a loop."""

    def __init__(self, bus: Bus, log_entries: int) -> None:
        """Create the robot with a number of entries in the event log."""
        self._template = load_template("soccer-11")
        self._strokes = self._painted()
        self._health = HealthReporter(bus)
        self._publishers: dict[topics.Topic, Publisher] = {topic: bus.publisher(topic) for topic in TOLD}
        self._estop = bus.serve(topics.ESTOP)
        self._paint = bus.serve(topics.GET_PAINT)
        others = (topics.RESET, topics.PAUSE, topics.RESUME, topics.START)
        self._others = [bus.serve(service) for service in others]
        self._index = sum(len(stroke.x_m) - 1 for stroke in self._strokes) + 1
        self._due_s, self._tick = 0.0, 0
        self._log_entries = log_entries
        self._stopped_until_s = 0.0
        self.repeats = False
        """Whether an event repeats every tenth of a second."""
        self.stopped: Callable[[str, float], Any] = lambda _request_id, _at_s: None
        """Called with the request id and the time of every emergency stop that comes in."""

    def publish_all(self) -> None:
        """Publish the latched topics and the log."""
        self._say(topics.TEMPLATE, m.String(data=self._template.model_dump_json()))
        for number in range(self._log_entries):
            self._say(topics.EVENTS, self._event(f"entry {number} of a long day on the pitch, such as there are many"))
            if number % 100 == 0:
                time.sleep(0.05)

    def turn(self) -> None:
        """Serve pending requests, and publish due messages."""
        while (call := self._estop.poll()) is not None:
            now_s = time.monotonic()
            self._stopped_until_s = now_s + 0.4
            self.stopped(call.request_id, now_s)
            self._say(topics.STATUS, self._status())
            call.reply(m.CommandResponse(success=True, message="done"))
        while (paint := self._paint.poll()) is not None:
            paint.reply(m.GetPaintResponse(strokes=tuple(self._strokes)))
        for server in self._others:
            while (other := server.poll()) is not None:
                other.reply(REFUSED)
        self._health.poll({"speed_factor": 1.0, "real_time_factor": 1.0})
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + 0.1
            self._tell()

    def _tell(self) -> None:
        self._tick += 1
        angle = self._tick / 30
        turn = m.Quaternion(z=math.sin(angle / 2), w=math.cos(angle / 2))
        pose = m.Pose(position=m.Point(x=20 * math.cos(angle), y=20 * math.sin(angle)), orientation=turn)
        self._say(topics.CLOCK, m.Clock(clock=m.Time(sec=self._tick // 10)))
        self._say(topics.ODOMETRY, m.Odometry(pose=m.PoseWithCovariance(pose=pose)))
        self._say(topics.STATUS, self._status())
        self._say(topics.TRUE_COVERAGE, self._truth())
        x_m = 20 * np.cos(angle + np.linspace(0, 0.03, 3))
        y_m = 20 * np.sin(angle + np.linspace(0, 0.03, 3))
        marks = m.PaintMarks(segment_id="more", first_index=self._index, width_m=0.12, x_m=x_m, y_m=y_m)
        self._strokes.append(marks)
        self._index += 2
        self._say(topics.PAINT, marks)
        if self.repeats:
            self._say(topics.EVENTS, self._event("position float: valve closed"))

    def _status(self) -> m.TraversalStatus:
        segments = self._template.segments
        stopped = time.monotonic() < self._stopped_until_s
        return m.TraversalStatus(
            state=m.TraversalStatus.ESTOPPED if stopped else m.TraversalStatus.RUNNING,
            segment_id=segments[0].id,
            segment_count=len(segments),
            arc_length_m=float(self._tick),
            total_length_m=2400.0,
            speed_mps=1.0,
            coverage_pct=50.0,
            painted_ids=tuple(segment.id for segment in segments),
            painted_fraction=[0.5] * len(segments),
        )

    def _truth(self) -> m.TrueCoverage:
        segments = self._template.segments
        return m.TrueCoverage(
            coverage_pct=50.0,
            painted_ids=tuple(segment.id for segment in segments),
            painted_fraction=[0.5] * len(segments),
        )

    def _event(self, text: str) -> m.Event:
        return m.Event(severity=m.Event.WARN, source=topics.ROBOT_SIM, text=text)

    def _painted(self) -> list[m.PaintMarks]:
        strokes, index = [], 0
        for segment in self._template.segments:
            curve = segment.curve()
            x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, max(int(curve.length_m / 0.01), 2)))
            strokes.append(m.PaintMarks(segment_id=segment.id, first_index=index, width_m=0.12, x_m=x, y_m=y))
            index += len(x)
        return strokes

    def _say(self, topic: topics.Topic, message: m.Message) -> None:
        self._publishers[topic].send(message)


def serve(robot: TalkingRobot, stop: threading.Event) -> None:
    """Run the robot until `stop` is set."""
    while not stop.is_set():
        robot.turn()
        time.sleep(0.0005)
