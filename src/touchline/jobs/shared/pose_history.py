"""Poses of robots at equal instants of the wall clock, although messages of one arrive later than another's.

A robot clears a place, reports that, and another one is let in. If the first robot's messages arrive after the second
one's, their latest messages would put both in the same place.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PATIENCE_S: Final = 2.0
"""Wall-clock time after which a silent robot counts as standing."""
_SENT, _POSE = 0, slice(1, 4)


class PoseHistory:
    """Reported true poses of one robot.

    Attributes:
        rows: (n, 4) in order: time of sending (s since the epoch), x (m), y (m), heading (rad).
    """

    def __init__(self) -> None:
        """Start without poses."""
        self.rows: Floats = np.zeros((0, 4))

    def add(self, rows: Floats) -> None:
        """Add the next rows."""
        self.rows = np.concatenate((self.rows, rows))

    def forget(self) -> None:
        """Drop all poses, because the robot is carried elsewhere."""
        self.rows = self.rows[:0]

    def since(self, sent_s: float) -> None:
        """Drop poses before a time."""
        self.rows = self.rows[max(int(np.searchsorted(self.rows[:, _SENT], sent_s, side="right")) - 1, 0) :]


def simultaneous_poses(seen: Mapping[str, PoseHistory], stand: set[str], now_s: float) -> dict[str, Floats]:
    """Return poses of all robots that have any, at all instants known of all of them and not returned before.

    Args:
        seen: History of each robot; rows that are no longer needed are dropped.
        stand: Robots that report no pose, or no new one.
        now_s: Wall clock, seconds since the epoch.

    Returns:
        (n, 3) poses of each at the same n instants; empty if there is no such instant yet.
    """
    known = {name: each for name, each in seen.items() if len(each.rows)}
    if not known:
        return {}
    moving = [float(each.rows[-1, _SENT]) for name, each in known.items() if name not in stand]
    until_s = min((max(sent_s, now_s - PATIENCE_S) for sent_s in moving), default=now_s)
    sent_s = np.unique(np.concatenate([each.rows[:, _SENT] for each in known.values()]))
    since_s = max(float(each.rows[0, _SENT]) for each in known.values())
    instants_s = sent_s[(sent_s >= since_s) & (sent_s <= until_s)]
    poses = {name: _at(each.rows, instants_s) for name, each in known.items() if len(instants_s)}
    for each in known.values():
        each.since(until_s)
    return poses


def _at(rows: Floats, instants_s: Floats) -> Floats:
    """Return (n, 3) poses at each instant, by the rows that the robot had sent until then."""
    poses: Floats = rows[np.searchsorted(rows[:, _SENT], instants_s, side="right") - 1, _POSE]
    return poses
