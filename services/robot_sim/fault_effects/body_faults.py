"""Faults of the tool and the supplies, and faults that stop the robot."""

from __future__ import annotations

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def valve_stuck(fault: f.ValveStuck, effects: Effects, _acting: Acting) -> None:
    """Hold the valve: open is worse than closed; see `ApplyFault`."""
    effects.valve = max(effects.valve, 1.0 if fault.position == "open" else 0.0)


def disc_stuck(fault: f.DiscStuck, effects: Effects, _acting: Acting) -> None:
    """Hold the discs: down is worse than up; see `ApplyFault`."""
    effects.disc = max(effects.disc, 1.0 if fault.position == "down" else 0.0)


def nozzle_clogged(fault: f.NozzleClogged, effects: Effects, _acting: Acting) -> None:
    """Reduce the flow: the smallest share counts; see `ApplyFault`."""
    effects.flow_share = min(effects.flow_share, fault.share)


def bumper(_fault: f.Bumper, effects: Effects, _acting: Acting) -> None:
    """Press the bumper; see `ApplyFault`."""
    effects.bumper = True


def battery_low(fault: f.BatteryLow, effects: Effects, _acting: Acting) -> None:
    """Limit the charge: the smallest counts; see `ApplyFault`."""
    effects.battery_share = min(effects.battery_share, fault.fraction)


def tank_empty(fault: f.TankEmpty, effects: Effects, _acting: Acting) -> None:
    """Limit the paint: the least counts; see `ApplyFault`."""
    effects.tank_max_l = min(effects.tank_max_l, fault.litres)


def operator_lost(_fault: f.OperatorLost, effects: Effects, _acting: Acting) -> None:
    """Silence the operator; see `ApplyFault`."""
    effects.operator_lost = True
