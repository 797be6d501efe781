"""Component replay: runs one component on recorded inputs."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from touchline.checking.divergence import ESTIMATOR, PART_OF, SessionDiff
from touchline.checking.estimator_alone import TopicPayloads, estimates_again
from touchline.checking.open_loop_computer import OpenLoopComputer, decisions
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_sensors import RecordedAuxiliary, RecordedSensors
from touchline.checking.recorded_session import TICK_NS, NotRebuilt, RecordedSession
from touchline.checking.robot_messages import RobotMessages
from touchline.checking.robot_tables import ProcessTables
from touchline.checking.sensor_frames import SENSED, auxiliary_samples, sensor_frames
from touchline.checking.streamed_comparison import Progress, compare_rest, compare_streams
from touchline.recordings.channels import topic_at
from touchline.recordings.recorded import Recorded
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import Event

ESTIMATES: Final = frozenset(name for name, part in PART_OF.items() if part == ESTIMATOR)
"""Topics of the estimator."""
_JUMP_ACCEPTED: Final = "position-accepted"
_CAUSES: Final = frozenset(
    topic.name
    for topic in (
        topics.SETUP,
        topics.INITIAL_STATE,
        topics.PLAN,
        topics.TEMPLATE,
        topics.ORDERS,
        topics.EVENTS,
        topics.CLOCK,
    )
)
OPEN_LOOP: Final = SENSED | ESTIMATES | _CAUSES
"""Topics needed to run the estimator alone and to compare its output."""


def check_estimator(
    recorded: ProcessTables, topics_recorded: Collection[str], *, exact: bool, cut: bool
) -> tuple[SessionDiff, float]:
    """Compare the present estimator's output on the recorded sensors.

    Args:
        recorded: The topics in `OPEN_LOOP`.
        topics_recorded: Names of the recorded topics.
        exact: Whether every bit counts.
        cut: Whether the recording is cut off.

    Returns:
        The comparison, and the length of the session (s).

    Raises:
        NotRebuilt: A required topic was not recorded.
    """
    session, output = estimated_again(recorded)
    recorded = recorded.since(session.since)
    came = recorded.of(SENSED | ESTIMATES)
    from_ns = min([session.from_ns, *(int(each.publish_time_ns[0]) for each in came.values())])
    diff = SessionDiff(
        ESTIMATES & set(topics_recorded), exact, from_ns, session.orders[0].tick * TICK_NS, cut, session.loaded_ns
    )
    if not diff.take_equal(came, output):
        each_output = ([(topic, payload) for topic, some in slice_ for payload in some.each()] for slice_ in output)
        compare_rest(diff, recorded.messages(ESTIMATES), each_output)
    return diff, session.last_tick / 100.0


def estimated_again(recorded: ProcessTables) -> tuple[RecordedSession, list[list[TopicPayloads]]]:
    """Return the recorded session, and the present estimator's output on its sensors; see `check_estimator`."""
    causes = recorded.messages(_CAUSES)
    session = RecordedSession.of(causes)
    _refuse_resumed(session)
    came = recorded.since(session.since).of(SENSED | ESTIMATES)
    session.last_tick = max([session.last_tick, *(int(each.log_time_ns[-1]) // TICK_NS for each in came.values())])
    frames = sensor_frames(session.setup, came, session.last_tick, session.initial)
    return session, list(estimates_again(session, frames, _accepted(causes), auxiliary_samples(came)))


def check_follower(
    session: RecordedSession, messages: RobotMessages, diff: SessionDiff, *, exact: bool, progress: Progress
) -> None:
    """Compare the present computer's decisions on the recorded sensors, with the recorded actuation applied.

    Args:
        session: The session to run again.
        messages: Messages of the robot.
        diff: Comparison to fill in.
        exact: Whether every bit counts.
        progress: Called with the fraction done.

    Raises:
        NotRebuilt: A required topic was not recorded.
    """
    computer = decided_again(session, messages, diff, progress)
    diff.topics[topics.ACTUATOR_COMMAND.name] = decisions(computer, session, exact=exact)


def decided_again(
    session: RecordedSession, messages: RobotMessages, diff: SessionDiff, progress: Progress = lambda done: None
) -> OpenLoopComputer:
    """Return the present computer after it has run the session; see `check_follower`."""
    _refuse_resumed(session)
    came = messages.tables(SENSED).of(SENSED)
    computer = OpenLoopComputer(session.setup, session.commands)
    sensors = RecordedSensors(session.setup, sensor_frames(session.setup, came, session.last_tick, session.initial))
    auxiliary = RecordedAuxiliary(session.setup, auxiliary_samples(came))
    compare_streams(diff, Rebuild(session, computer, (sensors, auxiliary)), (), session.last_tick, progress)
    return computer


def _refuse_resumed(session: RecordedSession) -> None:
    if session.shifted or any(order.details.get("resumed") for order in session.orders):
        raise NotRebuilt(
            "a component alone cannot be run after a restart of the robot's process: "
            "arrival times of its sensors are not recorded until sim time has passed that of the earlier process"
        )


def _accepted(causes: list[Recorded]) -> frozenset[int]:
    """Return the ticks in which the robot's computer reported that it accepts a jump of the receiver."""
    events = [each for each in causes if topic_at(each.topic) is topics.EVENTS]
    return frozenset(
        each.publish_time_ns // TICK_NS for each in events if decode(Event, each.payload).code == _JUMP_ACCEPTED
    )
