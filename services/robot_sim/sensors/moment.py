"""The end of a tick, at which the sensors measure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects


class Moment(NamedTuple):
    """What there is to be measured then, and what keys the randomness."""

    state: Sequence[BodyState]
    """(1,) what is true about the body."""
    effects: Sequence[Effects]
    """(1,) what faults do."""
    seed: int
    """Of the scenario."""
    tick: int
    """Of the onboard computer, that ends."""
