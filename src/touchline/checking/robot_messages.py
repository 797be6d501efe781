"""The messages of one process of one robot in a recording: a robot whose process died is set up anew."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from touchline.checking.recorded_session import RecordedSession
from touchline.checking.robot_tables import ProcessTables, RobotTables
from touchline.recordings.channels import namespace_at, recorded_paths, topic_at, topic_path
from touchline.recordings.former_types import presented
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded
from touchline.recordings.recorder import is_stamped
from touchline.recordings.robot_time import RobotTime
from touchline.schemas import topics
from touchline.schemas.topics import Topic


class RobotMessages:
    """See the module; iterating reads them anew, in the order in which they were recorded.

    Args:
        path: Of the recording.
        robot: Its namespace.
        process: Which one, from 1.

    Attributes:
        time: The robot's, as it was when this process, or the session, began; known once the first message has been
            read.
        followed: Whether another process comes after it; known once all have been read.
    """

    def __init__(self, path: Path, robot: str, process: int = 1) -> None:
        """See the class."""
        self._path, self._robot, self._process = path, robot, process
        self.time, self.followed = RobotTime(), False
        self._since = 0

    def session(self) -> RecordedSession:
        """What has caused their session; from now on these are only the messages of that.

        Raises:
            NotRebuilt: Something is missing, or cannot be done again.
        """
        found = RecordedSession.of(self)
        self._since = found.since
        return found

    def __iter__(self) -> Iterator[Recorded]:
        """All of them."""
        return self.of()

    def of(self, names: Collection[str] | None = None) -> Iterator[Recorded]:
        """Those of some topics only, by name in the topic table; all if it is None."""
        # What passed before is told by the stamps of all topics.
        wanted = None if names is None or self._process > 1 or self._since else self._paths(names)
        own: dict[str, Topic | None] = {}
        process, states, time = 0, 0, RobotTime()
        for message in map(presented, RecordingReader(self._path).messages(wanted)):
            path = message.topic
            if path not in own:
                own[path] = topic_at(path) if namespace_at(path) == self._robot else None
            if (topic := own[path]) is None:
                continue
            process += topic is topics.SETUP
            now = max(process, 1)
            states += topic is topics.INITIAL_STATE and now == self._process
            if now < self._process or states < self._since:
                if is_stamped(topic):
                    time.hear(message.publish_time_ns, topic is topics.CLOCK)
                continue
            if now > self._process:
                self.followed = True
                return
            self.time = time
            if names is None or topic.name in names:
                yield message

    def tables(self, names: Collection[str]) -> ProcessTables:
        """Those of some topics as tables."""
        return RobotTables(self._path, names, self._robot).process(self._process).since(self._since)

    def _paths(self, names: Collection[str]) -> frozenset[str]:
        """By which topics may have been recorded; with the setups, which tell processes apart."""
        table = (topics.TOPIC_BY_NAME[name] for name in {topics.SETUP.name, *names})
        return frozenset(path for topic in table for path in recorded_paths(topic_path(self._robot, topic)))
