"""Causes of pauses and stops, and the operator's reasons for them."""

from __future__ import annotations

from touchline.onboard.interface import Pause
from touchline.schemas.messages import PauseStatus

EMERGENCY_STOP = "emergency stop"
ABORTED_BY_OPERATOR = "aborted by the operator"
PAUSED_BY_OPERATOR = "paused by the operator"
BY_OPERATOR = Pause(PauseStatus.OPERATOR, "operator")
BY_LINK = Pause(PauseStatus.LINK, "link")
BY_WATCHDOG = Pause(PauseStatus.WATCHDOG, "watchdog")
BY_SHUT_DOWN = Pause(PauseStatus.SHUT_DOWN, "shut-down")
BY_EMERGENCY_STOP = Pause(PauseStatus.EMERGENCY_STOP, "emergency stop")
BY_FOLLOWER = Pause(PauseStatus.FOLLOWER, "follower")
BY_LOCALIZATION = Pause(PauseStatus.LOCALIZATION, "localization", ends_by_itself=True)
BY_PROTECTION = Pause(PauseStatus.IN_THE_WAY, "protection", ends_by_itself=True)
