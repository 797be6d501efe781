"""The world's side of a `RollerTool`: it works on its whole width while it rolls, whichever way."""

from __future__ import annotations

from typing import Final

from touchline.core.jit import kernel
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.kernel_class import KernelClass

STANDS_MPS: Final = 1e-3
"""Slower than this it has come to rest, but for what is left of its sway."""


class RollerKernels(KernelClass):
    """What physics calls."""

    @kernel
    def work(self, state: BodyState, _effects: Effects, _valve: bool, _disc: bool) -> float:
        """See `world_tool.work`: all of its width, whatever is commanded, as nothing lifts the drum.

        Where it stands there is nothing new to note.
        """
        return 1.0 if abs(state.speed_mps) >= STANDS_MPS else 0.0


class RollerInWorld:
    """A drum on the ground."""

    figures = RollerKernels()

    def __init__(self, _vehicle: Vehicle) -> None:
        """They are all alike."""
