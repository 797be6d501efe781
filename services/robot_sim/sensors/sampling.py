"""All sensing of a tick in one kernel: measure, and carry the messages to the computer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.onboard.interface import SAMPLED
from touchline.schemas.plugins import SENSORS
from touchline.schemas.sensor_names import CAMERA, GNSS
from touchline.services.robot_sim.sensors import (
    camera_truth,
    encoder_truth,
    gnss_truth,
    imu_truth,
    magnetometer_truth,
)
from touchline.services.robot_sim.sensors.camera_truth import CameraState
from touchline.services.robot_sim.sensors.camera_views import CameraViews
from touchline.services.robot_sim.sensors.encoder_truth import EncoderState
from touchline.services.robot_sim.sensors.gnss_truth import GnssState
from touchline.services.robot_sim.sensors.imu_truth import ImuState
from touchline.services.robot_sim.sensors.magnetometer_truth import MagnetometerState
from touchline.services.robot_sim.sensors.moment import Moment
from touchline.services.robot_sim.sensors.transport import HISTORY, Transport, carry, collect, send
from touchline.services.robot_sim.sensors.zones import Zones

_GNSS: Final = SENSORS.number(GNSS)
_CAMERA: Final = SENSORS.number(CAMERA)
_SENSORS: Final = len(SAMPLED)


class Sensing(NamedTuple):
    """State of a robot's sensors, and the places that disturb them; records are (1,) arrays."""

    gnss: Sequence[GnssState]
    imu: Sequence[ImuState]
    magnetometer: Sequence[MagnetometerState]
    encoders: Sequence[EncoderState]
    camera: Sequence[CameraState]
    transport: Sequence[Transport]
    steel: Zones
    """Places of kind `SteelPlace`."""
    sky: Zones
    """Places of kind `SkyPlace`."""
    multipath: Zones
    """Places of kind `MultipathPlace`."""
    views: CameraViews


@kernel
def sense(moment: Moment, sensing: Sensing) -> int:
    """Measure at the end of a tick, and receive the messages that arrive in it.

    Args:
        moment: End of the tick.
        sensing: Sensors of the robot, updated.

    Returns:
        Number of position reports that arrived.
    """
    tick, transport, gnss, camera = moment.tick, sensing.transport, sensing.gnss, sensing.camera
    history = transport[0].history
    readings = history[tick % HISTORY]
    copy(history[(tick - 1) % HISTORY], readings)
    imu_truth.measure(moment, sensing.imu, readings)
    magnetometer_truth.measure(moment, sensing.magnetometer, sensing.steel, readings)
    encoder_truth.measure(moment, sensing.encoders, readings)
    for sensor in range(_SENSORS):
        carry(moment, sensor, transport)
    if gnss_truth.due(tick, gnss):
        gnss_truth.measure(moment, gnss, sensing.sky, sensing.multipath)
        send(moment, _GNSS, gnss[0].report, gnss_truth.arrival_tick(moment, gnss), transport)
    if camera_truth.due(tick, camera) and camera_truth.measure(moment, camera, sensing.views):
        send(moment, _CAMERA, camera[0].report, camera_truth.arrival_tick(moment, camera), transport)
    count: int = collect(transport, tick)
    return count


@kernel
def stand_by(moment: Moment, last_tick: int, sensing: Sensing) -> None:
    """Run the sensors over ticks in which the robot stands and nothing reads them.

    Args:
        moment: End of the first tick.
        last_tick: Last tick.
        sensing: Sensors of the robot, updated.
    """
    for tick in range(moment.tick, last_tick + 1):
        sense(Moment(moment.state, moment.effects, moment.seed, tick), sensing)
