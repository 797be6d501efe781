"""State, covariance and inputs of one tick, as the updates of the filter share them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.filter_model import TickInputs

Floats = NDArray[np.float64]
Scratch = tuple[Floats, Floats, Floats]
"""Memory for the rows of a measurement (2, STATES), for P hᵀ of one of them (STATES,), and for two other
states with their covariances (2, 1 + STATES, STATES)."""


class TickEstimate(NamedTuple):
    """Entry of the filter's ring for a tick.

    Attributes:
        x: (STATES,) state.
        P: (STATES, STATES) covariance of the state.
        z: Inputs.
    """

    x: Floats
    P: Floats
    z: TickInputs
