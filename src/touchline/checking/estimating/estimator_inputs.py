"""Inputs of an estimator run: what a recording has of a robot's sensors."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.checking.importing.session_writer import IMPORTED, MISFITS, NO_START
from touchline.checking.recorded_session import TICK_NS, NotRebuilt, tick_of
from touchline.checking.sensor_frames import SENSED, sensor_frames
from touchline.core.geodesy import local_frame, to_local
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import FrameSeries
from touchline.onboard.interface import ANGLES, GYRO, TICKS_PER_S
from touchline.recordings.channels import namespace_at, robots_among, topic_at
from touchline.recordings.former_types import presented
from touchline.recordings.logs.misfits import does_not_fit
from touchline.recordings.logs.reversals import UNSIGNED, Span, against_the_wheels, reversals
from touchline.recordings.message_table import MessageTable
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded
from touchline.recordings.wall_times import BEGUN, noted_wall_time
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError, SpecError
from touchline.schemas.frames import GNSS_FRAME
from touchline.schemas.messages import GnssStatus, NavSatFix, Odometry, RobotOrder, String
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import GNSS, ODOMETRY
from touchline.schemas.vehicles.differential_drive import DifferentialDrive

Floats = NDArray[np.float64]


class EstimatorInputs:
    """Sensors, orders and reference of a recorded session.

    Args:
        path: The recording.
        robot: Namespace of the robot, if there are several.

    Attributes:
        setup: Setup of the session.
        robot: Namespace of the robot.
        last_tick: Last tick with a sensor's message.
        orders: Names and details of the orders that the robot was given, by tick.
        remarks: What could not be read.
        misfits: Fields of the mapping that do not fit the log, by its import.
        begun: Wall time at which the recording was begun; None if it is not noted.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no session of that robot, or of one that is positioned by a camera.
    """

    def __init__(self, path: Path, robot: str | None) -> None:
        """Read the recording."""
        reader = RecordingReader(path)
        self._sensors: dict[str, list[Recorded]] = {}
        self.orders: dict[int, list[tuple[str, dict[str, Any]]]] = {}
        self.last_tick, self.remarks = 0, list[str]()
        self._references: dict[str, list[Recorded]] = {topics.TRUTH.name: [], topics.REFERENCE.name: []}
        setups: dict[str, bytes] = {}
        for message in map(presented, reader.messages()):
            topic, namespace = topic_at(message.topic), namespace_at(message.topic)
            if topic is None or (robot is not None and namespace != robot):
                continue
            if topic == topics.SETUP:
                setups[namespace] = message.payload
            elif topic.name in SENSED:
                self._sensors.setdefault(topic.name, []).append(message)
                self.last_tick = max(self.last_tick, message.log_time_ns // TICK_NS)
            elif topic.name in self._references:
                self._references[topic.name].append(message)
            elif topic == topics.ORDERS:
                self._take_order(message)
        imported = reader.summary.metadata.get(IMPORTED, {})
        self.misfits, self._no_start = tuple(imported.get(MISFITS, "").splitlines()), imported.get(NO_START, "")
        self.begun = noted_wall_time(reader.summary.metadata, BEGUN)
        if reader.summary.problem:
            self.remarks.append(f"as far as the recording goes: {reader.summary.problem}")
        robots = robots_among(reader.summary.topics)
        if robot is not None and robot not in robots:
            raise SpecError(str(path), "--robot", f"is {robot!r}", f"choose one of {', '.join(robots) or 'none'}")
        if len(setups) > 1:
            raise SpecError(str(path), "", "is of several robots", f"name one with --robot: {', '.join(setups)}")
        if not setups:
            remedy = "give a session that was recorded from its start, or that `touchline import` made"
            raise SpecError(str(path), "", "has no robot's setup", remedy)
        ((self.robot, payload),) = setups.items()
        self.setup = parse(Setup, decode(String, payload).data, "the recording's setup", recorded=True)
        if self.setup.vehicle.positioning not in (GNSS, ODOMETRY):
            raise SpecError(
                str(path),
                "",
                f"is of a robot positioned by {self.setup.vehicle.positioning}",
                "give one with a GNSS receiver, or with odometry alone",
            )

    @cached_property
    def frames(self) -> FrameSeries:
        """Sensor frames of its computer.

        Raises:
            NotRebuilt: They cannot be made of the recording, or the estimator cannot start on them.
        """
        if self._no_start:
            raise NotRebuilt(f"the estimator cannot start on this session: {self._no_start}")
        tables = {name: MessageTable.of(messages) for name, messages in self._sensors.items()}
        return sensor_frames(self.setup, tables, self.last_tick)

    @cached_property
    def first_pose(self) -> tuple[float, float, float]:
        """First pose of the truth or reference with a heading, from which odometry alone starts; else all zeros."""
        rows, _, _ = self.reference()
        known = rows[np.isfinite(rows).all(axis=1), 1:]
        east_m, north_m, heading_rad = known[0].tolist() if len(known) else (0.0, 0.0, 0.0)
        return east_m, north_m, heading_rad

    def _take_order(self, message: Recorded) -> None:
        try:
            order = decode(RobotOrder, message.payload)
            details = order.details()
        except PayloadError:
            self.remarks.append("an order in the recording cannot be read")
            return
        self.orders.setdefault(tick_of(order.header), []).append((order.name, details))

    def receiver(self) -> Floats:
        """Return all fixes, as in `EstimatorRun`."""
        origin = self.setup.scenario.origin
        frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        statuses, placed = (self._sensors.get(topic.name, ()) for topic in (topics.GNSS_STATUS, topics.GNSS_FIX))
        kinds = {message.publish_time_ns: decode(GnssStatus, message.payload) for message in statuses}
        rows = []
        for message in placed:
            fix, time_ns = decode(NavSatFix, message.payload), message.publish_time_ns
            status = kinds.get(time_ns, GnssStatus())
            east, north, _ = to_local(frame, fix.latitude, fix.longitude, fix.altitude)
            sigma_m = float(fix.position_covariance[0]) ** 0.5
            rows.append((time_ns / 1e9, east, north, sigma_m, status.fix, status.correction_age_s))
        return np.array(rows, dtype=np.float64).reshape(-1, 6)

    @cached_property
    def reversals(self) -> tuple[Span, ...]:
        """Stretches in which two driven wheels turn against the course of the fixes.

        Raises:
            NotRebuilt: There are no sensor frames.
        """
        drive, receiver = self.setup.vehicle.drive, self.receiver()
        fixed = receiver[receiver[:, 4] == FIX_FIXED][:, :4]
        if not isinstance(drive, DifferentialDrive) or not len(fixed):
            return ()
        readings = self.frames.readings
        ticks = self.frames.first_tick + np.arange(len(readings))
        wheels_m = np.nan_to_num(readings[:, ANGLES : ANGLES + 2]) * drive.wheel_radius_m
        turn_radps = np.where(self.frames.measured[:, 0] < ticks, np.nan, readings[:, GYRO + 2])
        if not np.isfinite(turn_radps).any():
            turned = np.diff(wheels_m)[:, 0] / drive.track_width_m
            turn_radps = np.diff(turned, prepend=turned[0]) * TICKS_PER_S
        fixed = fixed[np.argsort(fixed[:, 0], kind="stable")]
        return reversals(ticks / TICKS_PER_S, wheels_m.mean(axis=1), turn_radps, fixed)

    def require_fit(self) -> None:
        """Refuse a log that its mapping does not fit, or that the estimator cannot start on, and wheels without a sign.

        Raises:
            NotRebuilt: There are no sensor frames.
            SpecError: One of that is so.
        """
        if self.misfits:
            raise SpecError(
                "the recording", "", does_not_fit(self.misfits), "mend the mapping, and import the log anew"
            )
        if self._no_start:
            problem = f"gives the estimator no start: {self._no_start}"
            raise SpecError("the recording", "", problem, "mend the mapping and import the log anew, or give another")
        if self.reversals:
            raise SpecError(
                "the recording", "", against_the_wheels(self.reversals, self.last_tick / TICKS_PER_S), UNSIGNED
            )

    def reference(self) -> tuple[Floats, bool, bool]:
        """Return reference, of_antenna and emulated, as in `EstimatorRun`."""
        truth, foreign = self._references.values()
        rows, of_antenna = [], False
        for message in truth or foreign:
            pose = decode(Odometry, message.payload)
            of_antenna |= pose.child_frame_id == GNSS_FRAME
            place, turned = pose.pose.pose.position, pose.pose.pose.orientation
            rows.append((message.publish_time_ns / 1e9, place.x, place.y, 2.0 * float(np.arctan2(turned.z, turned.w))))
        return np.array(rows, dtype=np.float64).reshape(-1, 4), of_antenna, bool(truth)
