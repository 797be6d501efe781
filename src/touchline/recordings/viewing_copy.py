"""Addition of viewers' messages to recordings that were made without them."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from touchline.recordings.channels import channel_metadata, is_drawn, kind_of, topic_path
from touchline.recordings.former_types import presented
from touchline.recordings.recorded import Recorded
from touchline.recordings.replay.replayer import recorded_robots
from touchline.recordings.salvage import CopyPlan, Salvaged, copied
from touchline.recordings.sendable import SendableTopics
from touchline.recordings.viewing import Viewing, frame_prefix
from touchline.schemas.topics import VIEWING


def copy_with_viewing(source: Path, target: Path) -> tuple[Salvaged, int]:
    """Copy a recording with viewers' messages of its robots, made anew where it has them already.

    All else is copied unchanged.

    Returns:
        Result of the copy, and the number of viewers' messages.

    Raises:
        RecordingError: The source is no recording or has no robot, or the target exists or cannot be written.
    """
    drawing = _Drawing(recorded_robots(source))
    found = copied(source, target, CopyPlan("touchline_drawn", drawing.pass_on, drawing.channels))
    return found, sum(drawing.counts.values())


class _Drawing:
    """Drawing of each robot, inserted behind its source messages."""

    def __init__(self, robots: tuple[str, ...]) -> None:
        self._robots = robots
        self._viewings = {robot: Viewing(frame_prefix(robot, robots)) for robot in robots}
        self._known = SendableTopics()
        self.channels = {topic_path(robot, topic): channel_metadata(topic) for robot in robots for topic in VIEWING}
        self.counts: Counter[str] = Counter()

    def pass_on(self, message: Recorded) -> Iterator[Recorded]:
        """Yield the message, unless it is a viewers' one itself, and what is drawn of it."""
        if is_drawn(message.topic, self._robots):
            return
        yield message
        present = presented(message)
        known = self._known.find(present.topic, present.kind)
        viewing = self._viewings.get(known.namespace) if known is not None else None
        if known is None or viewing is None:
            return
        for drawn in viewing.take(known.topic.name, present.payload):
            name = topic_path(known.namespace, drawn.topic)
            self.counts[name] += 1
            yield message._replace(
                topic=name, sequence=self.counts[name], payload=drawn.payload, kind=kind_of(drawn.topic.type)
            )
