"""Detection of standstills of this process, in which its peers may have cut it off."""

from collections.abc import Callable
from typing import Final

from touchline.bus.common_settings import PATIENCE_S

#: A turn that takes longer is a standstill; nobody is cut off earlier.
STANDSTILL_S: Final = 0.5 * PATIENCE_S
_MEET_S: Final = 0.5


class StandstillDetector:
    """Observer of every turn of a loop.

    Attributes:
        lost_s: The longest time between two turns since the last recovery, if that was a standstill; else 0.
        peers: Ids of the sessions that this process had a link to before.
    """

    def __init__(self) -> None:
        """Start before the first turn."""
        self.lost_s = 0.0
        self.peers: frozenset[str] = frozenset()
        self._turned_s: float | None = None
        self._met_s: float | None = None

    @property
    def lost(self) -> bool:
        """True if the process stood still."""
        return self.lost_s > 0.0

    def turn(self, now_s: float) -> None:
        """Note a turn of the loop."""
        if self._turned_s is not None and now_s - self._turned_s >= STANDSTILL_S:
            self.lost_s = max(self.lost_s, now_s - self._turned_s)
        self._turned_s = now_s

    def meet(self, peers: Callable[[], frozenset[str]]) -> None:
        """Note the present links now and then, while the process runs steadily."""
        assert self._turned_s is not None
        if not self.lost and (self._met_s is None or self._turned_s - self._met_s >= _MEET_S):
            self._met_s = self._turned_s
            self.peers = peers()

    def recovered(self) -> float:
        """Start over; return how long the standstill before took, if there was one."""
        lost_s, self.lost_s = self.lost_s, 0.0
        self._met_s = None
        return lost_s
