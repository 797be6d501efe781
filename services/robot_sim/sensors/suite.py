"""Every sensor of the robot, read once per onboard tick."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from touchline.onboard.interface import (
    ANGLES,
    GYRO,
    MAG,
    TICK_S,
    TICKS_PER_S,
    CameraSample,
    ImuSample,
    MagSample,
    SensorFrame,
)
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.robot_sim.sensors import camera, fast, gnss
from touchline.services.robot_sim.sensors.gnss import GnssReport
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.sampling import Sensing, sense
from touchline.services.robot_sim.sensors.transport import Transport
from touchline.services.robot_sim.sensors.zones import SkyPlace, SteelPlace, make_zones
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects

FIELD_HORIZONTAL_T: Final = 17.2e-6
"""Horizontal component of the earth's field in northern Denmark."""
FIELD_DOWN_T: Final = 47.6e-6
"""Downward component there: a dip of 70°."""


class Sensors:
    """The sensors and their errors.

    Args:
        vehicle: Antenna position and encoder resolution.
        scenario: Seed, noise figures and places; `effective()` is taken here.

    Attributes:
        gnss_reports: The positions that arrived in the last tick as the receiver reported them.
        camera_poses: Those that arrived in it of the camera.
        transport: What the 100 Hz sensors measured, and what has arrived of it.
        sensing: All their state, for `sense`.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        scenario = scenario.effective()
        self._seed = scenario.seed
        self._sense: Callable[..., int] | None = None  # `sense`, for the types of its arguments, which do not change
        self._battery_wh = vehicle.body.battery_wh
        self._seen = vehicle.positioning == OVERHEAD_CAMERA
        self.gnss_reports: tuple[GnssReport, ...] = ()
        self.camera_poses: tuple[CameraSample, ...] = ()
        count = len(vehicle.drive.actuators)
        self.transport = Transport.sized(count)(schedule=-1)
        self._no_effects = Effects.sized(count)()
        self.sensing = Sensing(
            _fast_sensors(vehicle, scenario).array,
            gnss.make_receiver(vehicle, scenario).array,
            camera.make_camera(vehicle, scenario).array,
            self.transport.array,
            make_zones(SteelPlace, ((steel.outline, (steel.field_t, steel.reach_m)) for steel in scenario.steel)),
            make_zones(
                SkyPlace,
                (
                    (item.outline, (gnss.FIX_NAMES[item.best_fix], item.margin_m, item.noise_factor))
                    for item in scenario.sky
                ),
            ),
        )

    def read(self, tick: int, state: BodyState, effects: Effects | None = None) -> SensorFrame:
        """Measure the body's `state`, which is that at the end of `tick`, under the `effects` of faults."""
        effects = effects or self._no_effects
        if self._sense is None:
            self._sense = sense.for_types_of((Moment(state.array, effects.array, self._seed, tick), self.sensing))
        count = self._sense(Moment(state.array, effects.array, self._seed, tick), self.sensing)
        return self.frame(tick, count, state, effects)

    def frame(self, tick: int, count: int, state: BodyState, effects: Effects) -> SensorFrame:
        """What `sense` has left, `count` reports among it, as the onboard computer gets it."""
        values = self.transport.readings.tolist()
        imu_tick, mag_tick, encoder_tick = self.transport.measured_tick.tolist()
        rows = self.transport.arrivals[:count].tolist() if count else ()
        pairs = () if self._seen else tuple(map(gnss.unpack, rows))
        self.gnss_reports = tuple(report for report, _ in pairs)
        self.camera_poses = tuple(map(camera.unpack, rows)) if self._seen else ()
        return SensorFrame(
            tick,
            tick / TICKS_PER_S,
            ImuSample(*values[GYRO:MAG]),
            MagSample(*values[MAG:ANGLES]),
            tuple(values[ANGLES:]),
            tuple(sample for _, sample in pairs),
            tick - imu_tick,
            tick - mag_tick,
            tick - encoder_tick,
            effects.bumper,
            state.battery_wh / self._battery_wh,
            state.tank_l,
            not effects.operator_lost,
            self.camera_poses,
        )


def _fast_sensors(vehicle: Vehicle, scenario: Scenario) -> fast.FastSensors:
    """Just switched on; `scenario` must be effective."""
    imu, mag, made = scenario.imu, scenario.magnetometer, fast.FastSensors.sized(len(vehicle.drive.actuators))()
    per_sample, per_tick = 1.0 / math.sqrt(TICK_S), math.sqrt(TICK_S)
    made.figures.reset(
        gyro_white_radps=imu.gyro_density_radps_rthz * per_sample,
        gyro_bias_radps=imu.gyro_turn_on_bias_radps,
        gyro_walk_radps=imu.gyro_bias_walk_radps_rts * per_tick,
        gyro_warmth_radps_per_k=imu.gyro_temperature_radps_per_k,
        accel_white_mps2=imu.accel_density_mps2_rthz * per_sample,
        accel_bias_mps2=imu.accel_turn_on_bias_mps2,
        accel_walk_mps2=imu.accel_bias_walk_mps2_rts * per_tick,
        accel_warmth_mps2_per_k=imu.accel_temperature_mps2_per_k,
        warming_k=imu.warming_k,
        warming_tau_s=imu.warming_tau_s,
        field_horizontal_t=FIELD_HORIZONTAL_T,
        field_down_t=FIELD_DOWN_T,
        mag_white_t=mag.white_rad * FIELD_HORIZONTAL_T,
        hard_iron_t=mag.bias_rad * FIELD_HORIZONTAL_T,
        soft_iron=mag.soft_iron_relative,
        disturbance_t=mag.disturbance_rad * FIELD_HORIZONTAL_T,
        disturbance_decay=math.exp(-TICK_S / mag.disturbance_tau_s),
    )
    if scenario.encoder.quantised:
        for number, actuator in enumerate(vehicle.drive.actuators):
            made.figures.encoder_rad[number] = actuator.encoder_rad
    fast.switch_on(made.array, scenario.seed)
    return made
