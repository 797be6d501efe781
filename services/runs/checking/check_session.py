"""One recording against the code of today: planned again, driven again, and if that differs, by which part."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple, Self

import numpy as np

from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PlanningError
from touchline.services.bridge.channels import namespace_at, robots_among, topic_at
from touchline.services.bridge.former_types import presented
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bridge.recorded import Recorded, Summary
from touchline.services.runs.checking.divergence import (
    ESTIMATOR,
    FOLLOWER,
    PART_OF,
    PARTS,
    PLAN,
    Divergence,
    SessionDiff,
    TopicCheck,
)
from touchline.services.runs.checking.forced_computer import ForcedComputer
from touchline.services.runs.checking.rebuild import Rebuild
from touchline.services.runs.checking.record_again import record_again
from touchline.services.runs.checking.recorded_sensors import RecordedSensors
from touchline.services.runs.checking.recorded_session import TICK_NS, GivenJob, NotRebuilt, RecordedSession
from touchline.services.runs.checking.replan import planned_again

ALONE: Final = (PLAN, ESTIMATOR, FOLLOWER)
"""Parts that can be run alone on what was recorded."""
AFTER_TICKS: Final = 100
"""For so long after the first difference the cause of it is looked for."""

Progress = Callable[[float], None]


@dataclass
class SessionCheck:
    """What came of one robot's session.

    Attributes:
        robot: Its namespace.
        problem: Why it could not be rebuilt; empty if it could.
        diff: Of all that is said.
        plan: Where today's plan differs from the recorded one; None if it does not, or nobody can tell.
        planned: How many plans were made again.
        part: That differs first; empty if nothing does.
        sim_time_s: How long the session is.
        notes: What else there is to know.
    """

    robot: str
    problem: str = ""
    diff: SessionDiff = field(default_factory=SessionDiff)
    plan: Divergence | None = None
    planned: int = 0
    part: str = ""
    sim_time_s: float = 0.0
    notes: list[str] = field(default_factory=list)

    @property
    def first(self) -> Divergence | None:
        """The first difference."""
        return self.plan or self.diff.first

    @property
    def passed(self) -> bool:
        """Whether today's code does the same."""
        return not self.problem and self.first is None


def check_recording(
    path: Path, *, exact: bool, only: str = "", progress: Progress = lambda done: None
) -> list[SessionCheck]:
    """Check the session of every robot of a recording.

    Args:
        path: The recording.
        exact: Whether every bit counts, else each topic's tolerance.
        only: One of `ALONE`, to be run alone on what was recorded; "" for all of the robot.
        progress: Told the fraction done.

    Raises:
        RecordingError: It cannot be read.
    """
    reader = RecordingReader(path)
    for _ in reader.messages([]):
        pass
    robots = [robot for robot in robots_among(reader.summary.topics) if _drives(reader.summary, robot)]
    found = []
    for number, robot in enumerate(robots):
        one = SessionCheck(robot)
        try:
            if reader.summary.problem:
                one.notes.append(f"compared as far as the recording goes: {reader.summary.problem}")
            one.diff.told = {topic.name for each in reader.summary.topics if (topic := topic_at(each)) is not None}
            check = partial(_check_alone, only=only) if only else _check
            check(one, path, exact, partial(_tell, progress, number, len(robots)))
        except NotRebuilt as error:
            one.problem = str(error)
        found.append(one)
    return found or [SessionCheck("", "no robot's session is in the recording")]


def _tell(progress: Progress, number: int, of: int, done: float) -> None:
    progress((number + done) / of)


def update_recording(path: Path) -> None:
    """Write a recording of one robot anew, as today's code does what it holds.

    Args:
        path: Of the recording.

    Raises:
        NotRebuilt: It cannot be done again, or is of several robots.
        PlanningError: There is no plan any more.
        RecordingError: It cannot be read, or not be written.
    """
    reader = RecordingReader(path)
    for _ in reader.messages([]):
        pass
    robots = robots_among(reader.summary.topics)
    if len(robots) != 1:
        raise NotRebuilt(f"{path}: is of {len(robots)} robots, and only that of one is written anew")
    told = [topic for each in reader.summary.topics if (topic := topic_at(each)) is not None]
    record_again(path, RecordedSession.of(_messages(path, robots[0])), robots[0], told)


