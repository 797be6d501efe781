"""A link without a bus, and the situations an operator meets, made of the messages that would tell of them."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages.base import Message
from touchline.schemas.template import Template
from touchline.schemas.topics import Service, Topic
from touchline.tui.protocol import CallFailed, Incoming, Link, NodeChanged, PaintFetched, Received

Answer = Message | CallFailed | Callable[[Message], Message]


@dataclass
class FakeLink:
    """Hands out what a test puts in, records what is asked, and answers as it is told to.

    An emergency stop that is answered `stops` the robot: its status says so.
    """

    incoming: list[Incoming] = field(default_factory=list)
    asked: list[tuple[str, Any]] = field(default_factory=list)
    posted: list[tuple[str, Any]] = field(default_factory=list)
    at_door: list[tuple[str, Any]] = field(default_factory=list)
    answers: dict[str, Answer] = field(default_factory=dict)
    fetches: int = 0
    held: threading.Event | None = None
    stops: bool = True
    closely: bool = False
    name: str = "tt2"
    found_yet: bool = False

    def found(self) -> list[tuple[str, Link]]:
        """It is the link to the only robot."""
        found, self.found_yet = [] if self.found_yet else [(self.name, self)], True
        return found

    def team(self) -> m.TeamCells | None:
        return None

    def queue(self) -> str | None:
        return None

    def poll(self) -> list[Incoming]:
        events, self.incoming = self.incoming, []
        return events

    def call(self, service: Service[Any, Any], request: Message, timeout_s: float) -> Message:
        self.asked.append((service.name, request))
        if self.held is not None:
            self.held.wait(60)
        answer = self.answers.get(service.name)
        if isinstance(answer, CallFailed):
            raise answer
        if callable(answer):
            answer = answer(request)
        if service is topics.ESTOP and self.stops:
            self.incoming.append(received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.ESTOPPED)))
        return answer or service.response(success=True)

    def post(self, service: Service[Any, Any], request: Message) -> None:
        self.posted.append((service.name, request))

    def repeat_at_door(self, service: Service[Any, Any], request: Message, called_off: threading.Event) -> None:
        self.at_door.append((service.name, request))

    def attend(self, *, closely: bool) -> None:
        self.closely = closely

    def fetch_paint(self) -> None:
        self.fetches += 1
        self.incoming.append(PaintFetched(()))

    def names(self) -> list[str]:
        return [name for name, _ in self.asked]


@dataclass
class FakeLinks:
    """Links by name; those that a test adds later are found later."""

    links: dict[str, FakeLink]
    reported: set[str] = field(default_factory=set)
    team_says: list[m.TeamCells] = field(default_factory=list)
    queue_says: list[str] = field(default_factory=list)

    def team(self) -> m.TeamCells | None:
        return self.team_says.pop() if self.team_says else None

    def queue(self) -> str | None:
        return self.queue_says.pop() if self.queue_says else None

    def found(self) -> list[tuple[str, Link]]:
        new = [(name, link) for name, link in self.links.items() if name not in self.reported]
        self.reported |= {name for name, _ in new}
        return list(new)


def received(topic: Topic, message: Message, publisher: str = "robot-1") -> Received:
    return Received(topic.name, message, publisher)


def header(time_s: float = 0.0) -> m.Header:
    sec = int(time_s)
    return m.Header(stamp=m.Time(sec=sec, nanosec=round((time_s - sec) * 1e9)), frame_id="map")


def up(*nodes: str) -> list[Incoming]:
    return [NodeChanged(node, True) for node in nodes or (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)]


def pitch() -> Template:
    return load_template("soccer-11")


def line_segment(name: str, label: str, start: tuple[float, float], end: tuple[float, float]) -> m.Segment:
    points = m.Point(x=start[0], y=start[1]), m.Point(x=end[0], y=end[1])
    line = m.Line(start=points[0], end=points[1])
    curve = m.CurveMessage(type=m.CurveType(value=m.CurveType.LINE), line=(line,))
    return m.Segment(id=name, label=label, curve=curve, direction=m.LinearDirection(value=1))


def trajectory(template: Template) -> m.Trajectory:
    """The template's own lines with straight hops between them: no robot could drive it, but it looks like a plan."""
    segments: list[m.Segment] = []
    at: tuple[float, float] | None = None
    for index, segment in enumerate(template.segments):
        curve = segment.curve()
        if at is not None:
            segments.append(line_segment(f"t{index}", "transition", at, (curve.x_m, curve.y_m)))
        segments.append(
            m.Segment(
                id=segment.id, label=segment.label, curve=curve.to_message(), direction=m.LinearDirection(value=1)
            )
        )
        at = curve.end[:2]
    return m.Trajectory(path=m.Path(segments=tuple(segments)))


