"""Guard between a follower and the drive: only usable twists reach the wheels.

It applies to every follower, shipped, of a package, or called over the bus. A follower that raises, or gives a twist
that is not finite or actuator commands beyond the drive's limits, is not called again before a reset; the robot follows
its reference without feedback while it brakes, and the pause names the follower and its package.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.control.follower import BodyTwist, Follower, PathFollower, PathPlace, keeps_time
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.schemas.plain_text import plain
from touchline.schemas.plugins import FOLLOWERS, log_plugin_error

_LONGEST = 200
_SLACK = 1.0 + 1e-6


class GuardedFollower:
    """Follower that checks the answers of another one.

    Attributes:
        inner: The guarded follower.
    """

    def __init__(self, inner: Follower, name: str, drive: OnboardDrive) -> None:
        """Guard a follower.

        Args:
            inner: The follower.
            name: Name by which it is registered.
            drive: Onboard side of the drive, whose limits commands have to keep.
        """
        self.inner = inner
        self.name = inner.name
        self.ahead_rows, self.fine_rows = inner.ahead_rows, inner.fine_rows
        self.timed = keeps_time(inner)
        self.can_fail = inner.can_fail
        self._whose, self._limit = FOLLOWERS.described(name), drive.limit
        self._flaw = ""
        self._stood_in = 0

    @property
    def fallbacks(self) -> int:
        """Ticks of the follower's own fallback, and those in which it was not called."""
        return self.inner.fallbacks + self._stood_in

    @property
    def problem(self) -> str:
        """See `Follower.problem`."""
        return self._flaw or self.inner.problem

    def take_path(self, path: PathPlace) -> None:
        """See `PathFollower`."""
        inner = self.inner
        if isinstance(inner, PathFollower):
            self._guarded(lambda: inner.take_path(path))

    def reset(self) -> None:
        """See `Follower.reset`."""
        self._flaw = ""
        self._guarded(self.inner.reset)

    def step(self, now: NDArray[np.float64], ahead: NDArray[np.float64]) -> BodyTwist:
        """See `Follower.step`."""
        if not self._flaw:
            try:
                wanted = self.inner.step(now, ahead)
                self._flaw = self._flaw_of(wanted)
            except Exception as error:  # noqa: BLE001, whatever somebody else's code does
                self._blame(error)
            else:
                if not self._flaw:
                    return wanted
        self._stood_in += 1
        return BodyTwist(float(ahead[0, 0]), float(ahead[0, 1]))

    def _flaw_of(self, wanted: BodyTwist) -> str:
        """Return the fault of an answer, empty if it can be used."""
        speed_mps, yaw_rate_radps, actuators = wanted
        if not (math.isfinite(speed_mps) and math.isfinite(yaw_rate_radps)):
            return f"{self._whose} gave a twist that is not finite: {speed_mps} m/s, {yaw_rate_radps} rad/s"
        if actuators is None:
            return ""
        if len(actuators) != len(self._limit):
            return f"{self._whose} gave {len(actuators)} actuator commands; the drive takes {len(self._limit)}"
        for value, limit in zip(actuators, self._limit.tolist(), strict=True):
            if not abs(value) <= limit * _SLACK:  # nor is NaN
                return f"{self._whose} gave an actuator command of {value}; the drive's limit is {limit:g}"
        return ""

    def _guarded(self, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001, whatever somebody else's code does
            self._blame(error)

    def _blame(self, error: Exception) -> None:
        self._flaw = plain(f"{self._whose} fails with {type(error).__name__}: {error}", _LONGEST)
        log_plugin_error(self._flaw)
