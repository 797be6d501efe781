"""Steps of the keys that move a replay, in the console and where it runs."""

import math
from collections.abc import Sequence
from typing import Final

SEEK_S: Final = 10.0
"""By an arrow, back or on."""
FAR_SEEK_S: Final = 60.0
"""By the other arrows."""
STEP_S: Final = 0.1
"""One step: robots tell their state ten times a second."""
REPLAY_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, -1.0)
"""Speed factors on offer; a negative one is as fast as it goes."""


def next_speed(offered: Sequence[float], factor: float, steps: int) -> float:
    """The next faster speed factor on offer (or slower, if `steps` is negative) than `factor`; -1 is the fastest."""
    ranked = [speed if speed > 0.0 else math.inf for speed in offered]
    now = factor if factor >= 0.0 else math.inf
    if steps > 0:
        return next((offered[i] for i, speed in enumerate(ranked) if speed > now), offered[-1])
    return next((offered[i] for i in reversed(range(len(ranked))) if ranked[i] < now), offered[0])