def plan_response(template: Template) -> m.PlanResponse:
    report = m.PlanReport(
        paint_length_m=template.length_m,
        transition_length_m=812.0,
        total_length_m=template.length_m + 812.0,
        total_time_s=1583.0,
        painted_segments=len(template.segments),
        transitions=len(template.segments) - 1,
    )
    return m.PlanResponse(success=True, trajectory=trajectory(template), report=report)


def status(template: Template, state: int, done: int = 0, share: float = 0.0, **fields: Any) -> m.TraversalStatus:
    """`done` segments are painted, and `share` of the next."""
    n = len(template.segments)
    fractions = [1.0] * done + ([share] if done < n else []) + [0.0] * max(n - done - 1, 0)
    current = template.segments[min(done, n - 1)]
    values: dict[str, Any] = {
        "state": state,
        "segment_index": min(2 * done, 2 * n - 2),
        "segment_count": 2 * n - 1,
        "segment_id": current.id,
        "total_length_m": 2400.0,
        "arc_length_m": 2400.0 * (done + share) / n,
        "coverage_pct": 100.0 * (done + share) / n,
        "painted_ids": tuple(segment.id for segment in template.segments),
        "painted_fraction": fractions[:n],
    }
    return m.TraversalStatus(**(values | fields))


def truth(template: Template, done: int, share: float = 0.0, lateral_m: float = 0.003) -> m.TrueCoverage:
    """A little less is painted than the robot believes."""
    coverage_pct = 99.8 * (done + share) / len(template.segments)
    return m.TrueCoverage(coverage_pct=coverage_pct, lateral_error_m=lateral_m, flowing=share > 0)


def strokes(template: Template, done: int, share: float = 0.0) -> list[m.PaintMarks]:
    """The paint of `done` segments and of `share` of the next."""
    marks: list[m.PaintMarks] = []
    index = 0
    for number, segment in enumerate(template.segments[: done + (share > 0)]):
        curve = segment.curve()
        length = curve.length_m * (1.0 if number < done else share)
        x, y, _, _ = curve.at(np.linspace(0.0, length, max(int(length / 0.05), 2)))
        marks.append(m.PaintMarks(segment_id=segment.id, first_index=index, width_m=0.12, x_m=x, y_m=y))
        index += len(x)
    return marks


def odometry(x_m: float, y_m: float, heading_rad: float) -> m.Odometry:
    turn = m.Quaternion(z=math.sin(heading_rad / 2), w=math.cos(heading_rad / 2))
    pose = m.Pose(position=m.Point(x=x_m, y=y_m), orientation=turn)
    return m.Odometry(pose=m.PoseWithCovariance(pose=pose))


def diagnostics(node: str, message: str = "ok", **values: object) -> m.DiagnosticArray:
    pairs = tuple(m.KeyValue(key=key, value=str(value)) for key, value in values.items())
    return m.DiagnosticArray(status=(m.DiagnosticStatus(name=node, message=message, values=pairs),))


def event(time_s: float, severity: int, text: str, source: str = topics.ROBOT_SIM) -> Received:
    return received(topics.EVENTS, m.Event(header=header(time_s), severity=severity, source=source, text=text))


def robot_health(battery: float = 0.83, tank_l: float = 13.4, valve: bool = False) -> list[Incoming]:
    sprayer = m.SprayerState(valve_open=valve, disc_down=valve, tank_l=tank_l)
    gnss = m.GnssStatus(fix=m.GnssStatus.FIXED, satellites=24, horizontal_accuracy_m=0.011)
    return [
        received(topics.GNSS_STATUS, gnss),
        received(topics.BATTERY, m.BatteryState(percentage=battery)),
        received(topics.SPRAYER, sprayer),
    ]


def loaded(template: Template) -> list[Incoming]:
    """Everything is up, and the robot has a plan."""
    return [
        *up(),
        received(topics.DIAGNOSTICS, diagnostics(topics.PLANNER)),
        received(topics.DIAGNOSTICS, diagnostics(topics.BRIDGE, "recording: 41,288 messages")),
        received(topics.DIAGNOSTICS, diagnostics(topics.ROBOT_SIM, speed_factor=20.0, real_time_factor=19.8)),
        received(topics.TEMPLATE, m.String(data=template.model_dump_json())),
        received(topics.PLAN, trajectory(template)),
        received(topics.STATUS, status(template, m.TraversalStatus.READY)),
        *robot_health(battery=0.97, tank_l=20.0),
    ]