def _drives(summary: Summary, robot: str) -> bool:
    """Whether the recording holds the setup of a robot of this name, and not of a team's coordinator."""
    return f"/{robot}/{topics.SETUP.name}" in summary.topics or f"/{topics.SETUP.name}" in summary.topics


def _messages(path: Path, robot: str) -> Iterator[Recorded]:
    for message in map(presented, RecordingReader(path).messages()):
        if namespace_at(message.topic) == robot:
            yield message


def _check(one: SessionCheck, path: Path, exact: bool, progress: Progress) -> None:
    """Fill in what comes of a session.

    Raises:
        NotRebuilt: It cannot be done again.
    """
    session = RecordedSession.of(_messages(path, one.robot))
    one.sim_time_s = session.last_tick / 100.0
    one.diff = SessionDiff(one.diff.told, exact, session.from_ns, session.orders[0].tick * TICK_NS, bool(one.notes))
    _plan_again(one, session)
    rebuild = Rebuild(session)
    _run(one.diff, rebuild, _messages(path, one.robot), session.last_tick, progress)
    one.notes += rebuild.refused
    if one.plan is None and (first := one.diff.first) is not None:
        one.part = _part(session, first, path, one)


def _plan_again(one: SessionCheck, session: RecordedSession) -> None:
    """Compare today's plans with those that were driven."""
    for job in session.jobs:
        if job.cause is not None:
            one.planned += 1
            one.plan = one.plan or _of_plan(job, session)
    if len(session.jobs) > one.planned:
        one.notes.append(f"{len(session.jobs) - one.planned} plans were not made again: what they came from is unknown")
    if one.plan is not None:
        one.part = PLAN


def _check_alone(one: SessionCheck, path: Path, exact: bool, progress: Progress, *, only: str) -> None:
    """As `_check`, of one part alone: it gets what was recorded, whatever the others would do today.

    Raises:
        NotRebuilt: What it gets was not recorded.
    """
    session = RecordedSession.of(_messages(path, one.robot))
    one.sim_time_s = session.last_tick / 100.0
    if only == PLAN:
        _plan_again(one, session)
        return
    told = {name for name, part in PART_OF.items() if part == ESTIMATOR} if only == ESTIMATOR else frozenset[str]()
    one.diff = SessionDiff(told, exact, session.from_ns, session.orders[0].tick * TICK_NS, bool(one.notes))
    computer = ForcedComputer(session.setup, session.commands)
    sensors = RecordedSensors(session.setup, _messages(path, one.robot))
    _run(one.diff, Rebuild(session, computer, sensors), _messages(path, one.robot), session.last_tick, progress)
    if only == FOLLOWER:
        one.diff.topics[topics.ACTUATOR_COMMAND.name] = _decisions(computer, session, exact)
    if one.diff.first is not None:
        one.part = only


def _decisions(computer: ForcedComputer, session: RecordedSession, exact: bool) -> TopicCheck:
    """What the computer decided in each tick, beside what it did then."""
    found, tolerance = TopicCheck(), 0.0 if exact else topics.ACTUATOR_COMMAND.tolerance
    for tick, own in sorted(computer.decided.items()):
        then = session.commands[tick] if tick < len(session.commands) else np.full(len(own), np.nan)
        if np.isnan(then).any():
            continue
        found.pairs += 1
        off = np.abs(then - np.array(own))
        if not off.max() <= tolerance:
            k = int(off.argmax())
            found.different += 1
            found.largest = max(found.largest, float(off[k]))
            found.largest_field = f"values[{k}]"
            where = tick / 100.0, topics.ACTUATOR_COMMAND.name, f"values[{k}]"
            found.first = found.first or Divergence(*where, repr(float(then[k])), repr(own[k]))
    return found


