"""What holds at a time of a recording: the messages by which a receiver that hears nothing before knows as much."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from touchline.recordings.replay.replay_cue import Cue
from touchline.schemas import topics
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.traversal_state import traversal_state

#: Of these every message counts, of others the last.
ACCUMULATING = (topics.EVENTS, topics.ORDERS, topics.PAINT)
_ENDED_JOB = (topics.REPORT, topics.AREA_REPORT)
_BUSY = (TraversalStatus.RUNNING, TraversalStatus.PAUSED)


@dataclass
class HeldOfRobot:
    """What holds of one robot, each with its place among all cues."""

    last: dict[str, tuple[int, Cue]] = field(default_factory=dict)
    """Of each topic that does not accumulate."""
    states: list[tuple[int, Cue]] = field(default_factory=list)
    """The first status of each state of the traversal that followed on another."""
    said: list[tuple[int, Cue]] = field(default_factory=list)
    paint: list[tuple[int, Cue]] = field(default_factory=list)
    state: int | None = None

    def take(self, place: int, cue: Cue) -> None:
        """The next message of the robot."""
        topic = cue.topic
        if topic is topics.PAINT:
            self.paint.append((place, cue))
        elif topic in ACCUMULATING:
            self.said.append((place, cue))
        else:
            self.last[topic.name] = place, cue
            if topic is topics.PLAN:  # what is told of paint is of the present plan
                self.paint.clear()
            elif topic is topics.STATUS:
                self._take_status(place, cue)

    def _take_status(self, place: int, cue: Cue) -> None:
        state = traversal_state(cue.payload)
        if state == self.state:
            return
        if state in _BUSY and self.state not in _BUSY:  # figures are those of a job that is over
            for topic in _ENDED_JOB:
                self.last.pop(topic.name, None)
        self.states.append((place, cue))
        self.state = state


class HeldMessages:
    """What holds after the messages that were given to `take`, in their order."""

    def __init__(self) -> None:
        self._robots: dict[str, HeldOfRobot] = {}
        self._places = 0

    def take(self, cue: Cue) -> None:
        """The next message of the recording."""
        if cue.namespace not in self._robots:
            self._robots[cue.namespace] = HeldOfRobot()
        self._robots[cue.namespace].take(self._places, cue)
        self._places += 1

    def cues(self) -> Sequence[Cue]:
        """The messages by which it is known, in the order in which they were recorded."""
        held = {place: cue for robot in self._robots.values() for place, cue in _held(robot)}
        return [held[place] for place in sorted(held)]


def _held(robot: HeldOfRobot) -> Iterator[tuple[int, Cue]]:
    yield from robot.last.values()
    yield from robot.states
    yield from robot.said
    yield from robot.paint
