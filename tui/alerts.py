"""Alerts: conditions that need an operator, shown until they end, each with its remedy."""

from __future__ import annotations

import math
from dataclasses import dataclass

from touchline.schemas import supplies, topics
from touchline.schemas.messages.standard import DiagnosticStatus
from touchline.schemas.messages.touchline import GnssStatus, TraversalStatus
from touchline.tui import format
from touchline.tui.state import ConsoleState

EMPTY_TANK_L = supplies.LOW_TANK_L
"""Level of the tank at which the robot stops, before the nozzle sputters."""
FLAT_BATTERY = supplies.LOW_BATTERY
"""Charge of the battery at which the robot stops."""
LOW_BATTERY = 0.2
TANK_REASON, BATTERY_REASON = "the tank is", "the battery is low"
"""Beginnings of the robot's reasons for pauses that end with a refill."""
FIX_NAMES = {GnssStatus.NONE: "", GnssStatus.SINGLE: " (single)", GnssStatus.FLOAT: " (float)"}


@dataclass(frozen=True)
class Alert:
    """A condition: its text, whether it stops the robot, and the key and step that end it."""

    text: str
    stops: bool = True
    key: str = ""
    remedy: str = ""


def alerts(state: ConsoleState) -> list[Alert]:
    """List the present alerts, those that stop the robot first."""
    found = [alert for alert in (_tank(state), _battery(state), _fix(state), _recording(state)) if alert is not None]
    return sorted(found, key=lambda alert: not alert.stops)


def _tank(state: ConsoleState) -> Alert | None:
    sprayer = state.robot.sprayer
    if sprayer is None or not math.isfinite(sprayer.tank_l) or sprayer.tank_l >= EMPTY_TANK_L:
        return None
    return Alert("TANK EMPTY", key="u", remedy="refill the tank")


def _battery(state: ConsoleState) -> Alert | None:
    battery = state.robot.battery
    if battery is None or not math.isfinite(battery.percentage) or battery.percentage >= LOW_BATTERY:
        return None
    stops = battery.percentage < FLAT_BATTERY
    return Alert(f"BATTERY {format.percent(battery.percentage)}", stops, "b", "replace the battery")


def _fix(state: ConsoleState) -> Alert | None:
    gnss = state.robot.gnss
    if gnss is None or gnss.fix == GnssStatus.FIXED:
        return None
    return Alert(f"NO FIX{FIX_NAMES[gnss.fix]}", remedy="wait for the RTK fix")


def _recording(state: ConsoleState) -> Alert | None:
    bridge = state.nodes[topics.BRIDGE]
    if not bridge.alive or bridge.level < DiagnosticStatus.ERROR:
        return None
    return Alert("NOT RECORDING", stops=False)


def remedy(state: ConsoleState) -> tuple[str, str] | None:
    """Step before a waiting job can continue: (key, step), the key empty if there is nothing to press."""
    if state.traversal != TraversalStatus.PAUSED:
        return None
    due = [alert for alert in alerts(state) if alert.stops and alert.remedy]
    return (due[0].key, f"{due[0].remedy}, then resume (g)") if due else None


def is_over(state: ConsoleState, reason: str) -> bool:
    """True if the reason of a halt no longer holds, as tank or battery have been filled since."""
    sprayer, battery = state.robot.sprayer, state.robot.battery
    if reason.startswith(TANK_REASON):
        return sprayer is not None and sprayer.tank_l >= EMPTY_TANK_L
    if reason.startswith(BATTERY_REASON):
        return battery is not None and battery.percentage >= FLAT_BATTERY
    return False
