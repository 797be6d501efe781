"""Log of a whole drive: what is asked of a simulation afterwards, a row for each tick."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import interface
from touchline.onboard.interface import TICKS_PER_S, OnboardEvent
from touchline.services.robot_sim import tick_log
from touchline.services.robot_sim.sensors import position_report

# Columns, as in `tick_log`.
TICK: Final = 0
ESTIMATE: Final = 1  # east, north, heading, speed, yaw rate
VARIANCES: Final = ESTIMATE + 5  # of east, north, heading
TRUTH: Final = VARIANCES + 3  # as of the estimate
SPRAYER: Final = TRUTH + 5  # valve commanded, open
FLOW_LPS: Final = SPRAYER + 2
TANK_L: Final = FLOW_LPS + 1
BATTERY_WH: Final = TANK_L + 1
POWER_W: Final = BATTERY_WH + 1
STATION: Final = POWER_W + 1  # arc length where the robot believes to be
LATERAL: Final = STATION + 1  # of the nozzle, as believed
HEADING_ERROR: Final = LATERAL + 1
REFERENCE_SPEED: Final = HEADING_ERROR + 1
STATE: Final = REFERENCE_SPEED + 1
FIXES: Final = STATE + 1
REPORT: Final = FIXES + 1
READINGS: Final = REPORT + position_report.COLUMNS


def columns(actuators: int) -> int:
    """Return the number of columns for a drive with so many actuators."""
    return READINGS + interface.ANGLES + 2 * actuators


class LoggedEvent(NamedTuple):
    """Event of the robot's computer: time (s), code, severity (0 information, 1 warning, 2 error), text."""

    time_s: float
    code: str
    severity: int
    text: str


class DriveLog:
    """Log of a drive.

    Attributes:
        events: Events so far.
    """

    def __init__(self, actuators: int) -> None:
        """Begin an empty log of a drive with so many actuators."""
        covariance, report = tick_log.COVARIANCE, tick_log.REPORT
        picked = [tick_log.TICK, *range(tick_log.ESTIMATE, tick_log.ESTIMATE + 5)]
        picked += [covariance, covariance + 4, covariance + 8, *range(tick_log.TRUTH, tick_log.TRUTH + 5)]
        picked += [tick_log.SPRAYER, tick_log.SPRAYER + 1, tick_log.FLOW_LPS, tick_log.TANK_L, tick_log.BATTERY_WH]
        picked += [tick_log.POWER_W, *range(tick_log.PROGRESS, tick_log.PROGRESS + 5), tick_log.FIXES]
        picked += [*range(report, report + position_report.COLUMNS)]
        self._picked = [*picked, *range(tick_log.READINGS, tick_log.columns(actuators))]
        self._parts: list[NDArray[np.float64]] = []
        self.events: list[LoggedEvent] = []

    def take(self, rows: tick_log.Rows, last_report: NDArray[np.float64] | None) -> None:
        """Add ticks.

        Args:
            rows: (n, `tick_log.columns`) of the tick log.
            last_report: Position report that arrived in the last of them, if that is not in its row.
        """
        self._parts.append(rows[:, self._picked])
        if last_report is not None:
            last = self._parts[-1][-1]
            last[FIXES], last[REPORT:READINGS] = 1.0, last_report

    def take_events(self, events: Iterable[OnboardEvent], tick: int) -> None:
        """Add events of a tick."""
        self.events += [LoggedEvent(tick / TICKS_PER_S, each.code, each.severity, each.text) for each in events]

    @property
    def rows(self) -> NDArray[np.float64]:
        """All ticks: (n, `columns`)."""
        return np.concatenate(self._parts) if self._parts else np.zeros((0, len(self._picked)))
