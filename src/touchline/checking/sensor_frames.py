"""Sensor frames rebuilt from recorded messages, tick by tick, decoded many at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.recorded_session import TICK_NS, NotRebuilt
from touchline.core.geodesy import local_frame, to_local
from touchline.onboard.computer_state import ReceivedFix
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.interface import ANGLES, MAG, SAMPLED, TICKS_PER_S, AuxiliarySample
from touchline.recordings.message_table import MessageTable
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError
from touchline.schemas.layout import FixedLayout
from touchline.schemas.messages import LaserScan, Range, SensorSample
from touchline.schemas.messages.base import Message
from touchline.schemas.setup import Setup
from touchline.services.robot_sim import layouts
from touchline.services.robot_sim.initial_state import InitialState

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
OfTopic = Mapping[str, MessageTable]

SENSED: Final = frozenset(
    each.name
    for each in (
        topics.IMU,
        topics.MAGNETIC_FIELD,
        topics.JOINT_STATES,
        topics.GNSS_FIX,
        topics.GNSS_STATUS,
        topics.CAMERA_POSE,
        topics.SENSOR_SAMPLE,
        topics.SCAN,
        topics.RANGE,
    )
)
"""Topics from which frames are made."""
_FIRST_TICK: Final = 1


def sensor_frames(setup: Setup, came: OfTopic, last_tick: int, initial: InitialState | None = None) -> FrameSeries:
    """Return the computer's sensor frames in each tick, from the first to the last.

    Args:
        setup: The robot and its world.
        came: Messages of each topic in `SENSED`, as far as there are any.
        last_tick: Last tick of the session.
        initial: State at its beginning; None if it was just switched on.

    Raises:
        NotRebuilt: A sensor that the estimator needs was not recorded.
    """
    first_tick = _FIRST_TICK if initial is None else initial.tick + 1
    n = max(last_tick - first_tick + 1, 1)
    ticks = np.arange(first_tick, first_tick + n)
    joints = tuple(each.joint for each in setup.vehicle.drive.actuators)
    readings: Floats = np.zeros((n, ANGLES + len(joints)))
    measured: Integers = np.zeros((n, len(SAMPLED)), np.int64)
    if initial is not None:
        readings[:], measured[:] = initial.arrived
    vectors = {"angular_velocity.x": 3, "linear_acceleration.x": 3}
    angles = {"position[0]": len(joints)}
    for sensor, (topic, layout, places, column) in enumerate(
        (
            (topics.IMU, layouts.IMU, vectors, 0),
            (topics.MAGNETIC_FIELD, layouts.MAGNETIC_FIELD, {"magnetic_field.x": 3}, MAG),
            (topics.JOINT_STATES, layouts.joint_states(joints), angles, ANGLES),
        )
    ):
        messages = came.get(topic.name)
        if messages is None:
            raise NotRebuilt(f"{topic.name} was not recorded, and nothing can be run without it")
        values = np.hstack(_numbers(layout, messages, places))
        # The newest that has arrived by each tick; before the first one what had arrived before, or rest.
        newest = np.searchsorted(messages.log_time_ns // TICK_NS, ticks, side="right") - 1
        has = newest >= 0
        readings[has, column : column + values.shape[1]] = values[newest[has]]
        measured[has, sensor] = messages.publish_time_ns[newest[has]] // TICK_NS
    poses = came.get(topics.CAMERA_POSE.name)
    fixes, arrivals = _fixes(setup, came) if poses is None else _poses(poses)
    arrived = np.searchsorted(arrivals, np.append(ticks, ticks[-1] + 1), side="left")
    return FrameSeries(first_tick, readings, measured, cast("Sequence[ReceivedFix]", fixes), arrived)


def _numbers(layout: FixedLayout, messages: MessageTable, places: Mapping[str, int]) -> list[NDArray[Any]]:
    """Return numbers of messages; those with other frames or names are decoded one by one.

    Raises:
        NotRebuilt: A message cannot be decoded.
    """
    try:
        return layout.columns(messages.payloads, places)
    except PayloadError:
        pass
    try:
        whole = [decode(layout.kind, payload) for payload in messages.payloads.each()]
    except PayloadError as error:
        raise NotRebuilt(f"{messages.topic} cannot be read today: {error}") from error
    return [np.array([_at(path, count)(each) for each in whole]) for path, count in places.items()]


def _at(path: str, count: int) -> Callable[[Any], list[float]]:
    """Return a function that reads from a message the numbers that `FixedLayout` has at a place."""
    *above, last = path.partition("[")[0].split(".")

    def read(message: Any) -> list[float]:
        for name in above:
            message = getattr(message, name)
        value = getattr(message, last)
        if "[" in path:
            if len(value) < count:
                raise NotRebuilt(f"{last} of a {type(message).__name__} has {len(value)} numbers, not {count}")
            return [float(each) for each in value[:count]]
        names = list(type(message).model_fields)
        return [getattr(message, name) for name in names[names.index(last) :][:count]]

    return read


def _fixes(setup: Setup, came: OfTopic) -> tuple[NDArray[Any], Integers]:
    """Return arrived fixes (k,) and their ticks: those of their statuses, which follow them."""
    statuses, fixes = came.get(topics.GNSS_STATUS.name), came.get(topics.GNSS_FIX.name)
    if statuses is None or fixes is None:
        return np.zeros(0, ReceivedFix.dtype), np.zeros(0, np.int64)
    place_of = {time_ns: i for i, time_ns in enumerate(fixes.publish_time_ns.tolist())}
    at = np.array([place_of.get(time_ns, -1) for time_ns in statuses.publish_time_ns.tolist()])
    paired = at >= 0
    at = at[paired]
    found = np.zeros(len(at), ReceivedFix.dtype)
    where = {"header.stamp.sec": 1, "header.stamp.nanosec": 1, "latitude": 3, "position_covariance[0]": 1}
    sec, nanosec, places, variance_m2 = (column[at] for column in _numbers(layouts.GNSS_FIX, fixes, where))
    state = {"fix": 1, "satellites": 1, "correction_age_s": 1}
    fix, satellites, age_s = (column[paired] for column in _numbers(layouts.GNSS_STATUS, statuses, state))
    origin = setup.scenario.origin
    frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
    local = np.array([to_local(frame, *place) for place in places.tolist()]).reshape(-1, 3)
    found["stamp_s"] = _stamps_s(sec, nanosec)
    found["east_m"], found["north_m"] = local[:, 0], local[:, 1]
    found["variance_m2"], found["fix"] = variance_m2[:, 0], fix[:, 0]
    found["satellites"], found["correction_age_s"] = satellites[:, 0], age_s[:, 0]
    found["heading_rad"] = found["heading_variance_rad2"] = math.nan
    return found, statuses.log_time_ns[paired] // TICK_NS


def _stamps_s(sec: NDArray[Any], nanosec: NDArray[Any]) -> Floats:
    """Return (n,) times as in the robot's computer, of (n, 1) seconds and nanoseconds: whole ticks are exact."""
    ticks, rest_ns = np.divmod(nanosec.astype(np.int64), TICK_NS)
    found: Floats = ((100 * sec.astype(np.int64) + ticks) / 100 + rest_ns / 1e9)[:, 0]
    return found


