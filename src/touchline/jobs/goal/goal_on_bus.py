"""A drive to a goal over the bus: sends the goal, and follows the robot until it arrives or stops.

A robot with a lidar may end a drive and begin another one, or take over another way, to go round something.
"""

import time
import uuid
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from touchline.bus import Bus
from touchline.jobs.goal.arrival import ReachedPose, arrival_figures, missed
from touchline.jobs.single.stall_detector import StallDetector
from touchline.jobs.watcher import JobFailed, Watcher
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import (
    CommandRequest,
    Event,
    GotoRequest,
    GotoResponse,
    Odometry,
    PauseStatus,
    PlanOptions,
    PoseGoal,
    TraversalReport,
    TraversalStatus,
    WayRound,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.standard import Time

#: Timeout, s; planning and taking over the path are included.
_ANSWER_S: Final = 90.0
#: Codes of the robot's events when it takes another trajectory.
_OTHERS: Final = frozenset(("ready", "replaced"))


@dataclass
class GoalOnBus:
    """A drive to ``goal`` of the robot on ``bus``, reported to ``watcher``."""

    bus: Bus
    goal: PoseGoal
    options: PlanOptions
    watcher: Watcher
    ground_json: str = ""
    """Known ground as text; empty: nothing is known."""
    _ours: bool = field(default=False, init=False)
    """True if the robot's events have reached this goal."""
    _since: tuple[int, int] = field(default=(0, 0), init=False)
    """Sim time of that event [s, ns]."""
    _begun: tuple[int, int] = field(default=(0, 0), init=False)
    """Sim time at which the present drive began."""
    _said: WayRound = field(default=WayRound(), init=False)
    """Last report about ways round."""
    _changes: set[tuple[int, int]] = field(default_factory=set, init=False)
    """Sim times of those reports."""
    _others: list[Event] = field(default_factory=list, init=False)
    """Events of other trajectories that no report has explained yet."""
    _done: Event | None = field(default=None, init=False)
    _report: TraversalReport | None = field(default=None, init=False)
    """Report of the last drive that has ended."""
    _hits: Counter[str] = field(default_factory=Counter, init=False)
    """Contacts of all drives: while the robot moved, and at rest."""
    _status: TraversalStatus = field(default=TraversalStatus(), init=False)
    _pause: PauseStatus = field(default=PauseStatus(), init=False)
    _odometry: dict[str, Odometry] = field(default_factory=dict, init=False)

    def run(self) -> dict[str, Any]:
        """Send the goal and wait for the robot to come to rest.

        Returns:
            Whether it arrived, or why not, and where and when it came to rest.

        Raises:
            JobFailed: The goal is refused, another trajectory takes over, or the robot stops for good.
            CallError: The robot does not answer.
        """
        messages = self.bus.inbox([topics.EVENTS, topics.WAY_ROUND, topics.REPORT])
        latest = self.bus.inbox([topics.STATUS, topics.PAUSE_STATUS, topics.ODOMETRY, topics.TRUTH], keep="latest")
        self.watcher.stage("Planning")
        request = GotoRequest(
            request_id=uuid.uuid4().hex, goal=self.goal, options=self.options, ground_json=self.ground_json
        )
        answer = self.bus.call(topics.GOTO, request, _ANSWER_S, self.watcher.check)
        if not answer.success:
            raise JobFailed(f"the robot refused the goal: {answer.message}")
        self.watcher.stage("Driving")
        self.watcher.event(Event.INFO, answer.message)
        try:
            report = self._follow(messages.messages, latest.messages)
        except KeyboardInterrupt:
            self._abort()
            raise
        self._note(latest.messages)
        return self._figures(answer, report)

    def _follow(self, messages: Any, latest: Any) -> TraversalReport:
        patience, moved_to_m = StallDetector(), -1.0
        while True:
            self.watcher.check()
            ended, doubtful, self._others = self._report, self._others, []
            for _, message in messages():
                self._hear(message)
            if any(not self._explained(event) for event in doubtful):
                raise JobFailed("another trajectory has taken over; the robot follows that")
            if ended is not None and _stamp(ended) > self._begun and not self._said.continues:
                return ended
            self._note(latest)
            status = self._status
            if self._ours and status.state == TraversalStatus.ESTOPPED:
                raise JobFailed(f"the robot was stopped: {status.reason}")
            if status.arc_length_m != moved_to_m:
                moved_to_m = status.arc_length_m
                fraction = moved_to_m / status.total_length_m if status.total_length_m else 0.0
                self.watcher.progress(fraction, f"{status.remaining_s:.0f} s remaining")
            if self._said.state == WayRound.PLANS or self._said.continues:
                patience = StallDetector()  # a plan takes as long as it takes
            elif why := patience.stalled(status, self._pause):
                raise JobFailed(why)
            time.sleep(0.01)

    def _hear(self, message: Message) -> None:
        """Take a message of the robot's, if it is of this goal: the bus keeps the last one."""
        if isinstance(message, Event):
            self._heed(message)
        elif isinstance(message, WayRound) and self._ours and _stamp(message) >= self._since:
            if message.drives > self._said.drives:
                self._begun = _stamp(message)
            self._said = message
            self._changes.add(_stamp(message))
        elif isinstance(message, TraversalReport) and self._ours and _stamp(message) > self._since:
            self._report = message

    def _heed(self, event: Event) -> None:
        self.watcher.event(event.severity, f"{event.source}: {event.text}")
        if event.code == "goal" and not self._ours:
            self._ours, self._since, self._begun = True, _stamp(event), _stamp(event)
        elif self._ours and event.code in _OTHERS:
            self._others.append(event)
        elif self._ours and event.code == "contact":
            self._hits["while_moving" if event.severity == Event.ERROR else "at_rest"] += 1
        elif event.code == "done":
            self._done = event

    def _explained(self, event: Event) -> bool:
        """Return whether another trajectory is the next way to this goal, which the robot announces."""
        return self._said.continues or _stamp(event) in self._changes

    def _note(self, latest: Any) -> None:
        messages: Iterator[tuple[Any, Message]] = latest()
        for sample, message in messages:
            if isinstance(message, TraversalStatus):
                self._status = message
            elif isinstance(message, PauseStatus):
                self._pause = message
            elif isinstance(message, Odometry):
                self._odometry[sample.topic.name] = message

    def _abort(self) -> None:
        """Stop the robot; failing calls are reported to the watcher."""
        self.watcher.stage("Stopping")
        try:
            self.bus.call(topics.ABORT, CommandRequest(request_id=uuid.uuid4().hex), timeout_s=2.0)
        except TouchlineError as error:
            self.watcher.event(Event.WARN, f"the robot may drive on: {error}")
        else:
            self.watcher.event(Event.WARN, "interrupted: the robot brakes and aborts the goal")

    def _figures(self, answer: GotoResponse, report: TraversalReport) -> dict[str, Any]:
        believed, true = (self._reached(topic) for topic in (topics.ODOMETRY, topics.TRUTH))
        problem = missed(self.goal, believed, true) if report.success else self._status.reason
        if self._hits["while_moving"]:
            problem = problem or f"the robot hit something {self._hits['while_moving']} times"
        figures = {
            "success": report.success and not problem,
            "reason": problem or self._status.reason,
            "arrival": arrival_figures(self.goal, answer.total_time, self._took_s(report), believed, true),
        }
        if self._said.drives > 1:
            figures["drives"] = self._said.drives
        if self._hits:
            figures["contacts"] = {name: self._hits[name] for name in ("while_moving", "at_rest")}
        return figures

    def _took_s(self, report: TraversalReport) -> float:
        """Return the sim time from the first drive's begin to the last one's end."""
        if self._said.drives <= 1:
            return report.total_time_s
        end = _stamp(self._done or report)
        return _seconds(end) - _seconds(self._since)

    def _reached(self, topic: topics.Topic) -> ReachedPose | None:
        message = self._odometry.get(topic.name)
        return ReachedPose.of(message) if message is not None else None


def _stamp(message: Event | TraversalReport | WayRound) -> tuple[int, int]:
    stamp = message.header.stamp
    return stamp.sec, stamp.nanosec


def _seconds(stamp: tuple[int, int]) -> float:
    return Time(sec=stamp[0], nanosec=stamp[1]).seconds