def mid_run(template: Template, done: int = 14, share: float = 0.55) -> list[Incoming]:
    """The robot paints."""
    curve = template.segments[done].curve()
    x, y, heading, _ = curve.at(curve.length_m * share)
    # The nozzle is on the line, the axle to its left.
    pose = odometry(float(x) - 0.41124 * math.sin(heading), float(y) + 0.41124 * math.cos(heading), float(heading))
    fields = {"speed_mps": 1.0, "elapsed_s": 754.0, "remaining_s": 431.0, "lateral_error_m": 0.004, "spraying": True}
    return [
        *loaded(template),
        PaintFetched(tuple(strokes(template, done, share))),
        received(topics.CLOCK, m.Clock(clock=m.Time(sec=754))),
        received(topics.STATUS, status(template, m.TraversalStatus.RUNNING, done, share, **fields)),
        received(topics.TRUE_COVERAGE, truth(template, done, share)),
        received(topics.ODOMETRY, pose),
        *robot_health(valve=True),
        event(0.0, m.Event.INFO, "traversal started"),
        event(412.3, m.Event.WARN, "position float for 1.2 s: valve closed"),
        event(413.5, m.Event.INFO, "position fixed again: painting goes on"),
    ]


def standing() -> list[Incoming]:
    """The robot has no job, and stands at (1 m, 2 m), heading 0.5 rad."""
    return [
        *up(),
        received(topics.DIAGNOSTICS, diagnostics(topics.ROBOT_SIM)),
        received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.IDLE)),
        received(topics.ODOMETRY, odometry(1.0, 2.0, 0.5)),
    ]


def uncertain(x_m: float = 1.0) -> list[Incoming]:
    """The same robot, having driven by its wheels alone for a while: 0.9 m × 0.3 m, 3σ."""
    odometry_here = odometry(x_m, 2.0, 0.0)
    covariance = np.diag([0.3**2, 0.1**2, 0.0, 0.0, 0.0, 0.0]).ravel()
    pose = odometry_here.pose.model_copy(update={"covariance": covariance})
    return [received(topics.ODOMETRY, odometry_here.model_copy(update={"pose": pose}))]


def drive_response() -> m.PlanResponse:
    """A drive to (9 m, 2 m), heading east."""
    segments = (line_segment("g0", "transition", (1.0, 2.0), (9.0, 2.0)),)
    return m.PlanResponse(
        success=True,
        message="to the goal: 8.00 m, 19.50 s; dubins instead of g2: it was shorter",
        trajectory=m.Trajectory(path=m.Path(segments=segments)),
        report=m.PlanReport(total_length_m=8.0, transition_length_m=8.0, total_time_s=19.5),
    )


def on_the_drive(state: int = m.TraversalStatus.RUNNING, arc_length_m: float = 3.0, **fields: Any) -> list[Incoming]:
    """The robot's messages about that drive, this far along it."""
    values = {"total_length_m": 8.0, "segment_count": 1, "remaining_s": 12.0, "speed_mps": 0.4}
    told = m.TraversalStatus(state=state, arc_length_m=arc_length_m, **(values | fields))
    return [
        received(topics.TEMPLATE, m.String()),
        received(topics.PLAN, drive_response().trajectory),
        received(topics.STATUS, told),
        received(topics.ODOMETRY, odometry(1.0 + arc_length_m, 2.0, 0.0)),
    ]


def leaving_response() -> m.PlanResponse:
    """From amid that drive, 4 m along it, to (9 m, 5 m)."""
    kept = line_segment("kept0", "transition", (5.0, 2.0), (6.0, 2.0))
    segments = (kept, line_segment("g0", "transition", (6.0, 2.0), (9.0, 5.0)))
    return m.PlanResponse(
        success=True,
        message="to the goal: 5.24 m, 14.00 s",
        trajectory=m.Trajectory(path=m.Path(segments=segments)),
        report=m.PlanReport(total_length_m=5.24, transition_length_m=5.24, total_time_s=14.0),
    )


