"""Data sheets that match a scenario's sensors."""

from typing import Any

from touchline.schemas.onboard import CameraSheet, DriveSheet, GnssSheet, ImuSheet, MagnetometerSheet, OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import Spec

_SHEETS: dict[str, type[Spec]] = {
    "gnss": GnssSheet,
    "camera": CameraSheet,
    "imu": ImuSheet,
    "magnetometer": MagnetometerSheet,
    "drive": DriveSheet,
}


def data_sheets(scenario: Scenario, **others: Any) -> OnboardConfig:
    """Create the configuration whose data sheets match the scenario; `others` are its other fields.

    A receiver with bursts has the white part and the second wander that stand for the default ones.
    """
    groups = {
        name: getattr(scenario, name).model_dump(include=set(kind.model_fields)) for name, kind in _SHEETS.items()
    }
    if scenario.gnss.burst_share > 0.0:
        groups["gnss"] |= GnssSheet().model_dump(include={"white_m", "gauss_markov_2_m", "gauss_markov_2_tau_s"})
    return OnboardConfig.model_validate(groups | others)
