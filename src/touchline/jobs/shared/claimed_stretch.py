"""Stretch of a path that a robot of a shared job has for itself: from the passed part to the end of its authority."""

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
"""Empty claim (from, to), m."""
SAGITTA_M: Final = 0.05
"""Largest distance of chords from the path."""
PUBLISH_EVERY_S: Final = 2.0
"""Least time between messages that only release path, as long as nobody waits for it."""
_MOST_TURN_RAD: Final = math.pi / 2
_STRAIGHT_ON_RAD: Final = 1e-9
_NO_PATH: Final = np.zeros((0, 7))


def stretch_poses(rows: Floats, turns_rad: Floats, from_m: float, to_m: float) -> Floats:
    """Return poses along a stretch of a path: its ends, ends of straights, and as many on arcs as `SAGITTA_M` requires.

    Args:
        rows: (n, 7) rows of `cut_path`.
        turns_rad: (n,) turn on the spot of each row, 0 for others.
        from_m: Arc length of the beginning.
        to_m: Arc length of the end.

    Returns:
        (m, 3) x, y (m) and heading (rad), map frame; empty unless `from_m` < `to_m`.
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
    # The end of each is the beginning of the next, and has no pose of its own where both are on one straight line.
    index = np.concatenate(([0], np.repeat(np.arange(len(own)), counts)))
    number = np.concatenate([[0], *(np.arange(1, count + 1) for count in counts)])
    share = number / counts[index]
    poses = poses_along(own[index], first_m[index] + share * (last_m - first_m)[index])
    poses[:, 2] += share * turns[index]
    return poses[~_amid_a_straight(own, index, number == counts[index])]


def _amid_a_straight(rows: Floats, index: NDArray[np.int64], at_the_end: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark the poses that end a straight that another one continues."""
    straight = (rows[:, 3] == 0.0) & (rows[:, 6] != SPIN)
    goes_on = straight[:-1] & straight[1:] & (rows[:-1, 6] == rows[1:, 6])
    goes_on &= np.abs(np.diff(rows[:, 2])) < _STRAIGHT_ON_RAD
    found: NDArray[np.bool_] = at_the_end & np.append(goes_on, False)[index]
    return found


def as_path(poses: Floats) -> NavPath:
    """Convert poses (n, 3) to a path message without a time: it is valid until the next one."""
    header = Header(frame_id=MAP_FRAME)
    stamped = [
        PoseStamped(
            header=header,
            pose=Pose(
                position=Point(x=x, y=y), orientation=Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
            ),
        )
        for x, y, heading in poses.tolist()
    ]
    return NavPath(header=header, poses=tuple(stamped))


class ClaimedStretch:
    """Publishes the stretch of its path that a robot has for itself; see `publish_stretches`.

    Args:
        send: Publishes a path.
    """

    def __init__(self, send: Callable[[NavPath], None]) -> None:
        """Claim nothing yet."""
        self._send = send
        self._rows, self._turns_rad = _NO_PATH, np.zeros(0)
        self._claimed_m = self._published_m = NOTHING
        self._published_s = -math.inf

    def take(self, segments: tuple[Segment, ...], vehicle: Vehicle) -> None:
        """Switch to another path.

        Args:
            segments: Segments of the path, map frame.
            vehicle: Vehicle that drives it.
        """
        self.release()
        self._rows, legs = cut_path(segments, vehicle)
        self._turns_rad = np.zeros(len(self._rows))
        for leg in legs:
            self._turns_rad[leg.first] = leg.turn_rad

    def claim(self, from_m: float, to_m: float) -> None:
        """Claim a stretch of the path.

        Args:
            from_m: Arc length up to which the robot has passed.
            to_m: Arc length up to which it may drive.
        """
        self._claimed_m = (from_m, to_m) if from_m < to_m else NOTHING

    def release(self) -> None:
        """Release the claim and publish that at once."""
        self._claimed_m = NOTHING
        if self._published_m != NOTHING:
            self._publish(NOTHING, self._published_s)

    @property
    def grown(self) -> bool:
        """True if the robot may drive further than was published."""
        return self._claimed_m[1] > self._published_m[1]

    def publish_passed(self, now_s: float, *, at_once: bool = False) -> None:
        """Publish the passed part, if the robot drives on `at_once` or if nothing was published for a while.

        Args:
            now_s: Any monotonic clock.
            at_once: True to publish without waiting.
        """
        from_m, to_m = self._claimed_m[0], min(self._claimed_m[1], self._published_m[1])
        remaining_m = (from_m, to_m) if from_m < to_m else NOTHING
        shorter = remaining_m[1] < self._published_m[1]
        if remaining_m != self._published_m and (shorter or at_once or now_s - self._published_s >= PUBLISH_EVERY_S):
            self._publish(remaining_m, now_s)

    def publish_granted(self, now_s: float) -> None:
        """Publish the granted part, if it reaches further than was published."""
        if self.grown:
            self._publish(self._claimed_m, now_s)

    def _publish(self, stretch_m: tuple[float, float], now_s: float) -> None:
        self._published_m, self._published_s = stretch_m, now_s
        self._send(as_path(stretch_poses(self._rows, self._turns_rad, *stretch_m)))


def publish_stretches(stretches: Sequence[ClaimedStretch], now_s: float) -> None:
    """Publish changes: parts that robots have passed before parts that others were granted for it.

    So published stretches are never nearer to each other than those that the traffic rules grant.

    Args:
        stretches: Stretches of all robots.
        now_s: Any monotonic clock.
    """
    at_once = any(each.grown for each in stretches)
    for each in stretches:
        each.publish_passed(now_s, at_once=at_once)
    for each in stretches:
        each.publish_granted(now_s)
