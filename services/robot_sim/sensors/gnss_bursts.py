"""Bursts of a receiver's errors while its antenna moves: for seconds, fixes err several times as much, and alike.

Another model of the tail that white noise with three kinds of fixes has otherwise; see `GnssNoise.bursting`.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.random import STREAM_BURST, normal, uniform
from touchline.core.records import Record
from touchline.schemas.scenario import GnssNoise
from touchline.services.robot_sim.sensors.moment import Moment

_STILL_MPS = 0.01
_SWITCHES: Final = 3  # channel of STREAM_BURST; those below are the errors by axis

Floats = NDArray[np.float64]


class BurstFigures(Record):
    """Figures of the bursts of one receiver in one scenario."""

    share: float
    """Share of the time of a moving antenna."""
    sigma_m: float
    """Error in a burst, 1 σ an axis."""
    decay: float
    """Share of that which is left after a period."""
    begins: float
    """Probability that a burst begins in a period without one."""
    ends: float
    """Probability that a burst ends in a period."""


class Bursts(Record):
    """State of the bursts."""

    on: bool
    """True in a burst."""
    error_m: Annotated[Floats, 3]
    """Present error by axis east, north, up."""


@kernel
def go_on(moment: Moment, f: BurstFigures, bursts: Bursts) -> None:
    """Advance the bursts to a fix: a two-state Markov chain with a first-order Gauss-Markov process in its bursts.

    Args:
        moment: End of the tick of validity.
        f: Figures.
        bursts: State, updated; an antenna that stands has none.
    """
    if f.share == 0.0:
        return
    seed, tick, state = moment.seed, moment.tick, moment.state[0]
    still = abs(state.speed_mps) + abs(state.yaw_rate_radps) < _STILL_MPS
    switches = uniform(seed, STREAM_BURST, tick, _SWITCHES) < (f.ends if bursts.on else f.begins)
    before = bursts.on
    bursts.on = not still and before != switches
    for axis in range(3):
        if not bursts.on:
            bursts.error_m[axis] = 0.0
            continue
        drawn = f.sigma_m * normal(seed, STREAM_BURST, tick, axis)
        if before:
            drawn = f.decay * bursts.error_m[axis] + math.sqrt(1.0 - f.decay * f.decay) * drawn
        bursts.error_m[axis] = drawn


def burst_figures(noise: GnssNoise) -> dict[str, Any]:
    """Return the values of `BurstFigures` for a receiver.

    Args:
        noise: Its errors.
    """
    ends = 1.0 - math.exp(-1.0 / (noise.rate_hz * noise.burst_s))
    return {
        "share": noise.burst_share,
        "sigma_m": noise.burst_m,
        "decay": math.exp(-1.0 / (noise.rate_hz * noise.burst_tau_s)),
        "begins": ends * noise.burst_share / (1.0 - noise.burst_share),
        "ends": ends,
    }
