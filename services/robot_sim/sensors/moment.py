"""End of a tick, at which the sensors measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects

TURN_ON_TICK: Final = -1
"""Stands for a tick in random numbers that are drawn once, when a sensor is switched on."""


class Moment(NamedTuple):
    """True state of a robot at the end of a tick, and the key of the random numbers drawn then."""

    state: Sequence[BodyState]
    """(1,) true state of the body."""
    effects: Sequence[Effects]
    """(1,) effects of faults."""
    seed: int
    """Seed of the scenario."""
    tick: int
    """Tick of the onboard computer that ends."""
