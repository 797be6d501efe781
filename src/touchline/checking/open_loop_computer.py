"""Open-loop replay of the onboard computer: recorded sensors in, recorded actuation applied, decisions compared.

World and sensors are as recorded whatever the computer decides, so the first difference shows which component has
changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.checking.divergence import Divergence, TopicCheck
from touchline.checking.recorded_session import RecordedSession
from touchline.onboard import Onboard
from touchline.onboard.control.follower import Asking
from touchline.onboard.interface import Command
from touchline.schemas import topics
from touchline.schemas.setup import Setup


class OpenLoopComputer(Onboard):
    """Onboard computer whose actuators follow a recording.

    Args:
        setup: The robot and its world.
        forced: (n, actuators) recorded commands of each tick; NaN where the computer itself decides.

    Attributes:
        decided: Its own decisions, by tick.
    """

    def __init__(self, setup: Setup, forced: NDArray[np.float64]) -> None:
        super().__init__(setup.vehicle, setup.onboard)
        self._forced = forced
        self.decided: dict[int, tuple[float, ...]] = {}

    def decide(self, tick: int) -> Asking[Command]:
        """Decide as `Onboard`; the next tick sees the recorded command as its last decision."""
        own = yield from super().decide(tick)
        self.decided[tick] = own.actuators
        if tick >= len(self._forced) or np.isnan(self._forced[tick]).any():
            return own
        return self._state.command.give(own._replace(actuators=tuple(self._forced[tick].tolist())))


def decisions(computer: OpenLoopComputer, session: RecordedSession, *, exact: bool) -> TopicCheck:
    """Compare the computer's decision in each tick with the recorded one.

    Args:
        computer: The computer after it has run the session.
        session: The recorded session.
        exact: Whether every bit counts, else the topic's tolerance.
    """
    found, tolerance = TopicCheck(), 0.0 if exact else topics.ACTUATOR_COMMAND.tolerance
    for tick, own in sorted(computer.decided.items()):
        then = session.commands[tick] if tick < len(session.commands) else np.full(len(own), np.nan)
        if np.isnan(then).any():
            continue
        found.pairs += 1
        off = np.abs(then - np.array(own))
        if not off.max() <= tolerance:
            k = int(off.argmax())
            found.different += 1
            if off[k] > found.largest:
                found.largest, found.largest_field = float(off[k]), f"values[{k}]"
            where = tick / 100.0, topics.ACTUATOR_COMMAND.name, f"values[{k}]"
            found.first = found.first or Divergence(*where, repr(float(then[k])), repr(own[k]))
    return found
