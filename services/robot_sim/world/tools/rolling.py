"""World side of a `RollerTool`: it works on its whole width while it rolls, in either direction."""

from __future__ import annotations

from typing import Final

from touchline.core.jit import kernel
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.kernel_class import KernelClass

STANDS_MPS: Final = 1e-3
"""Speed below which the roller counts as standing; only its sway remains."""


class RollerKernels(KernelClass):
    """Kernels that physics calls."""

    @kernel
    def work(self, state: BodyState, _effects: Effects, _valve: bool, _disc: bool) -> float:
        """See `world_tool.work`: all of its width, whatever is commanded, because nothing lifts the drum.

        At standstill it works on no new ground.
        """
        return 1.0 if abs(state.speed_mps) >= STANDS_MPS else 0.0


class RollerInWorld:
    """A drum on the ground."""

    figures = RollerKernels()

    def __init__(self, _vehicle: Vehicle) -> None:
        """Ignore the vehicle: all are alike."""
