"""The world's side of a `RollerTool`: it works on its whole width wherever it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.robot_sim.world.kernel_class import KernelClass

Floats = NDArray[np.float64]


class RollerKernels(KernelClass):
    """What physics calls."""

    @kernel
    def work(self, _state: Floats, _p: Floats, _effects: Floats, _valve: bool, _disc: bool) -> float:
        """All of it, whatever is commanded: nothing lifts the drum."""
        return 1.0


class RollerInWorld:
    """A drum on the ground."""

    kernels = RollerKernels()

    def constants(self, p: Floats, vehicle: Vehicle) -> None:
        """There are none."""
