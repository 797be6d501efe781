"""True places of a team's robots, by the ticks of their clocks or as they come: contacts, and how long they stand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from benchmarks._team_wishes import BODY_M
from touchline.schemas.messages import Odometry

_STANDS_MPS: Final = 0.01


class TrueDrives:
    """Drives of some robots in a square, as observed.

    Args:
        names: The robots.
        side_m: Side of the square, whose corner is the origin.
        in_step: Whether their clocks are the same. If not, the place of each is compared with the last ones of the
            others that came before it: by ticks a robot would touch another that left the place a moment ago.

    Attributes:
        drove_ticks: Last tick at which each robot was driving; −1: none yet.
    """

    def __init__(self, names: Iterable[str], side_m: float, *, in_step: bool = True) -> None:
        self._at: dict[str, dict[int, tuple[complex, float]]] = {name: {} for name in names}
        self._in_step, self._last = in_step, dict[str, complex]()
        self._as_they_came: dict[frozenset[str], list[float]] = {}
        self._side_m, self.drove_ticks = side_m, dict.fromkeys(self._at, -1)

    def take(self, name: str, odometry: Odometry) -> None:
        """Take a robot's true odometry."""
        tick, place = round(100 * odometry.header.stamp.seconds), odometry.pose.pose.position
        speed_mps = odometry.twist.twist.linear.x
        here = complex(place.x, place.y)
        self._at[name][tick] = here, abs(speed_mps)
        self._last[name] = here
        for other, there in self._last.items():
            if other != name:
                self._as_they_came.setdefault(frozenset((name, other)), []).append(abs(here - there))
        if abs(speed_mps) >= _STANDS_MPS:
            self.drove_ticks[name] = tick

    @property
    def ticks(self) -> dict[str, int]:
        """Last tick of each robot; −1: none yet."""
        return {name: next(reversed(drive), -1) for name, drive in self._at.items()}

    def stood_s(self, name: str, since_tick: int, told_tick: int) -> float:
        """Return the longest time (s) for which a robot stood.

        Args:
            name: The robot.
            since_tick: From this tick on…
            told_tick: …until it first drove after this one.
        """
        longest, drove_tick = 0, since_tick
        for tick in (tick for tick in self._at[name] if tick > since_tick):
            longest = max(longest, tick - drove_tick)
            if self._at[name][tick][1] >= _STANDS_MPS:
                if tick > told_tick:
                    break
                drove_tick = tick
        return longest / 100.0

    @property
    def _apart_m(self) -> list[np.ndarray]:
        if not self._in_step:
            return [np.array(each) for each in self._as_they_came.values()]
        pairs = combinations(self._at.values(), 2)
        return [np.array([abs(one[t][0] - other[t][0]) for t in one if t in other]) for one, other in pairs]

    @property
    def closest_m(self) -> float:
        """Least distance of two centres at the same time."""
        return min(float(each.min()) for each in self._apart_m)

    @property
    def contacts(self) -> tuple[int, int]:
        """Number of contacts of two robots, and with walls."""
        ways = [np.array([place for place, _ in drive.values()]) for drive in self._at.values()]
        off_m = [np.min((w.real, w.imag, self._side_m - w.real, self._side_m - w.imag), axis=0) for w in ways]
        return _times_below(2.0 * BODY_M, self._apart_m), _times_below(BODY_M, off_m)


def _times_below(least_m: float, distances_m: Sequence[np.ndarray]) -> int:
    """Count how often distances fall below a value."""
    return sum(int(np.count_nonzero(np.diff(each < least_m, prepend=False) & (each < least_m))) for each in distances_m)
