"""All emulated sensors of a robot, read once per tick of its computer."""

from __future__ import annotations

from collections.abc import Callable

from touchline.onboard.interface import (
    ANGLES,
    GYRO,
    MAG,
    TICKS_PER_S,
    CameraSample,
    ImuSample,
    MagSample,
    SensorFrame,
)
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import OVERHEAD_CAMERA, Vehicle
from touchline.services.robot_sim.sensors import camera_truth, gnss_truth
from touchline.services.robot_sim.sensors.camera_truth import make_camera
from touchline.services.robot_sim.sensors.camera_views import views_of
from touchline.services.robot_sim.sensors.encoder_truth import make_encoders
from touchline.services.robot_sim.sensors.gnss_truth import GnssReport, make_gnss, sky_of
from touchline.services.robot_sim.sensors.imu_truth import make_imu
from touchline.services.robot_sim.sensors.magnetometer_truth import make_magnetometer, steel_of
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.multipath import multipath_of
from touchline.services.robot_sim.sensors.sampling import Sensing, sense
from touchline.services.robot_sim.sensors.transport import Transport
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects


class Sensors:
    """Sensors of a robot and their errors, auxiliary ones apart.

    Args:
        vehicle: Real robot, of `true_vehicle`, with its kind of positioning, antenna and encoders.
        scenario: Scenario, with seed, noise and places; its `effective()` is used.

    Attributes:
        gnss_reports: Reports of the GNSS receiver that arrived in the last tick.
        camera_poses: Poses of the camera that arrived in the last tick.
        transport: Messages under way, and those that have arrived.
        sensing: State of all sensors, for `sense`.
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
            gnss=make_gnss(vehicle, scenario).array,
            imu=make_imu(scenario).array,
            magnetometer=make_magnetometer(scenario).array,
            encoders=make_encoders(vehicle, scenario).array,
            camera=make_camera(vehicle, scenario).array,
            transport=self.transport.array,
            steel=steel_of(scenario),
            sky=sky_of(scenario),
            multipath=multipath_of(scenario),
            views=views_of(scenario),
        )

    def read(self, tick: int, state: BodyState, effects: Effects | None = None) -> SensorFrame:
        """Measure at the end of a tick, and return the frame that the computer gets.

        Args:
            tick: Tick that ends.
            state: True state of the body.
            effects: Effects of faults; None: no faults.
        """
        effects = effects or self._no_effects
        if self._sense is None:
            self._sense = sense.for_types_of((Moment(state.array, effects.array, self._seed, tick), self.sensing))
        count = self._sense(Moment(state.array, effects.array, self._seed, tick), self.sensing)
        return self.frame(tick, count, state, effects)

    def frame(self, tick: int, count: int, state: BodyState, effects: Effects) -> SensorFrame:
        """Return the frame of a tick that `sense` has been run for.

        Args:
            tick: Tick that has ended.
            count: Number of position reports that arrived, as `sense` returned it.
            state: True state of the body.
            effects: Effects of faults.
        """
        values = self.transport.readings.tolist()
        imu_tick, mag_tick, encoder_tick = self.transport.measured_tick.tolist()
        rows = self.transport.arrivals[:count].tolist() if count else ()
        pairs = () if self._seen else tuple(map(gnss_truth.unpack, rows))
        self.gnss_reports = tuple(report for report, _ in pairs)
        self.camera_poses = tuple(map(camera_truth.unpack, rows)) if self._seen else ()
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
            effects.bumper or state.bumper,
            state.battery_wh / self._battery_wh,
            state.tank_l,
            not effects.operator_lost,
            self.camera_poses,
        )
