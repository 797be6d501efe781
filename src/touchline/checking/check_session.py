"""Check of one recording: planned and driven again, and if that differs, the component that caused it."""

from __future__ import annotations

from collections.abc import Collection
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from touchline.checking.component_replay import OPEN_LOOP, check_estimator, check_follower
from touchline.checking.differing_component import first_differing_component
from touchline.checking.divergence import ESTIMATOR, FOLLOWER, PLAN, Divergence, SessionDiff
from touchline.checking.importing.session_writer import IMPORTED
from touchline.checking.rebuild import Rebuild
from touchline.checking.record_again import record_again
from touchline.checking.recorded_session import (
    TICK_NS,
    GivenJob,
    NothingTold,
    NotRebuilt,
    RecordedSession,
)
from touchline.checking.replan import planned_again
from touchline.checking.robot_messages import RobotMessages
from touchline.checking.robot_tables import ProcessTables, RobotTables
from touchline.checking.session_changes import changes_since
from touchline.checking.streamed_comparison import Progress, compare_streams
from touchline.recordings.channels import robots_among, topic_at
from touchline.recordings.provenance import MADE_BY, other_code, other_platform, other_plugins
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded, Summary
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PlanningError

ALONE: Final = (PLAN, ESTIMATOR, FOLLOWER)
"""Components that can be run alone on recorded inputs."""


_OF_A_LOG: Final = (
    "it was imported from a log of another robot, which did not run this code; "
    "`touchline estimate` runs the estimator on it"
)


@dataclass
class SessionCheck:
    """Check of one robot's session.

    Attributes:
        robot: Namespace of the robot.
        process: Which process of the robot it was, from 1.
        made_by: Versions and platform of the recording.
        exact: Whether every bit has to be the same.
        problem: Why it could not be rebuilt; empty if it could.
        diff: Comparison of all messages.
        plan: First difference of the plans; None if there is none, or it is unknown.
        planned: Number of plans that were made again.
        part: Component that differs first; empty if nothing differs.
        sim_time_s: Length of the session.
        cut: Whether the recording is cut off.
        notes: Further remarks.
    """

    robot: str
    process: int = 1
    made_by: dict[str, str] = field(default_factory=dict)
    exact: bool = True
    problem: str = ""
    diff: SessionDiff = field(default_factory=SessionDiff)
    plan: Divergence | None = None
    planned: int = 0
    part: str = ""
    sim_time_s: float = 0.0
    cut: bool = False
    notes: list[str] = field(default_factory=list)

    @property
    def first(self) -> Divergence | None:
        """First difference, in plans or messages."""
        return self.plan or self.diff.first

    @property
    def passed(self) -> bool:
        """True if the present code does the same."""
        return not self.problem and self.first is None


def check_recording(
    path: Path, *, exact: bool | None = None, only: str = "", progress: Progress = lambda done: None
) -> list[SessionCheck]:
    """Check every session of every robot of a recording.

    Args:
        path: The recording.
        exact: Whether every bit counts, else each topic's tolerance; None: by the platform of the recording.
        only: One of `ALONE`, to run it alone on recorded inputs; "" for the whole robot.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The recording cannot be read.
    """
    tables = RobotTables(path, OPEN_LOOP) if only == ESTIMATOR else None
    summary = _summary(path) if tables is None else tables.summary
    if IMPORTED in summary.metadata:
        return [SessionCheck("", problem=_OF_A_LOG)]
    made_by = summary.metadata.get(MADE_BY, {})
    others = other_platform(made_by)
    topics_recorded = {topic.name for each in summary.topics if (topic := topic_at(each)) is not None}
    robots = [robot for robot in robots_among(summary.topics) if _drives(summary, robot)]
    found: list[SessionCheck] = []
    for number, robot in enumerate(robots):
        process, followed = 0, True
        if tables is not None and tables.robot != robot:
            tables = RobotTables(path, OPEN_LOOP, robot)
        while followed:
            process += 1
            messages = RobotMessages(path, robot, process)
            one = SessionCheck(
                robot, process, made_by, not others if exact is None else exact, diff=SessionDiff(topics_recorded)
            )
            one.notes += changes_since(made_by.get("touchline", ""), other_code(made_by))
            if plugins := other_plugins(made_by):
                one.notes.append(f"recorded where these plug-ins were installed: {', '.join(plugins)}")
            one.cut = bool(summary.problem)
            if one.cut:
                one.notes.append(f"compared as far as the recording goes: {summary.problem}")
            if others and not one.exact:
                one.notes.append(f"compared within tolerances, as it was made with other {', '.join(others)}")
            source = messages if tables is None else tables.process(process)
            if _fill_in(one, source, only, partial(_report, progress, number, len(robots))):
                found.append(one)
            followed = source.followed
    return found or [SessionCheck("", problem="no robot's session is in the recording")]


def _summary(path: Path) -> Summary:
    reader = RecordingReader(path)
    for _ in reader.messages([]):
        pass
    return reader.summary


def _drives(summary: Summary, robot: str) -> bool:
    """Return whether the recording holds the setup of this robot, not of a team's coordinator."""
    if robot == topics.TEAM_NAMESPACE:
        return False
    return f"/{robot}/{topics.SETUP.name}" in summary.topics or f"/{topics.SETUP.name}" in summary.topics


