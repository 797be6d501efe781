"""The stretch of a path that a robot of a shared job has for itself: from where it has passed to how far it may go."""

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.trajectory.path import SPIN, cut_path, poses_along
from touchline.schemas.frames import MAP_FRAME
from touchline.schemas.messages import Header, NavPath, Point, Pose, PoseStamped, Quaternion, Segment
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

NOTHING: Final = (0.0, 0.0)
"""From where to where: not claimed at all."""
SAGITTA_M: Final = 0.05
"""Chords leave the path by no more."""
TOLD_EVERY_S: Final = 2.0
"""That it has passed more of its stretch is told no more often, as long as nobody may drive further for that."""
_MOST_TURN_RAD: Final = math.pi / 2
_STRAIGHT_ON_RAD: Final = 1e-9
_NO_PATH: Final = np.zeros((0, 7))


def stretch_poses(rows: Floats, turns_rad: Floats, from_m: float, to_m: float) -> Floats:
    """Poses along a stretch of a path: its ends, those of straights, and on arcs as many as it takes.

    Args:
        rows: (n, 7) the path, as `cut_path` has it.
        turns_rad: (n,) of these, by how much each that is a turn on the spot turns.
        from_m: Arc length at which it begins.
        to_m: Arc length at which it ends.

    Returns:
        (m, 3) x, y (m) and heading (rad); none unless the one is before the other.
    """
    if not from_m < to_m:
        return np.zeros((0, 3))
    begins_m, ends_m = rows[:, 5], rows[:, 5] + rows[:, 4]
    on_the_spot = rows[:, 6] == SPIN
    inside = np.where(on_the_spot, (begins_m >= from_m) & (begins_m <= to_m), (begins_m < to_m) & (ends_m > from_m))
    own, spins, turns = rows[inside], on_the_spot[inside], np.where(on_the_spot, turns_rad, 0.0)[inside]
    if not len(own):
        return np.zeros((0, 3))
    first_m = np.maximum(from_m - own[:, 5], 0.0)
    last_m = np.minimum(to_m - own[:, 5], own[:, 4])
    bends_rad = np.where(spins, turns, own[:, 3] * (last_m - first_m))
    flattest = np.arccos(np.clip(1.0 - SAGITTA_M * np.abs(own[:, 3]), 0.0, 1.0))
    step_rad = np.where(spins | (flattest == 0.0), _MOST_TURN_RAD, np.minimum(2.0 * flattest, _MOST_TURN_RAD))
    counts = np.maximum(np.ceil(np.abs(bends_rad) / step_rad), 1.0).astype(int)
    # The end of each is the beginning of the next, and no pose of its own where both are on one straight line.
    index = np.concatenate(([0], np.repeat(np.arange(len(own)), counts)))
    number = np.concatenate([[0], *(np.arange(1, count + 1) for count in counts)])
    share = number / counts[index]
    poses = poses_along(own[index], first_m[index] + share * (last_m - first_m)[index])
    poses[:, 2] += share * turns[index]
    return poses[~_amid_a_straight(own, index, number == counts[index])]


def _amid_a_straight(rows: Floats, index: NDArray[np.int64], at_the_end: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which poses are at the end of a straight that another one goes on from."""
    straight = (rows[:, 3] == 0.0) & (rows[:, 6] != SPIN)
    goes_on = straight[:-1] & straight[1:] & (rows[:-1, 6] == rows[1:, 6])
    goes_on &= np.abs(np.diff(rows[:, 2])) < _STRAIGHT_ON_RAD
    found: NDArray[np.bool_] = at_the_end & np.append(goes_on, False)[index]
    return found


def as_path(poses: Floats) -> NavPath:
    """Poses (n, 3) as they are told. It has no time of its own: it holds until another one is told."""
    header = Header(frame_id=MAP_FRAME)
    told = [
        PoseStamped(
            header=header,
            pose=Pose(
                position=Point(x=x, y=y), orientation=Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
            ),
        )
        for x, y, heading in poses.tolist()
    ]
    return NavPath(header=header, poses=tuple(told))


class ClaimedStretch:
    """Tells which stretch of its path a robot has for itself; see `tell_stretches`.

    Args:
        send: Tells it.
    """

    def __init__(self, send: Callable[[NavPath], None]) -> None:
        """It claims nothing yet."""
        self._send = send
        self._rows, self._turns_rad = _NO_PATH, np.zeros(0)
        self._claimed_m = self._told_m = NOTHING
        self._told_s = -math.inf

    def take(self, segments: tuple[Segment, ...], vehicle: Vehicle) -> None:
        """The robot is given another path."""
        self.give_up()
        self._rows, legs = cut_path(segments, vehicle)
        self._turns_rad = np.zeros(len(self._rows))
        for leg in legs:
            self._turns_rad[leg.first] = leg.turn_rad

    def claim(self, from_m: float, to_m: float) -> None:
        """It has passed one place of its path, and may drive as far as another."""
        self._claimed_m = (from_m, to_m) if from_m < to_m else NOTHING

    def give_up(self) -> None:
        """It claims nothing any more, which is told at once."""
        self._claimed_m = NOTHING
        if self._told_m != NOTHING:
            self._tell(NOTHING, self._told_s)

    @property
    def grown(self) -> bool:
        """Whether it may drive further than was told."""
        return self._claimed_m[1] > self._told_m[1]

    def tell_passed(self, now_s: float, *, at_once: bool = False) -> None:
        """Tell what it claims no more; that it drives on `at_once`, or if that was not told for a while."""
        from_m, to_m = self._claimed_m[0], min(self._claimed_m[1], self._told_m[1])
        left_m = (from_m, to_m) if from_m < to_m else NOTHING
        shorter = left_m[1] < self._told_m[1]
        if left_m != self._told_m and (shorter or at_once or now_s - self._told_s >= TOLD_EVERY_S):
            self._tell(left_m, now_s)

    def tell_granted(self, now_s: float) -> None:
        """Tell how far it may drive, if that is further than was told."""
        if self.grown:
            self._tell(self._claimed_m, now_s)

    def _tell(self, stretch_m: tuple[float, float], now_s: float) -> None:
        self._told_m, self._told_s = stretch_m, now_s
        self._send(as_path(stretch_poses(self._rows, self._turns_rad, *stretch_m)))


def tell_stretches(stretches: Sequence[ClaimedStretch], now_s: float) -> None:
    """Tell what has changed: what robots have passed before what others were granted for that.

    So stretches as they were told last are never nearer to each other than those that the traffic rules grant.

    Args:
        stretches: Of all robots.
        now_s: Of any clock that goes on.
    """
    at_once = any(each.grown for each in stretches)
    for each in stretches:
        each.tell_passed(now_s, at_once=at_once)
    for each in stretches:
        each.tell_granted(now_s)
