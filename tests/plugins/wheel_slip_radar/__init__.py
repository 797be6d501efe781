"""A Doppler radar that looks at the ground: it measures the speed that slipping wheels do not have.

All that Touchline has to know of it is in this folder: data sheet, truth, emulation, measurement model and entry.
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from touchline.onboard.estimation.auxiliary_models import OnboardSensor, ScalarUpdate
from touchline.onboard.filter_model import SPEED, STATES, YAW_RATE
from touchline.schemas.faults import Fault
from touchline.schemas.plugins import KindParts, Plugin
from touchline.schemas.sensor_truth import SensorTruth
from touchline.schemas.vehicles import SensorSpec
from touchline.services.robot_sim.sensors.auxiliary_truth import WorldSensor


class RadarSpec(SensorSpec):
    """Data sheet of the radar."""

    kind: Literal["wheel-slip-radar"] = "wheel-slip-radar"
    name: str = "radar"
    rate_hz: Literal[10, 20, 25, 50, 100] = 20
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.03
    sigma_mps: Annotated[float, Field(gt=0, le=1)] = 0.03
    """Standard deviation of the measured speed."""


class RadarTruth(SensorTruth):
    """True errors of the radar."""

    kind: Literal["wheel-slip-radar"] = "wheel-slip-radar"
    white_mps: Annotated[float, Field(ge=0, le=1)] = 0.02
    dropout_share: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Share of the measurements without an echo."""


class RadarBlind(Fault):
    """Mud on the radar's window: no echo comes back."""

    kind: Literal["radar-blind"]


def blind(_fault, effects, _acting):
    """Whatever else is wrong."""
    effects.others["radar-blind"] = 1.0


class RadarInWorld(WorldSensor):
    """Measures the speed ahead of the ground below it: values are (speed [m/s],)."""

    def measure(self, tick, body, effects):
        if "radar-blind" in effects.others or self.draw.uniform(tick, 1) < self.truth.dropout_share:
            return None
        ahead_mps = body.speed_mps - self.spec.y_m * body.yaw_rate_radps
        return (ahead_mps + self.truth.white_mps * self.draw.normal(tick),)


class RadarOnboard(OnboardSensor):
    """z = v − y·ω at the place of the radar."""

    def updates(self, values, state):
        jacobian = np.zeros(STATES)
        jacobian[SPEED], jacobian[YAW_RATE] = 1.0, -self.spec.y_m
        return [ScalarUpdate(values[0] - jacobian @ state, jacobian, self.spec.sigma_mps**2)]


PLUGIN = Plugin(
    "Doppler radar: speed over ground", KindParts(RadarSpec, onboard=RadarOnboard, world=RadarInWorld, truth=RadarTruth)
)
FAULT = Plugin("the radar is blind", KindParts(RadarBlind, world=blind))
