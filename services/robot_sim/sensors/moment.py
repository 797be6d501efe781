"""The end of a tick, at which the sensors measure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Moment(NamedTuple):
    """What there is to be measured then, and what keys the randomness."""

    state: NDArray[np.float64]
    """The world's; indices in `world.body`."""
    effects: NDArray[np.float64]
    """(effects.SIZE,) what faults do."""
    seed: int
    """Of the scenario."""
    tick: int
    """Of the onboard computer, that ends."""