def _report(progress: Progress, number: int, of: int, done: float) -> None:
    progress((number + done) / of)


def _fill_in(one: SessionCheck, source: RobotMessages | ProcessTables, only: str, progress: Progress) -> bool:
    """Check a session; False if there is none, as a restarted process got no orders."""
    if only in (ESTIMATOR, FOLLOWER) and one.exact and _by_camera(one, source):
        one.exact = False
        one.notes.append("compared within tolerances, as the last bit of a camera's heading is not in its messages")
    try:
        if isinstance(source, ProcessTables):
            one.diff, one.sim_time_s = check_estimator(source, one.diff.topics_recorded, exact=one.exact, cut=one.cut)
            one.part = ESTIMATOR if one.first is not None else ""
        else:
            _check(one, source, only, progress)
    except NothingTold as error:
        one.problem = str(error)
        return one.process == 1
    except NotRebuilt as error:
        one.problem = str(error)
    return True


def _by_camera(one: SessionCheck, source: RobotMessages | ProcessTables) -> bool:
    """Return whether an overhead camera positioned the robot."""
    if topics.CAMERA_POSE.name not in one.diff.topics_recorded:
        return False
    tables = source if isinstance(source, ProcessTables) else source.tables((topics.CAMERA_POSE.name,))
    return bool(tables.of((topics.CAMERA_POSE.name,)))


def _check(one: SessionCheck, messages: RobotMessages, only: str, progress: Progress) -> None:
    """Check a session, or one component alone.

    Raises:
        NotRebuilt: It cannot be run again.
    """
    session = messages.session()
    if session.amid:
        begin_s = session.from_ns / 1e9
        one.notes.append(f"checked from {begin_s:.2f} s on, where the first job that is recorded completely begins")
    if messages.followed:
        one.cut = True
        one.notes.append("its process died; compared as far as that came")
    one.sim_time_s = session.last_tick / 100.0
    if only in ("", PLAN):
        _plan_again(one, session)
    if only == PLAN:
        return
    if only == FOLLOWER:
        one.diff = _new_diff(one, session, messages, topics_recorded=())
        check_follower(session, messages, one.diff, exact=one.exact, progress=progress)
        one.part = FOLLOWER if one.first is not None else ""
        return
    one.diff = _new_diff(one, session, messages)
    rebuild = Rebuild(session)
    compare_streams(one.diff, rebuild, messages, session.last_tick, progress)
    one.notes += rebuild.refused
    if one.plan is None and (first := one.diff.first) is not None:
        forced = _new_diff(one, session, messages, exact=True, cut=True)
        one.part = first_differing_component(session, first, messages, forced)


def _new_diff(
    one: SessionCheck,
    session: RecordedSession,
    messages: RobotMessages,
    *,
    topics_recorded: Collection[str] | None = None,
    exact: bool | None = None,
    cut: bool | None = None,
) -> SessionDiff:
    return SessionDiff(
        one.diff.topics_recorded if topics_recorded is None else topics_recorded,
        one.exact if exact is None else exact,
        session.from_ns,
        session.orders[0].tick * TICK_NS,
        one.cut if cut is None else cut,
        session.loaded_ns,
        time=copy(messages.time),
    )


def _plan_again(one: SessionCheck, session: RecordedSession) -> None:
    """Compare the present plans with those that were driven."""
    for job in session.jobs:
        if job.is_plannable:
            one.planned += 1
            one.plan = one.plan or _of_plan(job, session)
    if len(session.jobs) > one.planned:
        one.notes.append(f"{len(session.jobs) - one.planned} plans were not made again: their inputs are unknown")
    if one.plan is not None:
        one.part = PLAN


def _of_plan(job: GivenJob, session: RecordedSession) -> Divergence | None:
    """Return where the present plan differs from the driven one."""
    try:
        made = planned_again(job, session.setup.vehicle)
    except PlanningError as error:
        return Divergence(0.0, topics.PLAN.name, "", "a plan", f"none: {error}")
    if made is None:
        return None
    diff = SessionDiff()
    kind = diff.kind_of(topics.PLAN)
    diff.recorded(topics.PLAN, Recorded(topics.PLAN.name, 0, 0, 0, encode(job.trajectory), kind))
    diff.present([(topics.PLAN, encode(made))])
    diff.end()
    return diff.first


def update_recording(path: Path) -> None:
    """Replace a recording of one robot by what the present code does.

    Args:
        path: Path of the recording.

    Raises:
        NotRebuilt: It cannot be run again, or is of several robots or processes.
        PlanningError: It can no longer be planned.
        RecordingError: It cannot be read or written.
    """
    summary = _summary(path)
    robots = robots_among(summary.topics)
    if len(robots) != 1:
        raise NotRebuilt(f"{path}: is of {len(robots)} robots; only a recording of one can be replaced")
    topics_recorded = [topic for each in summary.topics if (topic := topic_at(each)) is not None]
    messages = RobotMessages(path, robots[0])
    session = messages.session()
    if messages.followed:
        raise NotRebuilt(f"{path}: its robot's process was restarted; such a recording cannot be replaced")
    record_again(path, session, robots[0], topics_recorded)
