"""Every sensor of the robot, read once per onboard tick."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import TICK_S, EncoderSample, ImuSample, MagSample, SensorFrame
from services.robot_sim.sensors import fast
from services.robot_sim.sensors.gnss import GnssReceiver, GnssReport
from services.robot_sim.world import body
from services.robot_sim.world import effects as e
from services.robot_sim.world.world import NO_EFFECTS

FIELD_HORIZONTAL_T = 17.2e-6
"""Horizontal component of the earth's field in northern Denmark."""
FIELD_DOWN_T = 47.6e-6
"""Downward component there: a dip of 70°."""


class Sensors:
    """The sensors and their errors.

    Args:
        vehicle: Antenna position and encoder resolution.
        scenario: Seed and noise figures; `effective()` is taken here.

    Attributes:
        gnss_reports: The fixes that arrived in the last tick as the receiver reported them.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """See the class."""
        scenario = scenario.effective()
        self._seed = scenario.seed
        self._parameters = _parameters(vehicle, scenario)
        self._state: NDArray[np.float64] = np.zeros(fast.STATE_SIZE)
        self._readings: NDArray[np.float64] = np.zeros(fast.READINGS)
        fast.switch_on(self._state, self._parameters, self._seed)
        self._gnss = GnssReceiver(vehicle, scenario)
        self.gnss_reports: tuple[GnssReport, ...] = ()
        self._battery_full_wh = vehicle.battery_wh

    def read(
        self, tick: int, world_state: NDArray[np.float64], effects: NDArray[np.float64] = NO_EFFECTS
    ) -> SensorFrame:
        """Measure the world as it is at the end of `tick`, under the `effects` of faults."""
        fast.measure(world_state, self._state, self._parameters, self._seed, tick, self._readings)
        values = self._readings.tolist()
        report = self._gnss.step(tick, world_state)
        self.gnss_reports = () if report is None else (report,)
        return SensorFrame(
            tick,
            tick / 100,
            ImuSample(*values[fast.IMU : fast.MAG]),
            MagSample(*values[fast.MAG : fast.ENCODER]),
            EncoderSample(*values[fast.ENCODER :]),
            tuple(self._gnss.sample(report) for report in self.gnss_reports),
            bumper=bool(effects[e.BUMPER]),
            battery_fraction=min(
                float(world_state[body.BATTERY_WH] / self._battery_full_wh), float(effects[e.BATTERY_MAX])
            ),
            tank_l=min(float(world_state[body.TANK_L]), float(effects[e.TANK_MAX_L])),
            operator_alive=not effects[e.OPERATOR_LOST],
        )


def _parameters(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    imu, mag = scenario.imu, scenario.magnetometer
    per_sample = 1.0 / math.sqrt(TICK_S)
    p = np.zeros(fast.PARAMETER_SIZE)
    p[fast.P_GYRO_WHITE] = imu.gyro_density_radps_rthz * per_sample
    p[fast.P_GYRO_BIAS] = imu.gyro_turn_on_bias_radps
    p[fast.P_GYRO_WALK] = imu.gyro_bias_walk_radps_rts * math.sqrt(TICK_S)
    p[fast.P_ACCEL_WHITE] = imu.accel_density_mps2_rthz * per_sample
    p[fast.P_ACCEL_BIAS] = imu.accel_turn_on_bias_mps2
    p[fast.P_ACCEL_WALK] = imu.accel_bias_walk_mps2_rts * math.sqrt(TICK_S)
    p[fast.P_FIELD_HORIZONTAL] = FIELD_HORIZONTAL_T
    p[fast.P_FIELD_DOWN] = FIELD_DOWN_T
    p[fast.P_MAG_WHITE] = mag.white_rad * FIELD_HORIZONTAL_T
    p[fast.P_MAG_HARD_IRON] = mag.bias_rad * FIELD_HORIZONTAL_T
    p[fast.P_MAG_DISTURBANCE] = mag.disturbance_rad * FIELD_HORIZONTAL_T
    p[fast.P_MAG_DECAY] = math.exp(-TICK_S / mag.disturbance_tau_s)
    if scenario.encoder.quantised:
        p[fast.P_ENCODER_TICK] = 2.0 * math.pi / vehicle.encoder_ticks_per_revolution
    return p
