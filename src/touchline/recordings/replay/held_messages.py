"""State at a time of a recording: the messages that give a receiver which joins then the same knowledge."""

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
    """Messages in force of one robot, each with its place among all cues."""

    last: dict[str, tuple[int, Cue]] = field(default_factory=dict)
    """Last message of each topic that does not accumulate."""
    states: list[tuple[int, Cue]] = field(default_factory=list)
    """First status of each state of the traversal that followed another one."""
    accumulated: list[tuple[int, Cue]] = field(default_factory=list)
    paint: list[tuple[int, Cue]] = field(default_factory=list)
    state: int | None = None

    def take(self, place: int, cue: Cue) -> None:
        """Take the next message of the robot."""
        topic = cue.topic
        if topic is topics.PAINT:
            self.paint.append((place, cue))
        elif topic in ACCUMULATING:
            self.accumulated.append((place, cue))
        else:
            self.last[topic.name] = place, cue
            if topic is topics.PLAN:  # paint belongs to the present plan
                self.paint.clear()
            elif topic is topics.STATUS:
                self._take_status(place, cue)

    def _take_status(self, place: int, cue: Cue) -> None:
        state = traversal_state(cue.payload)
        if state == self.state:
            return
        if state in _BUSY and self.state not in _BUSY:  # figures belong to a finished job
            for topic in _ENDED_JOB:
                self.last.pop(topic.name, None)
        self.states.append((place, cue))
        self.state = state


class HeldMessages:
    """Messages in force after those given to `take`, in their order."""

    def __init__(self) -> None:
        self._robots: dict[str, HeldOfRobot] = {}
        self._places = 0

    def take(self, cue: Cue) -> None:
        """Take the next message of the recording."""
        if cue.namespace not in self._robots:
            self._robots[cue.namespace] = HeldOfRobot()
        self._robots[cue.namespace].take(self._places, cue)
        self._places += 1

    def cues(self) -> Sequence[Cue]:
        """Return the messages in force, in recorded order."""
        held = {place: cue for robot in self._robots.values() for place, cue in _held(robot)}
        return [held[place] for place in sorted(held)]


def _held(robot: HeldOfRobot) -> Iterator[tuple[int, Cue]]:
    yield from robot.last.values()
    yield from robot.states
    yield from robot.accumulated
    yield from robot.paint
