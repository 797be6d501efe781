"""One part of a robot alone on what was recorded, whatever the others would do today."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from touchline.checking.divergence import ESTIMATOR, PART_OF, SessionDiff
from touchline.checking.estimator_alone import Said, estimates_again
from touchline.checking.open_loop_computer import ForcedComputer, decisions
from touchline.checking.rebuild import Rebuild
from touchline.checking.recorded_sensors import RecordedSensors
from touchline.checking.recorded_session import TICK_NS, NotRebuilt, RecordedSession
from touchline.checking.robot_messages import RobotMessages
from touchline.checking.robot_tables import ProcessTables
from touchline.checking.sensor_frames import SENSED, sensor_frames
from touchline.checking.side_by_side import Progress, compare_rest, let_both_go_on
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
"""Topics that it takes to run the estimator alone, and to compare what it says."""


def check_estimator(
    recorded: ProcessTables, told: Collection[str], *, exact: bool, cut: bool
) -> tuple[SessionDiff, float]:
    """Compare what today's estimator makes of the recorded sensors.

    Args:
        recorded: The topics in `OPEN_LOOP`.
        told: Names of the topics that are recorded.
        exact: Whether every bit counts.
        cut: Whether the recording just stops.

    Returns:
        How it compares, and how long the session is (s).

    Raises:
        NotRebuilt: What it needs was not recorded.
    """
    session, said = estimated_again(recorded)
    recorded = recorded.since(session.since)
    came = recorded.of(SENSED | ESTIMATES)
    from_ns = min([session.from_ns, *(int(each.publish_time_ns[0]) for each in came.values())])
    diff = SessionDiff(ESTIMATES & set(told), exact, from_ns, session.orders[0].tick * TICK_NS, cut, session.loaded_ns)
    if not diff.take_equal(came, said):
        each_said = ([(topic, payload) for topic, some in slice_ for payload in some.each()] for slice_ in said)
        compare_rest(diff, recorded.messages(ESTIMATES), each_said)
    return diff, session.last_tick / 100.0


def estimated_again(recorded: ProcessTables) -> tuple[RecordedSession, list[list[Said]]]:
    """What was recorded, and what today's estimator says on its sensors; see `check_estimator`."""
    causes = recorded.messages(_CAUSES)
    session = RecordedSession.of(causes)
    _refuse_resumed(session)
    came = recorded.since(session.since).of(SENSED | ESTIMATES)
    session.last_tick = max([session.last_tick, *(int(each.log_time_ns[-1]) // TICK_NS for each in came.values())])
    frames = sensor_frames(session.setup, came, session.last_tick, session.initial)
    return session, list(estimates_again(session, frames, _accepted(causes)))


def check_follower(
    session: RecordedSession, messages: RobotMessages, diff: SessionDiff, *, exact: bool, progress: Progress
) -> None:
    """Compare what today's computer decides on the recorded sensors, while actuators do what they did then.

    Args:
        session: That is done again.
        messages: Of the robot.
        diff: Filled in.
        exact: Whether every bit counts.
        progress: Told the fraction done.

    Raises:
        NotRebuilt: What the computer needs was not recorded.
    """
    computer = decided_again(session, messages, diff, progress)
    diff.topics[topics.ACTUATOR_COMMAND.name] = decisions(computer, session, exact=exact)


def decided_again(
    session: RecordedSession, messages: RobotMessages, diff: SessionDiff, progress: Progress = lambda done: None
) -> ForcedComputer:
    """Today's computer after it has been through the session; see `check_follower`."""
    _refuse_resumed(session)
    came = messages.tables(SENSED).of(SENSED)
    computer = ForcedComputer(session.setup, session.commands)
    sensors = RecordedSensors(session.setup, sensor_frames(session.setup, came, session.last_tick, session.initial))
    let_both_go_on(diff, Rebuild(session, computer, sensors), (), session.last_tick, progress)
    return computer


def _refuse_resumed(session: RecordedSession) -> None:
    if session.shifted or any(order.details.get("resumed") for order in session.orders):
        raise NotRebuilt(
            "a part alone is not run on what goes on from a process that died: "
            "when its sensors arrived is not told until sim time has passed what that process had come to"
        )


def _accepted(causes: list[Recorded]) -> frozenset[int]:
    """Ticks in which the robot's computer said that it takes a jump of the receiver's for true."""
    events = [each for each in causes if topic_at(each.topic) is topics.EVENTS]
    return frozenset(
        each.publish_time_ns // TICK_NS for each in events if decode(Event, each.payload).code == _JUMP_ACCEPTED
    )
