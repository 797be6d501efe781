"""Check of a receiver or a camera against the data sheet that the robot's computer has."""

from __future__ import annotations

from touchline.onboard.executive.localization_monitor import max_fix_age_s
from touchline.schemas.errors import SpecError
from touchline.schemas.onboard import CameraSheet, GnssSheet, OnboardConfig
from touchline.schemas.scenario import CameraNoise, GnssNoise, Scenario
from touchline.schemas.vehicles import ODOMETRY, OVERHEAD_CAMERA, Vehicle


def check_receiver(vehicle: Vehicle, scenario: Scenario, config: OnboardConfig) -> None:
    """Refuse a receiver or a camera with which the robot would never paint, before anything is driven.

    Raises:
        SpecError: Its fixes are always older than its data sheet lets the robot's computer accept.
    """
    if vehicle.positioning == ODOMETRY:
        return
    seen = vehicle.positioning == OVERHEAD_CAMERA
    group = "camera" if seen else "gnss"
    receiver: GnssNoise | CameraNoise = scenario.camera if seen else scenario.gnss
    sheet: GnssSheet | CameraSheet = config.camera if seen else config.gnss
    oldest_s, allowed_s = 1.0 / receiver.rate_hz + receiver.latency_s, max_fix_age_s(sheet)
    if oldest_s > allowed_s:
        what = "poses" if seen else "fixes"
        problem = (
            f"make {what} up to {oldest_s:.2f} s old, which is more than the {allowed_s:.2f} s of the robot's computer"
        )
        raise SpecError(
            "scenario",
            f"{group}.rate_hz and {group}.latency_s",
            problem,
            f"give the {'camera' if seen else 'receiver'}'s data sheet in --onboard",
        )
