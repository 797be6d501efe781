"""Every sensor of the robot, read once per onboard tick."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.geodesy import local_frame
from touchline.services.onboard.interface import (
    ANGLES,
    GYRO,
    MAG,
    READINGS,
    TICK_S,
    TICKS_PER_S,
    GnssSample,
    ImuSample,
    MagSample,
    SensorFrame,
)
from touchline.services.robot_sim.sensors import fast, gnss, receiver, transport, zones
from touchline.services.robot_sim.sensors.gnss import GnssReport
from touchline.services.robot_sim.sensors.sampling import sense
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.world import NO_EFFECTS

FIELD_HORIZONTAL_T: Final = 17.2e-6
"""Horizontal component of the earth's field in northern Denmark."""
FIELD_DOWN_T: Final = 47.6e-6
"""Downward component there: a dip of 70°."""
_NO_FIX: Final[tuple[GnssSample, ...]] = ()


class Sensors:
    """The sensors and their errors.

    Args:
        vehicle: Antenna position and encoder resolution.
        scenario: Seed, noise figures and places; `effective()` is taken here.

    Attributes:
        gnss_reports: The positions that arrived in the last tick as the receiver reported them.
        arrived: (3,) whether a sample of IMU, magnetometer, encoders arrived in it.
        history: (transport.HISTORY, interface.READINGS) what was measured, by tick, whether or not it has arrived.
        arguments: What `sense` keeps or reads, in its order from `sensor` to `arrivals`.
        heard: Of that the readings, the ticks in which they were measured, and the arrivals.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        scenario = scenario.effective()
        self._seed = scenario.seed
        self._battery_wh = vehicle.body.battery_wh
        self.gnss_reports: tuple[GnssReport, ...] = ()
        self.arrived: NDArray[np.int64] = np.zeros(3, dtype=np.int64)
        self._readings: NDArray[np.float64] = np.zeros(READINGS)
        self._measured_tick: NDArray[np.int64] = np.zeros(3, dtype=np.int64)
        self._arrivals: NDArray[np.float64] = np.zeros((transport.ARRIVALS, receiver.COLUMNS))
        self.history: NDArray[np.float64] = np.zeros((transport.HISTORY, READINGS))
        self.heard = (self._readings, self._measured_tick, self._arrivals)
        sensor, p = np.zeros(fast.STATE_SIZE), _parameters(vehicle, scenario)
        fast.switch_on(sensor, p, self._seed)
        state, r = np.zeros(receiver.STATE_SIZE), gnss.parameters(vehicle, scenario)
        receiver.switch_on(state, r, self._seed)
        origin = scenario.origin
        self.arguments = (
            sensor,
            p,
            *zones.table((steel.outline, (steel.field_t, steel.reach_m, 0.0)) for steel in scenario.steel),
            self.history,
            np.full((3, transport.HISTORY), -1, dtype=np.int64),
            state,
            r,
            local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m),
            *zones.table(
                (item.outline, (gnss.FIX_NAMES[item.best_fix], item.margin_m, item.noise_factor))
                for item in scenario.sky
            ),
            np.zeros((transport.PENDING, 1 + receiver.COLUMNS)),
            np.zeros(1, dtype=np.int64),
            self._readings,
            self._measured_tick,
            self.arrived,
            self._arrivals,
        )

    def read(
        self, tick: int, world_state: NDArray[np.float64], effects: NDArray[np.float64] = NO_EFFECTS
    ) -> SensorFrame:
        """Measure the world as it is at the end of `tick`, under the `effects` of faults."""
        count = sense(world_state, effects, self._seed, tick, *self.arguments)
        return self.frame(tick, count, world_state, effects)

    def frame(
        self, tick: int, count: int, world_state: NDArray[np.float64], effects: NDArray[np.float64]
    ) -> SensorFrame:
        """What `sense` has left, `count` reports among it, as the onboard computer gets it."""
        values = self._readings.tolist()
        imu_tick, mag_tick, encoder_tick = self._measured_tick.tolist()
        fixes, self.gnss_reports = _NO_FIX, ()
        if count:
            pairs = [gnss.unpack(row) for row in self._arrivals[:count].tolist()]
            self.gnss_reports = tuple(report for report, _ in pairs)
            fixes = tuple(sample for _, sample in pairs)
        return SensorFrame(
            tick,
            tick / TICKS_PER_S,
            ImuSample(*values[GYRO:MAG]),
            MagSample(*values[MAG:ANGLES]),
            tuple(values[ANGLES:]),
            fixes,
            tick - imu_tick,
            tick - mag_tick,
            tick - encoder_tick,
            effects[e.BUMPER] > 0.0,
            float(world_state[body.BATTERY_WH]) / self._battery_wh,
            float(world_state[body.TANK_L]),
            effects[e.OPERATOR_LOST] == 0.0,
        )


def _parameters(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    imu, mag = scenario.imu, scenario.magnetometer
    per_sample = 1.0 / math.sqrt(TICK_S)
    p = np.zeros(fast.PARAMETER_SIZE)
    p[fast.P_GYRO_WHITE] = imu.gyro_density_radps_rthz * per_sample
    p[fast.P_GYRO_BIAS] = imu.gyro_turn_on_bias_radps
    p[fast.P_GYRO_WALK] = imu.gyro_bias_walk_radps_rts * math.sqrt(TICK_S)
    p[fast.P_GYRO_WARMTH] = imu.gyro_temperature_radps_per_k
    p[fast.P_ACCEL_WHITE] = imu.accel_density_mps2_rthz * per_sample
    p[fast.P_ACCEL_BIAS] = imu.accel_turn_on_bias_mps2
    p[fast.P_ACCEL_WALK] = imu.accel_bias_walk_mps2_rts * math.sqrt(TICK_S)
    p[fast.P_ACCEL_WARMTH] = imu.accel_temperature_mps2_per_k
    p[fast.P_WARMING], p[fast.P_WARMING_TAU] = imu.warming_k, imu.warming_tau_s
    p[fast.P_FIELD_HORIZONTAL] = FIELD_HORIZONTAL_T
    p[fast.P_FIELD_DOWN] = FIELD_DOWN_T
    p[fast.P_MAG_WHITE] = mag.white_rad * FIELD_HORIZONTAL_T
    p[fast.P_MAG_HARD_IRON] = mag.bias_rad * FIELD_HORIZONTAL_T
    p[fast.P_SOFT_IRON] = mag.soft_iron_relative
    p[fast.P_MAG_DISTURBANCE] = mag.disturbance_rad * FIELD_HORIZONTAL_T
    p[fast.P_MAG_DECAY] = math.exp(-TICK_S / mag.disturbance_tau_s)
    if scenario.encoder.quantised:
        for number, actuator in enumerate(vehicle.drive.actuators):
            p[fast.P_ENCODER_QUANTUM + number] = actuator.encoder_rad
    return p
