"""The world's side of a `SprayerTool`.

Valve and disc are plungers that travel at constant speed: open (down) when they reach the far end, closed (up) when
they are back, so that a pulse shorter than the delay does nothing. Paint flows when the valve is open and the tank is
not empty; the disc shapes the edge but does not gate the flow.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.body import (
    DISC,
    DISC_DOWN,
    FLOW_LPS,
    P_DISC,
    P_FLOW_LPS,
    P_PAINT_KGPL,
    P_VALVE_OFF,
    P_VALVE_ON,
    STEP_S,
    TANK_L,
    VALVE,
    VALVE_OPEN,
)
from touchline.services.robot_sim.world.kernel_class import KernelClass
from touchline.services.robot_sim.world.lag import travel_per_step

Floats = NDArray[np.float64]

_ARRIVED = 1.0 - 1e-9
_HOME = 1e-9
_DRIBBLE = 0.05  # a smaller share of the flow leaves no line


@kernel
def _plunger(
    position: float, engaged: float, commanded: bool, on: float, off: float, stuck: float
) -> tuple[float, float]:
    if stuck != e.FREE:
        return stuck, stuck
    if commanded:
        position = min(position + on, 1.0)
        return position, 1.0 if position >= _ARRIVED else engaged
    position = max(position - off, 0.0)
    return position, 0.0 if position <= _HOME else engaged


class SprayerKernels(KernelClass):
    """What physics calls; all figures are in the world's arrays."""

    @kernel
    def work(self, state: Floats, p: Floats, effects: Floats, valve: bool, disc: bool) -> float:
        """Let paint flow for a step, then move the plungers.

        Args:
            state: (body.DRIVE + n,) the world's; plungers 0…1, flow [l/s] and tank [l] are updated.
            p: (body.P_DRIVE + n,) the world's parameters; of them the plungers' travel in a step and the flow.
            effects: (effects.SIZE,) what faults do: `FLOW`, and where `VALVE` and `DISC` are stuck.
            valve: Whether the valve is commanded open.
            disc: Whether the disc is commanded down.

        Returns:
            The share of the spray width painted, the root of that of the flow; 0 without paint.
        """
        flows = state[VALVE_OPEN] > 0.0 and state[TANK_L] > 0.0
        share = effects[e.FLOW] if flows else 0.0
        state[FLOW_LPS] = share * p[P_FLOW_LPS]
        state[TANK_L] = max(state[TANK_L] - state[FLOW_LPS] * STEP_S, 0.0)
        state[VALVE], state[VALVE_OPEN] = _plunger(
            state[VALVE], state[VALVE_OPEN], valve, p[P_VALVE_ON], p[P_VALVE_OFF], effects[e.VALVE]
        )
        state[DISC], state[DISC_DOWN] = _plunger(
            state[DISC], state[DISC_DOWN], disc, p[P_DISC], p[P_DISC], effects[e.DISC]
        )
        width: float = math.sqrt(share) if share >= _DRIBBLE else 0.0
        return width


class SprayerInWorld:
    """Valve, discs and flow."""

    kernels = SprayerKernels()

    def constants(self, p: Floats, vehicle: Vehicle) -> None:
        """Travel of the plungers, the pump's flow and the weight of paint."""
        tool = vehicle.tool
        p[P_VALVE_ON] = travel_per_step(tool.valve_on_delay_s)
        p[P_VALVE_OFF] = travel_per_step(tool.valve_off_delay_s)
        p[P_DISC] = travel_per_step(tool.disc_delay_s)
        p[P_FLOW_LPS] = tool.flow_lps
        p[P_PAINT_KGPL] = (tool.mass_full_kg - vehicle.body.mass_empty_kg) / tool.tank_l
