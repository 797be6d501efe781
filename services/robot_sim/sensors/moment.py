"""The end of a tick, at which the sensors measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.robot_sim.world.body import BodyState


class Moment(NamedTuple):
    """What there is to be measured then, and what keys the randomness."""

    state: Sequence[BodyState]
    """(1,) what is true about the body."""
    effects: NDArray[np.float64]
    """(effects.SIZE,) what faults do."""
    seed: int
    """Of the scenario."""
    tick: int
    """Of the onboard computer, that ends."""