def _poses(camera: MessageTable) -> tuple[NDArray[Any], Integers]:
    """Return arrived poses of a camera (k,) and their ticks; a heading's last bit is lost in its quaternion."""
    where = {
        "header.stamp.sec": 1,
        "header.stamp.nanosec": 1,
        "pose.pose.position.x": 2,
        "pose.pose.orientation.z": 2,
        "pose.covariance[0]": 1,
        "pose.covariance[35]": 1,
    }
    sec, nanosec, places, turned, variance_m2, variance_rad2 = _numbers(layouts.CAMERA_POSE, camera, where)
    found = np.zeros(len(sec), ReceivedFix.dtype)
    found["stamp_s"], found["fix"] = _stamps_s(sec, nanosec), FIX_FIXED
    found["east_m"], found["north_m"] = places[:, 0], places[:, 1]
    found["variance_m2"], found["heading_variance_rad2"] = variance_m2[:, 0], variance_rad2[:, 0]
    found["heading_rad"] = 2.0 * np.arctan2(turned[:, 0], turned[:, 1])
    return found, camera.log_time_ns // TICK_NS


def auxiliary_samples(came: OfTopic) -> dict[int, tuple[AuxiliarySample, ...]]:
    """Return measurements of auxiliary sensors by the tick in which they arrived.

    Args:
        came: Messages of each topic in `SENSED`.

    Raises:
        NotRebuilt: A message cannot be decoded.
    """
    found: dict[int, tuple[AuxiliarySample, ...]] = {}
    for topic in (topics.SENSOR_SAMPLE, topics.SCAN, topics.RANGE):
        messages = came.get(topic.name)
        if messages is None:
            continue
        for log_time_ns, payload in zip(messages.log_time_ns.tolist(), messages.payloads.each(), strict=True):
            try:
                sample = _sample(decode(topic.type, payload))
            except PayloadError as error:
                raise NotRebuilt(f"{messages.topic} cannot be read today: {error}") from error
            tick = log_time_ns // TICK_NS
            found[tick] = (*found.get(tick, ()), sample)
    return found


def _sample(message: Message) -> AuxiliarySample:
    """Return the measurement in a message."""
    if isinstance(message, LaserScan):
        lasts_s = message.time_increment * (len(message.ranges) - 1)
        last_tick = round((message.header.stamp.seconds + lasts_s) * TICKS_PER_S)
        return AuxiliarySample(message.header.frame_id, last_tick / TICKS_PER_S, tuple(message.ranges.tolist()))
    if isinstance(message, Range):
        return AuxiliarySample(message.header.frame_id, message.header.stamp.seconds, (message.range,))
    assert isinstance(message, SensorSample)
    return AuxiliarySample(message.header.frame_id, message.header.stamp.seconds, tuple(message.values.tolist()))