def _run(diff: SessionDiff, rebuild: Rebuild, recorded: Iterator[Recorded], last_tick: int, progress: Progress) -> None:
    """Let both go on side by side."""
    told_ns, ahead = -1, next(recorded, None)
    for payloads in rebuild.said():
        diff.said(payloads)
        told_ns = max(told_ns, rebuild.tick * TICK_NS)
        while ahead is not None and ahead.log_time_ns <= told_ns:
            _take(diff, ahead)
            ahead = next(recorded, None)
        progress(rebuild.tick / max(last_tick, 1))
    while ahead is not None:
        _take(diff, ahead)
        ahead = next(recorded, None)
    diff.end()


def _take(diff: SessionDiff, message: Recorded) -> None:
    topic = topic_at(message.topic)
    if topic is not None and topic.name in diff.wanted:
        diff.recorded(topic, message)


def _of_plan(job: GivenJob, session: RecordedSession) -> Divergence | None:
    """Where today's plan differs from that which was driven."""
    try:
        made = planned_again(job, session.setup.vehicle)
    except PlanningError as error:
        return Divergence(0.0, topics.PLAN.name, "", "a plan", f"none: {error}")
    if made is None:
        return None
    diff = SessionDiff()
    kind = diff.kind_of(topics.PLAN)
    diff.recorded(topics.PLAN, Recorded(topics.PLAN.name, 0, 0, 0, encode(job.trajectory), kind))
    diff.said([(topics.PLAN, encode(made))])
    diff.end()
    return diff.first


def _part(session: RecordedSession, first: Divergence, path: Path, one: SessionCheck) -> str:
    """Which part differs first, if the actuators do what they did then."""
    last_tick = min(session.last_tick, round(100 * first.time_s) + AFTER_TICKS)
    short = replace(session, last_tick=last_tick)
    short.orders = [order for order in session.orders if order.tick <= last_tick]
    computer = ForcedComputer(session.setup, session.commands)
    diff = SessionDiff(one.diff.told, True, session.from_ns, session.orders[0].tick * TICK_NS, broken_off=True)
    until_ns = last_tick * TICK_NS
    recorded = (message for message in _messages(path, one.robot) if message.publish_time_ns <= until_ns)
    _run(diff, Rebuild(short, computer), recorded, last_tick, lambda done: None)
    found = [check.first for check in diff.topics.values() if check.first is not None]
    seen = [_Seen.of(each) for each in found] + _own_decision(computer, session)
    if not seen:
        return first.part
    parts = {part: [each for each in seen if each.part == part] for part in PARTS}
    until_s = min(each.until_s for each in seen)
    may_be_first = [part for part, some in parts.items() if some and max(each.from_s for each in some) <= until_s]
    return next(iter(may_be_first), first.part)


class _Seen(NamedTuple):
    """A difference of a part, which began in some tick between two messages of the topic that shows it.

    Attributes:
        part: Of the robot.
        from_s, until_s: The first and the last of these ticks, sim time.
    """

    part: str
    from_s: float
    until_s: float

    @classmethod
    def of(cls, found: Divergence) -> Self:
        """What a topic shows."""
        rate_hz = topics.TOPIC_BY_NAME[found.topic].rate_hz
        between_s = 1.0 / rate_hz - 0.01 if rate_hz else 0.0
        return cls(found.part, round(found.time_s - between_s, 6), round(found.time_s, 6))


def _own_decision(computer: ForcedComputer, session: RecordedSession) -> list[_Seen]:
    """When the computer first decided otherwise than was recorded."""
    for tick, own in sorted(computer.decided.items()):
        if tick < len(session.commands):
            then = session.commands[tick]
            if not np.isnan(then).any() and tuple(then.tolist()) != own:
                return [_Seen(FOLLOWER, tick / 100.0, tick / 100.0)]
    return []
