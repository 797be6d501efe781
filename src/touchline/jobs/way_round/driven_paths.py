"""Paths that a robot on the bus has driven, of one plan after another."""

from operator import itemgetter

from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.services.robot_sim.accounting.travelled_path import travelled_path


class DrivenPaths:
    """Plans that a robot has taken, and how far it has come along each, by its own record."""

    def __init__(self, bus: Bus) -> None:
        """Subscribe; the last plan of an earlier job may be the first to arrive."""
        self._inbox = bus.inbox([topics.PLAN, topics.STATUS])
        self._told: list[tuple[int, Trajectory | float]] = []

    def listen(self) -> None:
        """Collect what has arrived since the last call."""
        for sample, message in self._inbox.messages():
            if isinstance(message, Trajectory):
                self._told.append((sample.source_time_ns, message))
            elif isinstance(message, TraversalStatus):
                self._told.append((sample.source_time_ns, message.arc_length_m))

    def last(self, count: int) -> list[Trajectory]:
        """Return the paths of the last plans along which the robot has moved.

        Args:
            count: Number of plans.
        """
        found = list[tuple[Trajectory, float]]()
        for _, told in sorted(self._told, key=itemgetter(0)):
            if isinstance(told, Trajectory):
                found.append((told, 0.0))
            elif found:
                found[-1] = found[-1][0], told
        return [travelled_path(plan, reached_m) for plan, reached_m in found if reached_m > 0.0][-count:]
