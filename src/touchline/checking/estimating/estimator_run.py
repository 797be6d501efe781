"""Estimator run: the present estimator on the sensors of a session, without the executive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimator_ticks import EstimatedTicks, EstimatorTicks
from touchline.checking.recorded_session import TICK_NS, NotRebuilt, tick_of
from touchline.checking.sensor_frames import SENSED, sensor_frames
from touchline.core.geodesy import local_frame, to_local
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.frame_series import SIGMAS, FrameSeries
from touchline.onboard.estimation.report import report
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.filter_model import FIX_DOF, FilterCounters
from touchline.onboard.interface import Consistency
from touchline.recordings.channels import namespace_at, robots_among, topic_at
from touchline.recordings.former_types import presented
from touchline.recordings.message_table import MessageTable
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError, SpecError
from touchline.schemas.frames import GNSS_FRAME
from touchline.schemas.messages import GnssStatus, NavSatFix, Odometry, RobotOrder, String
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import GNSS

Floats = NDArray[np.float64]

TRACK_TICKS: Final = 10
"""Ticks between two rows of the track."""
_SLICE_TICKS = 1000

FIX_COLUMNS: Final = ("time_s", "east_m", "north_m", "innovation_east_m", "innovation_north_m", "nis_weighed", "used")
TRACK_COLUMNS: Final = ("time_s", "east_m", "north_m", "heading_rad", "position_sigma_m", "heading_sigma_rad")


@dataclass
class Jump:
    """Correction of the position to the receiver's, after fixes contradicted the estimate for good."""

    time_s: float
    moved_m: float


@dataclass
class EstimatorRun:
    """Result of an estimator run.

    Attributes:
        setup: Setup of the session.
        robot: Namespace of the robot.
        duration_s: Sim time of the session.
        receiver: (n, 6) all fixes: time, east, north [m], reported σ [m], kind as in `GnssStatus`, age of corrections.
        fixes: (n, FIX_COLUMNS) fixes that came while the estimator ran; `used` is 1 or 0.
        track: (n, TRACK_COLUMNS) estimates, every `TRACK_TICKS`.
        poses: (ticks + 1, 3) estimates of every tick; NaN where there is none.
        reference: (n, 4) time, east, north, heading of the truth or of a reference; heading may be NaN.
        of_antenna: Whether the reference is the antenna's.
        emulated: Whether the reference is an emulator's truth.
        jumps: Accepted jumps.
        starts_s: Times at which the estimator started.
        contradicted_s: Time for which fixes contradicted the estimate.
        consistency: Consistency of the estimator at the end.
        problem: Why it could not be run; empty if it was.
        remarks: Further remarks.
    """

    setup: Setup
    robot: str
    duration_s: float = 0.0
    receiver: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    fixes: Floats = field(default_factory=lambda: np.zeros((0, len(FIX_COLUMNS))))
    track: Floats = field(default_factory=lambda: np.zeros((0, len(TRACK_COLUMNS))))
    poses: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    reference: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    of_antenna: bool = False
    emulated: bool = False
    jumps: list[Jump] = field(default_factory=list)
    starts_s: list[float] = field(default_factory=list)
    contradicted_s: float = 0.0
    consistency: Consistency = field(default_factory=Consistency)
    problem: str = ""
    remarks: list[str] = field(default_factory=list)

    @property
    def nis(self) -> Floats:
        """(n,) normalised innovations squared of the fixes: χ² with 2 degrees of freedom, were their errors normal.

        The estimator's own figure is bounded (`estimation/tail.py`); this undoes it.
        """
        weighed = np.minimum(self.fixes[:, 5], FIX_DOF + 2.0 - 1e-9)
        return weighed * (FIX_DOF - 2.0) / (FIX_DOF + 2.0 - weighed)


