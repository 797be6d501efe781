"""Topics that are asked for by name: in full, by a name of older recordings, or without the robot's namespace."""

from collections.abc import Collection, Generator, Sequence
from contextlib import closing
from pathlib import Path

from touchline.recordings.channels import recorded_paths
from touchline.recordings.former_types import presented
from touchline.recordings.output import RecordingError
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded, Summary


def is_asked(path: str, names: Sequence[str]) -> bool:
    """Whether the topic recorded as ``path`` is one of ``names``; ``gnss/fix`` is that of every robot."""
    every = {each for name in names for each in recorded_paths(name)}
    return path in every or any(path.endswith(f"/{name.strip('/')}") for name in names if not name.startswith("/"))


class RecordedTopics:
    """The messages of some topics of a recording.

    Args:
        path: The recording.
        names: Of the topics; all if there are none.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path, self._names = path, names
        self._reader = RecordingReader(path)
        self._asked: dict[str, bool] = {}

    @property
    def summary(self) -> Summary:
        """What the recording holds."""
        return self._reader.summary

    def messages(self) -> Generator[Recorded, None, None]:
        """The messages, in the order in which they were recorded, of their present types.

        Raises:
            RecordingError: It is no recording, or has not one of the topics.
        """
        with closing(self._reader) as reader:
            yield from map(presented, filter(self._takes, reader.messages()))
        absent = [name for name in self._names if not self._has(name, reader.summary.topics)]
        if absent:
            raise RecordingError(f"{self._path}: has no topic {', '.join(absent)}; `touchline info` lists them")

    def _takes(self, message: Recorded) -> bool:
        if message.topic not in self._asked:
            self._asked[message.topic] = not self._names or is_asked(message.topic, self._names)
        return self._asked[message.topic]

    @staticmethod
    def _has(name: str, topics: Collection[str]) -> bool:
        return any(is_asked(path, (name,)) for path in topics)
