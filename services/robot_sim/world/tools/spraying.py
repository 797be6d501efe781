"""World side of a `SprayerTool`.

Valve and disc are plungers that travel at constant speed: open (down) when they reach the far end, closed (up) when
they are back, so that a pulse shorter than the delay has no effect. Paint flows when the valve is open and the tank is
not empty; the disc shapes the edge but does not gate the flow.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.jit import kernel
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import STEP_S, BodyState
from touchline.services.robot_sim.world.effects import FREE, Effects
from touchline.services.robot_sim.world.lag import travel_per_step

_ARRIVED = 1.0 - 1e-9
_HOME = 1e-9
_DRIBBLE = 0.05  # a smaller share of the flow leaves no line


@kernel
def _plunger(
    position: float, engaged: bool, commanded: bool, on: float, off: float, stuck: float
) -> tuple[float, bool]:
    if stuck != FREE:
        return stuck, stuck > 0.0
    if commanded:
        position = min(position + on, 1.0)
        return position, engaged or position >= _ARRIVED
    position = max(position - off, 0.0)
    return position, engaged and position > _HOME


class SprayerFigures(NamedTuple):
    """Constants of a sprayer, with the kernel that physics calls.

    Attributes:
        valve_on: Travel of the valve's plunger in one step while it opens, a share of its stroke.
        valve_off: The same while it closes.
        disc: The same for the discs, in either direction.
        flow_lps: Flow of the pump.
    """

    valve_on: float
    valve_off: float
    disc: float
    flow_lps: float

    @kernel
    def work(self, state: BodyState, effects: Effects, valve: bool, disc: bool) -> float:
        """Let paint flow for a step, then move the plungers.

        Args:
            state: State of the body; plungers, flow and tank are updated.
            effects: Effects of faults: on the flow, and stuck valve and disc.
            valve: True if the valve is commanded open.
            disc: True if the disc is commanded down.

        Returns:
            Painted share of the spray width, the root of that of the flow; 0 without paint.
        """
        flows = state.valve_open and state.tank_l > 0.0
        share = effects.flow_share if flows else 0.0
        state.flow_lps = share * self.flow_lps
        state.tank_l = max(state.tank_l - state.flow_lps * STEP_S, 0.0)
        state.valve, state.valve_open = _plunger(
            state.valve, state.valve_open, valve, self.valve_on, self.valve_off, effects.valve
        )
        state.disc, state.disc_down = _plunger(state.disc, state.disc_down, disc, self.disc, self.disc, effects.disc)
        width: float = math.sqrt(share) if share >= _DRIBBLE else 0.0
        return width


class SprayerInWorld:
    """Valve, discs and flow."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Take the parameters of a vehicle's sprayer."""
        tool = vehicle.tool
        self.figures = SprayerFigures(
            valve_on=travel_per_step(tool.valve_on_delay_s),
            valve_off=travel_per_step(tool.valve_off_delay_s),
            disc=travel_per_step(tool.disc_delay_s),
            flow_lps=tool.flow_lps,
        )
