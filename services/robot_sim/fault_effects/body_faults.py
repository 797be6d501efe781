"""Faults of the tool, of the supplies, and of what stops the robot."""

from __future__ import annotations

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def valve_stuck(fault: f.ValveStuck, effects: Effects, _acting: Acting) -> None:
    """Open is worse than closed."""
    effects.valve = max(effects.valve, 1.0 if fault.position == "open" else 0.0)


def disc_stuck(fault: f.DiscStuck, effects: Effects, _acting: Acting) -> None:
    """Down is worse than up."""
    effects.disc = max(effects.disc, 1.0 if fault.position == "down" else 0.0)


def nozzle_clogged(fault: f.NozzleClogged, effects: Effects, _acting: Acting) -> None:
    """The smallest share counts."""
    effects.flow_share = min(effects.flow_share, fault.share)


def bumper(_fault: f.Bumper, effects: Effects, _acting: Acting) -> None:
    """Pressed."""
    effects.bumper = True


def battery_low(fault: f.BatteryLow, effects: Effects, _acting: Acting) -> None:
    """The smallest charge counts."""
    effects.battery_share = min(effects.battery_share, fault.fraction)


def tank_empty(fault: f.TankEmpty, effects: Effects, _acting: Acting) -> None:
    """The least paint counts."""
    effects.tank_max_l = min(effects.tank_max_l, fault.litres)


def operator_lost(_fault: f.OperatorLost, effects: Effects, _acting: Acting) -> None:
    """Not heard."""
    effects.operator_lost = True
