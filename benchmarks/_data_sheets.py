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
    """Create the configuration of a robot that is as its files say, without doubt; `others` are its other fields.

    A receiver with bursts has the white part and the second wander that stand for the default ones.
    """
    groups = {
        name: getattr(scenario, name).model_dump(include=set(kind.model_fields)) for name, kind in _SHEETS.items()
    }
    groups["gnss"] |= {"antenna_sigma_m": 0.0, "stamp_offset_sigma_s": 0.0}
    groups["drive"] |= {"crab_rad": 0.0, "side_slip_m_rtm": 0.001}
    groups["imu"] |= {"gyro_scale_sigma": 0.0}
    if scenario.gnss.burst_share > 0.0:
        groups["gnss"] |= GnssSheet().model_dump(include={"white_m", "gauss_markov_2_m", "gauss_markov_2_tau_s"})
    return OnboardConfig.model_validate(groups | others)
