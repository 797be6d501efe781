"""A shared job over the bus: each robot loads its part, and is told how far it may drive by what the others report."""

import math
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import (
    AuthorizeRequest,
    CommandRequest,
    Event,
    GetPaintRequest,
    LoadRequest,
    PaintMarks,
    SetSpeedRequest,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.topics import Request, Response, Service
from touchline.services.bus import Bus
from touchline.services.fleet.traffic.gates import authorities_m
from touchline.services.runs.bus_run import JobFailed, Watcher
from touchline.services.runs.sharing.shared_job import SharedJob

STALLED_S: Final = 20.0
"""A team of which nobody moves on for so long (wall clock) will not finish by itself."""
_LOOK_S: Final = 0.005


@dataclass
class _Robot:
    """A robot on the bus, as it tells of itself.

    Attributes:
        bus: Its own.
        status, report: What it told last.
        furthest_m: That it has reported.
        until_m: How far it was told that it may drive.
    """

    bus: Bus
    status: TraversalStatus = field(default_factory=TraversalStatus)
    report: TraversalReport | None = None
    furthest_m: float = 0.0
    until_m: float = -math.inf

    def __post_init__(self) -> None:
        """Listen, from before it is given anything to do."""
        self.told = self.bus.inbox([topics.EVENTS, topics.REPORT])
        self.latest = self.bus.inbox([topics.STATUS], keep="latest")

    @property
    def progress_m(self) -> float:
        """How far it has reported to be; infinite once it is done."""
        return math.inf if self.status.state == TraversalStatus.DONE else self.furthest_m

    def ask(self, service: Service[Request, Response], request: Request) -> Response:
        """Ask the robot something; the answer says whether it was done.

        Raises:
            JobFailed: It refuses.
            CallError: It does not answer.
        """
        response = self.bus.call(service, request, 10.0)
        if not getattr(response, "success", True):
            raise JobFailed(f"robot {self.bus.namespace} refuses {service.name}: {getattr(response, 'message', '')}")
        return response


class SharedBusRun:
    """A shared job in progress.

    Args:
        buses: Of the robots, in the order of the job.
        job: What they do.
        speed: Sim seconds per wall second; negative for as fast as it goes.
        watcher: Whoever watches.

    Attributes:
        reports: Of the robots, once all are done.
        strokes: Of the robots: their true paint.
        started_at: Wall clock (monotonic) at which they set off.
        wall_time_s: That they took, by the clock on the wall.
    """

    def __init__(self, buses: Sequence[Bus], job: SharedJob, speed: float, watcher: Watcher) -> None:
        self._robots, self._job, self._speed, self._watcher = [_Robot(bus) for bus in buses], job, speed, watcher
        self.reports: list[TraversalReport] = []
        self.strokes: list[tuple[PaintMarks, ...]] = []
        self.started_at = self.wall_time_s = 0.0

    def run(self) -> None:
        """Do it.

        Raises:
            JobFailed: A robot refused, stopped for good, or nobody moves on.
            CallError: One did not answer.
        """
        self._watcher.stage("Painting")
        try:
            self._load_and_start()
            self._follow()
        except (TouchlineError, KeyboardInterrupt):
            self._give_up()
            raise
        self.wall_time_s = time.monotonic() - self.started_at
        self.reports = [robot.report for robot in self._robots if robot.report is not None]
        self.strokes = [robot.bus.call(topics.GET_PAINT, GetPaintRequest(), 30.0).strokes for robot in self._robots]

    def _load_and_start(self) -> None:
        for robot, plan, share in zip(self._robots, self._job.plans, self._job.shares, strict=True):
            load = LoadRequest(request_id=_fresh_id(), trajectory=plan.trajectory, template_json=share.to_json())
            robot.ask(topics.LOAD, load)
            robot.ask(topics.SET_SPEED, SetSpeedRequest(request_id=_fresh_id(), factor=self._speed))
        self._authorize()
        self.started_at = time.monotonic()
        for robot in self._robots:
            robot.ask(topics.START, CommandRequest(request_id=_fresh_id()))

    def _authorize(self) -> None:
        """Tell every robot whose authority has grown."""
        until_m = authorities_m(self._job.table.gates, [robot.progress_m for robot in self._robots])
        for robot, arc_m in zip(self._robots, until_m, strict=True):
            if arc_m > robot.until_m:
                robot.ask(topics.AUTHORIZE, AuthorizeRequest(request_id=_fresh_id(), until_m=arc_m))
                robot.until_m = arc_m

    def _follow(self) -> None:
        moved_at, reached_m = time.monotonic(), -1.0
        length_m = sum(path.end_m for path in self._job.paths)
        while any(robot.report is None for robot in self._robots):
            self._watcher.check()
            for robot in self._robots:
                self._listen(robot)
            self._authorize()
            now_m = sum(robot.furthest_m for robot in self._robots)
            if now_m > reached_m:
                moved_at, reached_m = time.monotonic(), now_m
                where = ", ".join(f"{robot.bus.namespace} {robot.status.segment_id}" for robot in self._robots)
                self._watcher.progress(now_m / length_m, where)
            elif time.monotonic() - moved_at > STALLED_S:
                raise JobFailed(f"no robot has moved for {STALLED_S:.0f} s ({self._why_not()})")
            time.sleep(_LOOK_S)

    def _listen(self, robot: _Robot) -> None:
        for _, message in robot.told.messages():
            if isinstance(message, Event):
                self._watcher.event(message.severity, f"{robot.bus.namespace}: {message.text}")
            elif isinstance(message, TraversalReport) and self.started_at:
                robot.report = message
        for _, message in robot.latest.messages():
            if isinstance(message, TraversalStatus):
                robot.status = message
                robot.furthest_m = max(robot.furthest_m, message.arc_length_m)

    def _why_not(self) -> str:
        waiting = (robot for robot in self._robots if robot.report is None)
        return "; ".join(f"{each.bus.namespace}: {each.status.reason or 'no reason given'}" for each in waiting)

    def _give_up(self) -> None:
        """Leave all robots stopped; who cannot be asked any more is left."""
        self._watcher.stage("Stopping")
        for robot in self._robots:
            try:
                robot.bus.call(topics.ABORT, CommandRequest(request_id=_fresh_id()), 2.0)
            except TouchlineError as error:
                self._watcher.event(Event.WARN, str(error))


def _fresh_id() -> str:
    return uuid.uuid4().hex
