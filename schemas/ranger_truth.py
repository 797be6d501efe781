"""Errors of emulated ultrasonic rangers."""

from typing import Annotated, Literal

from pydantic import Field

from touchline.schemas.sensor_truth import SensorTruth


class RangerTruth(SensorTruth):
    """Errors of the rangers beyond their data sheets; no public figures were found, all are assumed."""

    kind: Literal["ranger"] = "ranger"
    dropout_share: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Share of the pings whose echo is not heard (assumed)."""
    weed_share: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of the pings that hear weeds in the wind (assumed 0; on grass that is not mown, try 0.02)."""
