"""Standing twin: estimates the pose of a robot that stands while sim time is held.

A real robot's computer is awake while nobody lets the robot drive. The emulated one runs no tick then, so that the
session does not depend on the duration. A twin at the same place runs its first seconds instead.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Final

from touchline.onboard.interface import TICKS_PER_S
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.sensors.gnss_truth import GnssReport
from touchline.services.robot_sim.world.world import TruePose

AWAKE_TICKS: Final = 2 * TICKS_PER_S
"""Ticks in which the twin looks for its place; without a fix it finds none."""


class StandingTwin:
    """A robot that has stood for a moment where another one stands.

    Args:
        emulator: The other robot, at rest; it is not changed.

    Attributes:
        emulator: The twin.
        gnss: Newest report of its receiver; None if it has none.
    """

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = twin = Emulator(emulator.vehicle, emulator.scenario, emulator.config)
        self.gnss: GnssReport | None = None
        twin.world.place(TruePose(*emulator.world.pose[:3]))
        twin.faults, twin.tick_count = deepcopy(emulator.faults), emulator.tick_count
        for _ in range(AWAKE_TICKS):
            twin.tick()
            self.gnss = twin.sensors.gnss_reports[-1] if twin.sensors.gnss_reports else self.gnss
            if twin.onboard.aligned:
                break
