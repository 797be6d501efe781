"""The sensors of a recording: in each tick the computer gets what it got then."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import GnssStatus, Imu, JointState, MagneticField, NavSatFix
from touchline.schemas.setup import Setup
from touchline.services.bridge.channels import topic_at
from touchline.services.bridge.recorded import Recorded
from touchline.services.core.geodesy import local_frame, to_local
from touchline.services.onboard.interface import ACTUATORS, GnssSample, ImuSample, MagSample, SensorFrame
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.runs.checking.recorded_session import TICK_NS, NotRebuilt

_SAMPLED: Final = (topics.IMU.name, topics.MAGNETIC_FIELD.name, topics.JOINT_STATES.name)
_REST: Final[dict[str, Any]] = {
    topics.IMU.name: ImuSample(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    topics.MAGNETIC_FIELD.name: MagSample(0.0, 0.0, 0.0),
    topics.JOINT_STATES.name: (0.0,) * ACTUATORS,
}


class RecordedSensors(Sensors):
    """See the module; what the computer learns of bumper, battery and tank is as in the world."""

    def __init__(self, setup: Setup, messages: Iterable[Recorded]) -> None:
        """From the messages of one robot.

        Args:
            setup: The robot and its world.
            messages: In the order in which they were recorded.

        Raises:
            NotRebuilt: What the estimator needs was not recorded.
        """
        super().__init__(setup.vehicle, setup.scenario)
        self._came: dict[int, list[tuple[str, int, Any]]] = {}
        self._latest: dict[str, tuple[int, Any]] = {name: (0, rest) for name, rest in _REST.items()}
        self._full_wh, self._fixes = setup.vehicle.body.battery_wh, dict[int, NavSatFix]()
        origin = setup.scenario.origin
        self._frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        for message in messages:
            if (topic := topic_at(message.topic)) is not None:
                self._take(topic.name, message)
        if not {name for each in self._came.values() for name, _, _ in each}.issuperset(_SAMPLED):
            raise NotRebuilt("IMU, magnetometer or wheels were not recorded, so nothing can be run on them")

    def _take(self, name: str, message: Recorded) -> None:
        sample: Any = None
        if name == topics.IMU.name:
            imu = decode(Imu, message.payload)
            rate, force = imu.angular_velocity, imu.linear_acceleration
            sample = ImuSample(rate.x, rate.y, rate.z, force.x, force.y, force.z)
        elif name == topics.MAGNETIC_FIELD.name:
            field = decode(MagneticField, message.payload).magnetic_field
            sample = MagSample(field.x, field.y, field.z)
        elif name == topics.JOINT_STATES.name:
            angles = decode(JointState, message.payload).position.tolist()
            sample = tuple(angles + [0.0] * (ACTUATORS - len(angles)))
        elif name == topics.GNSS_FIX.name:
            self._fixes[message.publish_time_ns] = decode(NavSatFix, message.payload)
        elif name == topics.GNSS_STATUS.name and (fix := self._fixes.pop(message.publish_time_ns, None)) is not None:
            sample = self._fix(fix, decode(GnssStatus, message.payload))
        elif name == topics.CAMERA_POSE.name:
            raise NotRebuilt("poses of a camera overhead are not run on yet")
        if sample is not None:
            arrived = message.log_time_ns // TICK_NS
            self._came.setdefault(arrived, []).append((name, message.publish_time_ns // TICK_NS, sample))

    def _fix(self, fix: NavSatFix, status: GnssStatus) -> GnssSample:
        east_m, north_m, _ = to_local(self._frame, fix.latitude, fix.longitude, fix.altitude)
        stamp = fix.header.stamp
        ticks, rest_ns = divmod(stamp.nanosec, TICK_NS)
        stamp_s = (100 * stamp.sec + ticks) / 100 + rest_ns / 1e9
        variance_m2 = float(fix.position_covariance[0])
        return GnssSample(stamp_s, east_m, north_m, variance_m2, status.fix, status.satellites, status.correction_age_s)

    def read(self, tick: int, state: BodyState, effects: Effects | None = None) -> SensorFrame:
        """What arrived in a tick; see `Sensors`."""
        fixes = []
        for name, measured, sample in self._came.get(tick, ()):
            if name in self._latest:
                self._latest[name] = (measured, sample)
            else:
                fixes.append(sample)
        (imu_tick, imu), (mag_tick, mag), (encoder_tick, angles) = (self._latest[name] for name in _SAMPLED)
        return SensorFrame(
            tick,
            tick / 100,
            imu,
            mag,
            angles,
            tuple(fixes),
            tick - imu_tick,
            tick - mag_tick,
            tick - encoder_tick,
            effects is not None and effects.bumper,
            state.battery_wh / self._full_wh,
            state.tank_l,
            effects is None or not effects.operator_lost,
        )
