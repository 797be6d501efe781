"""The world's side of `NoTool`: nothing is left on the ground, and nothing is used up."""

from __future__ import annotations

from touchline.core.jit import kernel
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.kernel_class import KernelClass


class NoToolKernels(KernelClass):
    """What physics calls."""

    @kernel
    def work(self, _state: BodyState, _effects: Effects, _valve: bool, _disc: bool) -> float:
        """Nothing, whatever is commanded.

        Args:
            _state: As all others, of `world_tool.work`; none counts.
            _effects: See `_state`.
            _valve: See `_state`.
            _disc: See `_state`.
        """
        return 0.0


class NoToolInWorld:
    """A vehicle that only drives."""

    figures = NoToolKernels()

    def __init__(self, _vehicle: Vehicle) -> None:
        """They are all alike."""
