"""World side of `NoTool`: nothing is left on the ground, and nothing is used up."""

from __future__ import annotations

from touchline.core.jit import kernel
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.kernel_class import KernelClass


class NoToolKernels(KernelClass):
    """Kernels that physics calls."""

    @kernel
    def work(self, _state: BodyState, _effects: Effects, _valve: bool, _disc: bool) -> float:
        """Do nothing, whatever is commanded; see `world_tool.work`.

        Args:
            _state: Not used, like all others.
            _effects: See `_state`.
            _valve: See `_state`.
            _disc: See `_state`.
        """
        return 0.0


class NoToolInWorld:
    """Tool of a vehicle that only drives."""

    figures = NoToolKernels()

    def __init__(self, _vehicle: Vehicle) -> None:
        """Ignore the vehicle: all are alike."""
