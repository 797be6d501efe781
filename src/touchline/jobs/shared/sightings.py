"""Where robots were at the same instants of the wall clock, though what one has told arrives later than another's.

A robot makes way, says so, and another one is let in. What tells of the way of the first may be heard after what tells
of the second: by the last that was heard of either they would be in the same place.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PATIENCE_S: Final = 2.0
"""By the wall clock: who has told nothing for longer stands where it was."""
_SENT, _POSE = 0, slice(1, 4)


class Sightings:
    """True poses of one robot as it has told them.

    Attributes:
        rows: (n, 4) in order: when it was sent (s since the epoch), x (m), y (m), heading (rad).
    """

    def __init__(self) -> None:
        """None yet."""
        self.rows: Floats = np.zeros((0, 4))

    def add(self, rows: Floats) -> None:
        """Take what came next."""
        self.rows = np.concatenate((self.rows, rows))

    def forget(self) -> None:
        """From now on it is elsewhere."""
        self.rows = self.rows[:0]

    def since(self, sent_s: float) -> None:
        """Only where it was then and later is asked for from now on."""
        self.rows = self.rows[max(int(np.searchsorted(self.rows[:, _SENT], sent_s, side="right")) - 1, 0) :]


def together(seen: Mapping[str, Sightings], stand: set[str], now_s: float) -> dict[str, Floats]:
    """Poses of all robots that are somewhere, at all instants that are known of all of them and were not asked for yet.

    Args:
        seen: What has been heard of each; of that only what is needed later is kept.
        stand: Who will tell nothing, or nothing else, of where it is.
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
    """(n, 3) where the robot was at each instant, by what it had sent until then."""
    poses: Floats = rows[np.searchsorted(rows[:, _SENT], instants_s, side="right") - 1, _POSE]
    return poses
