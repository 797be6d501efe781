"""Gates: places at which a robot waits until another one has come far enough."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from touchline.coordination.traffic.conflicts import Conflict, TimedPath

CLEAR_M: Final = 0.6
"""Distance at which a robot waits before the first place that is too near: it comes to rest within centimetres of where
it may, and paths are sampled every 0.2 m.
"""


class Gate(NamedTuple):
    """A robot may pass `at_m` of its path only once another one has passed `clear_m` of its own.

    Attributes:
        robot, at_m: Who waits, and where.
        other, clear_m: For whom, and how far that has to have come; beyond its path's end: it has to be done.
    """

    robot: int
    at_m: float
    other: int
    clear_m: float


def gates(conflict: Conflict, first: int, path: TimedPath, back_m: float) -> list[Gate] | None:
    """Return the gates of the robot that goes second, or None if it has no place to wait at.

    It may follow into the stretch as far as the next place where it can wait, once the first one will not come back to
    anything that is too near to that.

    Args:
        conflict: The conflict.
        first: The robot that goes first.
        path: Path of the other one.
        back_m: Distance that the first one may go back along its own path after a stop.
    """
    second = conflict.other(first)
    places = conflict.seen_by(second)
    order = np.argsort(places[:, 0], kind="stable")
    own_m, latest_m = places[order, 0], np.maximum.accumulate(places[order, 1])
    before = path.holds_m[(path.holds_m <= own_m[0] - CLEAR_M) | ((path.holds_m == 0.0) & (own_m[0] > 0.0))]
    if not len(before):
        return None
    waits_m = [float(before[-1]), *path.holds_m[(path.holds_m > before[-1]) & (path.holds_m < own_m[-1])].tolist()]
    found = list[Gate]()
    for at_m, next_m in zip(waits_m, [*waits_m[1:], np.inf], strict=True):
        reached = int(np.searchsorted(own_m, next_m + CLEAR_M, side="right"))
        clear_m = float(latest_m[reached - 1]) + back_m if reached else -np.inf
        if clear_m > (found[-1].clear_m if found else -np.inf):
            found.append(Gate(second, at_m, first, clear_m))
    return found


def authorities_m(waiting: Sequence[Gate], progress_m: Sequence[float]) -> list[float]:
    """Return the arc length up to which each robot may drive now; infinite if no gate remains.

    Authority grows with the reported progress of others: a report that comes late, or never, leaves them waiting where
    they are safe.

    Args:
        waiting: All gates.
        progress_m: Reported arc length of each robot; infinite once it is done with its path.
    """
    until_m = [np.inf] * len(progress_m)
    for gate in waiting:
        if progress_m[gate.other] < gate.clear_m:
            until_m[gate.robot] = min(until_m[gate.robot], gate.at_m)
    return until_m
