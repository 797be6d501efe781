"""Interface of a tool in the world, whatever its kind."""

from __future__ import annotations

from typing import Any, Protocol

from touchline.core.jit import kernel_of_class
from touchline.schemas.plugins import TOOLS, part_for
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects


class WorldTool(Protocol):
    """The tool of a vehicle in its world, made of a `Vehicle`.

    Attributes:
        figures: Constants of the tool, a named tuple whose class has the kernel `work` (see below).
    """

    figures: Any


def world_tool(vehicle: Vehicle) -> WorldTool:
    """Make the tool of a vehicle, by its kind.

    Raises:
        SpecError: It cannot be emulated.
    """
    made: WorldTool = part_for(TOOLS, vehicle.tool.kind, "world")(vehicle)
    return made


@kernel_of_class
def work(  # type: ignore[empty-body]
    tool: Any, state: BodyState, effects: Effects, valve: bool, disc: bool
) -> float:
    """Advance the tool by one physics step, in place.

    Args:
        tool: The `WorldTool.figures`.
        state: State of the body; plungers, flow and tank may be changed.
        effects: Effects of faults.
        valve: True if the valve is commanded open.
        disc: True if the disc is commanded down.

    Returns:
        Share of its width on which it leaves something on the ground.
    """