def run_estimator(
    path: Path, robot: str | None = None, progress: Callable[[float], None] = lambda done: None
) -> EstimatorRun:
    """Run the estimator on a session.

    Args:
        path: The recording.
        robot: Namespace of the robot, if there are several.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The recording cannot be read.
        SpecError: It has no session of that robot, or an unsuitable one.
    """
    session = _Session(path, robot)
    run = EstimatorRun(session.setup, session.robot, session.last_tick / 100)
    run.receiver, run.remarks = session.receiver(), session.remarks
    run.reference, run.of_antenna, run.emulated = session.reference()
    if session.setup.vehicle.positioning != GNSS:
        raise SpecError(
            str(path),
            "",
            f"is of a robot positioned by {session.setup.vehicle.positioning}",
            "give one with a GNSS receiver",
        )
    try:
        frames = sensor_frames(session.setup, session.tables(), session.last_tick)
    except NotRebuilt as error:
        run.problem = str(error)
        return run
    _Runner(run, session, frames).go(progress)
    return run


class _Session:
    """Inputs of an estimator run from a recording."""

    def __init__(self, path: Path, robot: str | None) -> None:
        reader = RecordingReader(path)
        self.sensors: dict[str, list[Recorded]] = {}
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
                self.sensors.setdefault(topic.name, []).append(message)
                self.last_tick = max(self.last_tick, message.log_time_ns // TICK_NS)
            elif topic.name in self._references:
                self._references[topic.name].append(message)
            elif topic == topics.ORDERS:
                self._take_order(message)
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

    def _take_order(self, message: Recorded) -> None:
        try:
            order = decode(RobotOrder, message.payload)
            details = order.details()
        except PayloadError:
            self.remarks.append("an order in the recording cannot be read")
            return
        self.orders.setdefault(tick_of(order.header), []).append((order.name, details))

    def tables(self) -> dict[str, MessageTable]:
        """Messages of each sensor."""
        return {name: MessageTable.of(messages) for name, messages in self.sensors.items()}

    def receiver(self) -> Floats:
        """All fixes, as in `EstimatorRun`."""
        origin = self.setup.scenario.origin
        frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        statuses, placed = (self.sensors.get(topic.name, ()) for topic in (topics.GNSS_STATUS, topics.GNSS_FIX))
        kinds = {message.publish_time_ns: decode(GnssStatus, message.payload) for message in statuses}
        rows = []
        for message in placed:
            fix, time_ns = decode(NavSatFix, message.payload), message.publish_time_ns
            status = kinds.get(time_ns, GnssStatus())
            east, north, _ = to_local(frame, fix.latitude, fix.longitude, fix.altitude)
            sigma_m = float(fix.position_covariance[0]) ** 0.5
            rows.append((time_ns / 1e9, east, north, sigma_m, status.fix, status.correction_age_s))
        return np.array(rows, dtype=np.float64).reshape(-1, 6)

    def reference(self) -> tuple[Floats, bool, bool]:
        """Reference, of_antenna and emulated, as in `EstimatorRun`."""
        truth, foreign = self._references.values()
        rows, of_antenna = [], False
        for message in truth or foreign:
            pose = decode(Odometry, message.payload)
            of_antenna |= pose.child_frame_id == GNSS_FRAME
            place, turned = pose.pose.pose.position, pose.pose.pose.orientation
            rows.append((message.publish_time_ns / 1e9, place.x, place.y, 2.0 * float(np.arctan2(turned.z, turned.w))))
        return np.array(rows, dtype=np.float64).reshape(-1, 4), of_antenna, bool(truth)


class _Runner:
    """Estimator being run, and its log."""

    def __init__(self, run: EstimatorRun, session: _Session, frames: FrameSeries) -> None:
        self._run, self._session, self._frames = run, session, frames
        self._ticks = EstimatorTicks(run.setup, frames, _SLICE_TICKS)
        self._estimator = self._ticks.estimator
        self._fixes: list[Floats] = []
        self._track: list[Floats] = []
        self._counted: Any = FilterCounters.row(1)[0]
        """Counters after the last tick that was noted."""

    def go(self, progress: Callable[[float], None]) -> None:
        """Run all ticks; slices end where something from outside acts on the estimator."""
        run, last, orders = self._run, self._session.last_tick, self._session.orders
        run.poses = np.full((last + 1, 3), np.nan)
        stops = sorted({tick for tick in orders if 0 < tick <= last} | {last})
        for stop in stops:
            while self._ticks.done < stop:
                self._slice(min(stop - self._ticks.done, _SLICE_TICKS))
                progress(self._ticks.done / last)
            for name, details in orders.get(stop, ()):
                self._obey(stop, name, details)
        run.fixes = np.concatenate(self._fixes or [run.fixes])
        run.track = np.concatenate(self._track or [run.track])
        if self._estimator.started:
            sigmas = self._estimator.position_sigma_m, self._estimator.heading_sigma_rad
            run.consistency = report(self._estimator.counters, *sigmas)

    def _slice(self, ticks: int) -> None:
        """Run some ticks, up to the first in which the receiver may have jumped for good."""
        estimator, done = self._estimator, self._ticks.done
        started, state = estimator.started, self._ticks.state
        found = self._ticks.run(ticks)
        may_jump = self._run.setup.onboard.gnss.jump_fixes
        outlying = [] if may_jump is None else np.flatnonzero(found.counters["fixes_outlying_run"] >= may_jump).tolist()
        if outlying and outlying[0] + 1 < len(found.rows) and started:
            self._ticks.go_back(done, state)
            found = self._ticks.run(outlying[0] + 1)
        if not started and estimator.started:
            self._run.starts_s.append(self._ticks.done / 100)
        self._note(found, estimator.accept_lasting_jump() if outlying else 0.0)

    def _note(self, found: EstimatedTicks, jumped_m: float) -> None:
        """Log some ticks, at whose end the position was moved by `jumped_m`."""
        run, ticks = self._run, found.first_tick + np.arange(len(found.rows))
        rows, counters = found.rows, found.counters
        if jumped_m > 0.0:
            run.jumps.append(Jump(self._ticks.done / 100, jumped_m))
            rows[-1, :3] = self._estimator.state[:3]
            rows[-1, SIGMAS:] = self._estimator.position_sigma_m, self._estimator.heading_sigma_rad
        evaluated = counters["fixes"] + counters["fixes_rejected"]
        begun = found.started < len(rows)
        if begun:
            self._note_fixes(found, evaluated)
            run.poses[ticks[found.started :]] = rows[found.started :, :3]
            run.contradicted_s += 0.01 * int((counters["fix_doubt"][found.started :] >= CONTRADICTED).sum())
            at = np.flatnonzero((ticks % TRACK_TICKS == 0) & (np.arange(len(rows)) >= found.started))
            self._track.append(np.column_stack([ticks[at] / 100, rows[at, :3], rows[at, SIGMAS:]]))
        self._counted = counters[-1].copy()

    def _note_fixes(self, found: EstimatedTicks, evaluated: NDArray[np.int64]) -> None:
        """Log the last fix of each tick with evaluated ones."""
        counters, before = found.counters, self._counted
        at = np.flatnonzero(np.diff(evaluated, prepend=before["fixes"] + before["fixes_rejected"]) > 0)
        at = at[at >= found.started]
        rejected = np.diff(counters["fixes_rejected"], prepend=before["fixes_rejected"])[at]
        fixes = cast("NDArray[Any]", self._frames.fixes)
        fix = fixes[self._frames.arrived[found.first_tick - self._frames.first_tick + at + 1] - 1]
        innovation = counters["innovation_east_m"][at], counters["innovation_north_m"][at]
        columns = (
            fix["stamp_s"],
            fix["east_m"],
            fix["north_m"],
            *innovation,
            counters["fix_nis_last"][at],
            rejected == 0,
        )
        self._fixes.append(np.column_stack(columns).astype(np.float64))

    def _obey(self, tick: int, name: str, details: dict[str, Any]) -> None:
        """Apply an order's effect on the estimator."""
        estimator = self._estimator
        if name == "load" and details.get("taking", "carried") == "carried":
            estimator.restart()
            self._counted = FilterCounters.row(1)[0]
        elif name == "resume" and estimator.jump_m > 0.0 and (fix := estimator.last_fix) and fix.fix == FIX_FIXED:
            self._run.jumps.append(Jump(tick / 100, estimator.jump_m))
            estimator.accept_jump()
