"""Topics requested by name: in full, by a name of older recordings, or without the robot's namespace."""

from collections.abc import Collection, Generator, Sequence
from contextlib import closing
from pathlib import Path

from touchline.recordings.channels import recorded_paths
from touchline.recordings.former_types import presented
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded, Summary
from touchline.recordings.recording_file import RecordingError


def is_selected(path: str, names: Sequence[str]) -> bool:
    """Return whether the topic recorded as ``path`` is one of ``names``; ``gnss/fix`` is that of every robot."""
    every = {each for name in names for each in recorded_paths(name)}
    return path in every or any(path.endswith(f"/{name.strip('/')}") for name in names if not name.startswith("/"))


class RecordedTopics:
    """Messages of some topics of a recording.

    Args:
        path: The recording.
        names: Names of the topics; none: all.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path, self._names = path, names
        self._reader = RecordingReader(path)
        self._asked: dict[str, bool] = {}

    @property
    def summary(self) -> Summary:
        """Contents of the recording."""
        return self._reader.summary

    def messages(self) -> Generator[Recorded, None, None]:
        """Yield the messages in recorded order, converted to their present types.

        Raises:
            RecordingError: It is no recording, or lacks one of the topics.
        """
        with closing(self._reader) as reader:
            yield from map(presented, filter(self._takes, reader.messages()))
        absent = [name for name in self._names if not self._has(name, reader.summary.topics)]
        if absent:
            raise RecordingError(f"{self._path}: has no topic {', '.join(absent)}; `touchline info` lists them")

    def _takes(self, message: Recorded) -> bool:
        if message.topic not in self._asked:
            self._asked[message.topic] = not self._names or is_selected(message.topic, self._names)
        return self._asked[message.topic]

    @staticmethod
    def _has(name: str, topics: Collection[str]) -> bool:
        return any(is_selected(path, (name,)) for path in topics)