def finished(template: Template) -> list[Incoming]:
    """All is painted, and the figures are there."""
    n = len(template.segments)
    report = m.TraversalReport(
        success=True,
        total_time_s=1583.0,
        coverage_pct=99.87,
        area_coverage_pct=96.42,
        tolerance_m=0.03,
        within_tolerance_pct=99.81,
        paint_accepted=True,
        gap_m=0.12,
        overspray_m2=0.43,
        lateral_error_mean_m=0.003,
        lateral_error_p95_m=0.009,
    )
    fields = {"elapsed_s": 1583.0}
    covered = truth(template, n).model_copy(update={"coverage_pct": 99.87})
    return [
        *mid_run(template),
        PaintFetched(tuple(strokes(template, n))),
        received(topics.CLOCK, m.Clock(clock=m.Time(sec=1583))),
        received(topics.STATUS, status(template, m.TraversalStatus.DONE, n, **fields)),
        received(topics.TRUE_COVERAGE, covered),
        received(topics.REPORT, report),
        *robot_health(battery=0.76, tank_l=7.3),
        event(1583.0, m.Event.INFO, "traversal done"),
    ]


def estopped(template: Template) -> list[Incoming]:
    """The operator pressed the key."""
    fields = {"reason": "emergency stop by the operator", "elapsed_s": 754.0, "remaining_s": 431.0}
    return [
        *mid_run(template),
        received(topics.STATUS, status(template, m.TraversalStatus.ESTOPPED, 14, 0.55, **fields)),
        *robot_health(valve=False),
        event(754.2, m.Event.ERROR, "emergency stop by the operator"),
    ]


def obstacles(time_s: float, x_m: float = 0.0, y_m: float = 0.0) -> m.Obstacles:
    """A person that walks east, a wall to the south, a known bench in its place, and one that is missing."""
    ring = np.array((-0.3, 0.3, 0.3, -0.3)), np.array((-0.3, -0.3, 0.3, 0.3))
    person = m.Obstacle(
        id=3, kind="person", moving=True, x_m=x_m + 2.0, y_m=y_m, vx_mps=1.2, vy_mps=0.1,
        outline_x_m=ring[0] + x_m + 2.0, outline_y_m=ring[1] + y_m,
    )  # fmt: skip
    wall = m.Obstacle(
        id=5, kind="wall", x_m=x_m, y_m=y_m - 10.0,
        outline_x_m=20.0 * ring[0] + x_m, outline_y_m=ring[1] + y_m - 10.0,
    )  # fmt: skip
    bench, missing = m.Obstacle(id=0, known=True), m.Obstacle(id=1, known=True, missing=True, x_m=x_m, y_m=y_m - 20.0)
    return m.Obstacles(header=header(time_s), obstacles=(person, wall, bench, missing))


def zones(time_s: float, x_m: float = 0.0, y_m: float = 0.0) -> list[Incoming]:
    """Zones round a robot that heads east, squares of 1.2 m either way and of 2.4 m, the larger one farther ahead."""
    sides = ((topics.STOP_ZONE, -1.2, 1.2, 1.2), (topics.SLOW_ZONE, -2.4, 4.8, 2.4))
    found: list[Incoming] = []
    for topic, behind_m, ahead_m, aside_m in sides:
        corners = ((behind_m, -aside_m), (ahead_m, -aside_m), (ahead_m, aside_m), (behind_m, aside_m))
        points = tuple(m.Point32(x=x_m + x, y=y_m + y) for x, y in corners)
        polygon = m.PolygonMessage(points=points)
        found.append(received(topic, m.PolygonStamped(header=header(time_s), polygon=polygon)))
    return found


def before_person(template: Template) -> list[Incoming]:
    """The robot waits before a person, and goes round 8 s from now."""
    reason = "something that stands is in the way, 0.8 m from the robot"
    pause = m.PauseStatus(cause=m.PauseStatus.IN_THE_WAY, source="protection", ends_by_itself=True)
    waits = m.WayRound(state=m.WayRound.WAITS, things=("person 3",), goes_round_at=header(108.0).stamp)
    events = mid_run(template)
    here = next(each.message for each in events if isinstance(each, Received) and each.topic == topics.ODOMETRY.name)
    assert isinstance(here, m.Odometry)
    return [
        *events,
        received(topics.CLOCK, m.Clock(clock=header(100.0).stamp)),
        received(topics.PAUSE_STATUS, pause),
        received(topics.STATUS, status(template, m.TraversalStatus.PAUSED, 14, 0.55, reason=reason)),
        received(topics.WAY_ROUND, waits),
        received(topics.OBSTACLES, obstacles(100.0, here.pose.pose.position.x, here.pose.pose.position.y)),
        *zones(100.0, here.pose.pose.position.x, here.pose.pose.position.y),
        *robot_health(valve=False),
    ]
