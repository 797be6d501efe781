"""Checks of the stops in a recording: no paint unless the robot drives, and no wheel command after an e-stop."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from touchline.recordings.channels import is_drawn, robots_among, topic_at
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import ActuatorCommand, PaintMarks, SprayerState, TraversalStatus
from touchline.schemas.messages.base import Message

_WATCHED: Final = (topics.STATUS, topics.SPRAYER, topics.PAINT, topics.ACTUATOR_COMMAND)
_CLOSING_NS: Final = 150_000_000
"""Delay of the valve, and the tick of its report."""
_TELLING_NS: Final = 250_000_000
"""Period of paint reports, which include paint on its way out of the nozzle."""
ESTOPPED: Final = TraversalStatus.ESTOPPED
_FLOW: Final = ("valve open though", "paint though")


class _Heard(NamedTuple):
    """Message with its sim time and the number of its process (there may have been several in succession)."""

    process: int
    time_ns: int
    message: Message


class Verdict(NamedTuple):
    """Result of the check of a recording.

    Attributes:
        problems: Problems found in it.
        complete: Whether it was finished.
        last_ns: Latest sim time in it.
    """

    problems: list[str]
    complete: bool
    last_ns: int

    @property
    def flow(self) -> bool:
        """True if paint could flow when it must not."""
        return any(problem.startswith(_FLOW) for problem in self.problems)


def verdict(path: Path) -> Verdict:
    """Check a whole recording."""
    heard: list[_Heard] = []
    found: set[str] = set()
    last_ns = 0
    try:
        reader = RecordingReader(path)
        for entry in _messages(reader):
            if isinstance(entry, str):
                found.add(entry)
            else:
                heard.append(entry)
                last_ns = entry.time_ns
    except (TouchlineError, OSError) as error:
        return Verdict([f"cannot be read: {error}"], False, 0)
    found |= set(_stopped_but(sorted(heard, key=lambda each: each[:2])))
    return Verdict(sorted(found), reader.summary.complete, last_ns)


def _messages(reader: RecordingReader) -> Iterator[_Heard | str]:
    """Generate the messages of the watched topics, and problems of messages that cannot be ours."""
    process, of_topic, numbers = 0, defaultdict[str, int](int), dict[str, int]()
    paths: set[str] = set()
    for recorded in reader.messages():
        topic = topic_at(recorded.topic)
        paths.add(recorded.topic)
        if topic is None:
            continue
        if topic in _WATCHED or len(recorded.payload) < 8:
            try:
                message = decode(topic.type, recorded.payload)
            except PayloadError:
                yield f"{topic.name}: recorded what does not decode"
                continue
            # A publisher that counts from the beginning again is another process.
            if recorded.sequence <= numbers.get(topic.name, 0):
                of_topic[topic.name] = process = max(process, of_topic[topic.name] + 1)
            numbers[topic.name] = recorded.sequence
            yield _Heard(of_topic[topic.name], recorded.publish_time_ns, message)
    robots = robots_among(paths)
    yield from (f"{path}: no topic of ours" for path in paths if topic_at(path) is None and not is_drawn(path, robots))


def _stopped_but(heard: list[_Heard]) -> Iterator[str]:
    """Generate the problems of activity while the robot did not drive."""
    process, state, since_ns = -1, TraversalStatus.RUNNING, 0
    for said_by, time_ns, message in heard:
        if said_by != process:
            process, state, since_ns = said_by, TraversalStatus.RUNNING, time_ns  # until it says otherwise
        if isinstance(message, TraversalStatus) and message.state != state:
            if TraversalStatus.RUNNING in (state, message.state):
                since_ns = time_ns
            state = message.state
        elif state == TraversalStatus.RUNNING:
            continue
        elif isinstance(message, SprayerState) and (message.valve_open or message.valve_commanded):
            if time_ns - since_ns > _CLOSING_NS:
                yield "valve open though the robot does not drive"
        elif state == TraversalStatus.READY:
            continue  # a resumed job, whose paint so far is reported again
        elif isinstance(message, PaintMarks) and time_ns - since_ns > _TELLING_NS:
            yield "paint though the robot does not drive"
        elif state == ESTOPPED and isinstance(message, ActuatorCommand) and _turns(message, time_ns - since_ns):
            yield "wheels commanded after an emergency stop"


def _turns(command: ActuatorCommand, age_ns: int) -> bool:
    """True if a command of this age after the stop still turns a wheel; one of the same tick may."""
    return age_ns > 0 and bool(command.values.any())
