"""Observation of a traversal after its end, until the robot has come to rest and all paint has fallen."""

from typing import Final

SETTLE_TICKS: Final = 100
RESTING_MPS: Final = 0.02


class Settling:
    """Ticks for which a traversal that has ended is observed.

    Attributes:
        just_over: True if the observation ended with the last tick.
    """

    def __init__(self) -> None:
        self._ticks = SETTLE_TICKS
        self.just_over = False

    @property
    def observes(self) -> bool:
        """True until the observation is over."""
        return self._ticks < SETTLE_TICKS

    def begin(self) -> None:
        """Begin a traversal, which is observed from its end on."""
        self._ticks = 0

    def end_tick(self, speed_mps: float, *, under_way: bool) -> None:
        """Observe the end of a tick, at this speed of the robot."""
        self.just_over = False
        if under_way:
            self.begin()
        elif self.observes:
            # One that was aborted at speed still brakes, and is watched for half of that once it rests.
            moving = abs(speed_mps) > RESTING_MPS
            self._ticks = min(self._ticks, SETTLE_TICKS // 2 - 1) + 1 if moving else self._ticks + 1
            self.just_over = self._ticks == SETTLE_TICKS
