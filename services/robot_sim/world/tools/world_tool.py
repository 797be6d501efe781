"""What the world asks of a tool, whatever its kind."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.plugins import TOOLS, part_for
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel_of_class

Floats = NDArray[np.float64]


class WorldTool(Protocol):
    """A kind of tool in the world.

    Attributes:
        kernels: A named tuple whose class has the kernel `work` (see below).
    """

    kernels: Any

    def constants(self, p: Floats, vehicle: Vehicle) -> None:
        """Fill in the tool's own among the world's parameters, which are all 0 at first."""


def world_tool(kind: str) -> WorldTool:
    """That of a kind.

    Raises:
        SpecError: It cannot be emulated.
    """
    made: WorldTool = part_for(TOOLS, kind, "world")()
    return made


@kernel_of_class
def work(  # type: ignore[empty-body]
    tool: Any, state: Floats, p: Floats, effects: Floats, valve: bool, disc: bool
) -> float:
    """Advance the tool by one physics step, in place.

    Args:
        tool: The `WorldTool.kernels`.
        state: (body.DRIVE + n,) the world's; plungers, flow and tank are the tool's to change.
        p: (body.P_DRIVE + n,) the world's parameters.
        effects: (effects.SIZE,) what faults do.
        valve: Whether the valve is commanded open.
        disc: Whether the disc is commanded down.

    Returns:
        The share of its width on which it leaves something on the ground.
    """
