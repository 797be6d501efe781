"""Times at which the messages of a recording are due: log times, on one time shared by all of its robots."""

import numpy as np
from numpy.typing import NDArray

#: A log time further back than this is no late measurement: the recorded clock restarted (a restarted robot).
RESTART_NS = 2_000_000_000
#: A log time further ahead than this is damage: no session is silent for so long.
LONGEST_SILENCE_NS = 24 * 3600 * 1_000_000_000
#: A robot further behind the others than this was not running while they were.
APART_NS = 1_000_000_000


class DueTimes:
    """Converts each message's log time, in recorded order, to the time at which it is due: 0 for the first one."""

    def __init__(self) -> None:
        self._robots: dict[str, _RobotTime] = {}
        self._at_ns = 0

    def next_ns(self, robot: str, log_time_ns: int) -> int:
        """Return the time at which the next message is due, with this robot and log time."""
        if robot not in self._robots:
            self._robots[robot] = _RobotTime()
        self._at_ns = self._robots[robot].at_ns(log_time_ns, self._at_ns)
        return self._at_ns


def due_times_ns(robots: NDArray[np.int64], log_time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the times of `DueTimes` for all messages of a recording, with robots by number."""
    latest = np.maximum.accumulate(log_time_ns)
    steady = bool(np.all(log_time_ns >= latest - RESTART_NS) and np.all(np.diff(latest) <= LONGEST_SILENCE_NS))
    if steady and (not len(robots) or bool(np.all(robots == robots[0]))):
        return latest - latest[:1]
    times, names = DueTimes(), [str(number) for number in range(int(robots.max()) + 1)]
    each = zip(robots.tolist(), log_time_ns.tolist(), strict=True)
    return np.fromiter((times.next_ns(names[robot], log_ns) for robot, log_ns in each), np.int64, len(robots))


class _RobotTime:
    """Progress of one robot's replay, on the time that all robots of the recording share."""

    def __init__(self) -> None:
        self._latest_ns: int | None = None
        self._elapsed_ns = 0

    def at_ns(self, log_time_ns: int, shared_ns: int) -> int:
        """Return when a message of this log time is due; ``shared_ns`` is the time of the one before it, of any robot.

        A robot whose clock stood while others continued joins them where they are: its messages were recorded after
        theirs.
        """
        latest_ns = self._latest_ns
        if latest_ns is None or not latest_ns - RESTART_NS <= log_time_ns <= latest_ns + LONGEST_SILENCE_NS:
            latest_ns = log_time_ns
        self._elapsed_ns += max(log_time_ns - latest_ns, 0)
        self._latest_ns = max(latest_ns, log_time_ns)
        if self._elapsed_ns < shared_ns - APART_NS:
            self._elapsed_ns = shared_ns
        return max(self._elapsed_ns, shared_ns)
