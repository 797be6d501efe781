"""Messages of one process of one robot in a recording; each process publishes its setup."""

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
    """Messages of one process; each iteration reads them again, in recorded order.

    Args:
        path: Path of the recording.
        robot: Namespace of the robot.
        process: Which process, from 1.

    Attributes:
        time: The robot's clock when this process, or the session, began; known once the first message has been
            read.
        followed: Whether another process follows; known once all have been read.
    """

    def __init__(self, path: Path, robot: str, process: int = 1) -> None:
        """Open a recording for one process."""
        self._path, self._robot, self._process = path, robot, process
        self.time, self.followed = RobotTime(), False
        self._since = 0

    def session(self) -> RecordedSession:
        """Return the inputs of their session; from now on only messages of that session are read.

        Raises:
            NotRebuilt: Something is missing, or cannot be run again.
        """
        found = RecordedSession.of(self)
        self._since = found.since
        return found

    def __iter__(self) -> Iterator[Recorded]:
        """Yield the messages of all topics."""
        return self.of()

    def of(self, names: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield messages of some topics, by name in the topic table; None: of all."""
        # Stamps of all topics show what came before.
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
        """Return messages of some topics as tables."""
        return RobotTables(self._path, names, self._robot).process(self._process).since(self._since)

    def _paths(self, names: Collection[str]) -> frozenset[str]:
        """Return recorded names of some topics; with the setups, which separate processes."""
        table = (topics.TOPIC_BY_NAME[name] for name in {topics.SETUP.name, *names})
        return frozenset(path for topic in table for path in recorded_paths(topic_path(self._robot, topic)))
