"""Conflicts of two paths: stretches on which the bodies would come too near to each other, at any time."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP_M: Final = 0.2
"""Largest spacing of a path's samples."""
STOP_S: Final = 1.5
"""Time that a marker loses by braking to rest and speeding up again."""
_EIGHT: Final = np.ones((3, 3), dtype=np.int64)


class TimedPath(NamedTuple):
    """Path of one robot.

    Attributes:
        arc_m: (n,) arc lengths, not descending, at most `STEP_M` apart; equal ones are a turn on the spot.
        middles: (n, 2) middle of the body's disc there, map frame, m.
        time_s: (n,) time at which an unhindered robot is there.
        radius_m: Radius of a disc that holds the body.
        holds_m: (k,) arc lengths, ascending, at which it may wait; the first is 0.
        brakes_m: Stopping distance from the highest speed on it.
        back_m: Distance that it may go back along it after a stop, to resume its work: it has left a place for good
            once it is further beyond it than this.
        stop_s: Time lost by braking to rest and speeding up again.
    """

    arc_m: Floats
    middles: Floats
    time_s: Floats
    radius_m: float
    holds_m: Floats
    brakes_m: float
    back_m: float
    stop_s: float = STOP_S

    @property
    def end_m(self) -> float:
        """Arc length at which it ends."""
        return float(self.arc_m[-1])


@dataclass(frozen=True)
class Conflict:
    """Two robots must not be in these stretches of their paths at the same time.

    Attributes:
        robots: Both, by number.
        places_m: (n, 2) arc lengths on the one's path and on the other's: pairs of places that are too near.
        forced: The robot that has to go first, because it stands there from the start or the other one ends there; −1
            if either may.
        possible: False if both would have to.
    """

    robots: tuple[int, int]
    places_m: Floats
    forced: int = -1
    possible: bool = True

    def seen_by(self, robot: int) -> Floats:
        """Return (n, 2) the places, those on the path of this robot first."""
        return self.places_m if robot == self.robots[0] else self.places_m[:, ::-1]

    def other(self, robot: int) -> int:
        """Return the other robot."""
        return self.robots[1] if robot == self.robots[0] else self.robots[0]


def conflicts(paths: Sequence[TimedPath], apart_m: float) -> list[Conflict]:
    """Return all conflicts in which the bodies would be less than `apart_m` apart.

    Connected pairs of places are one conflict: on the plane of both arc lengths (the coordination space of O'Donnell
    and Lozano-Pérez, "Deadlock-free and collision-free coordination of two robot manipulators", ICRA 1989) it is one
    obstacle, which is passed on the one side or on the other.

    Args:
        paths: Paths of the robots, in their order.
        apart_m: From edge to edge of the discs, m.
    """
    from scipy.ndimage import label
    from scipy.spatial import cKDTree

    found = []
    for i, k in combinations(range(len(paths)), 2):
        one, other = paths[i], paths[k]
        far = one.radius_m + other.radius_m + apart_m + STEP_M
        pairs = cKDTree(one.middles).sparse_distance_matrix(cKDTree(other.middles), far, output_type="ndarray")
        if not len(pairs):
            continue
        near = np.zeros((len(one.arc_m), len(other.arc_m)), dtype=np.bool_)
        near[pairs["i"], pairs["j"]] = True
        numbers, count = label(near, structure=_EIGHT)
        rows, columns = np.nonzero(numbers)
        owner = numbers[rows, columns]
        for each in range(1, count + 1):
            chosen = owner == each
            places = np.column_stack((one.arc_m[rows[chosen]], other.arc_m[columns[chosen]]))
            found.append(_judged(Conflict((i, k), places), one.end_m, other.end_m))
    return found


def _judged(conflict: Conflict, *ends_m: float) -> Conflict:
    """Return the conflict with who has to go first: who starts there, or where the other ends."""
    forced = set()
    for robot, place, end_m in zip(conflict.robots, conflict.places_m.T, ends_m, strict=True):
        if place.min() <= 0.0:
            forced.add(robot)
        if place.max() >= end_m:
            forced.add(conflict.other(robot))
    return Conflict(conflict.robots, conflict.places_m, min(forced, default=-1), len(forced) < 2)
