"""Writer of a foreign log's sensors as a session: the topics that the robot would have sent."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import numpy as np

from touchline.core.geodesy import local_frame, to_geodetic
from touchline.recordings.logs.foreign_sensors import FixSeries, ForeignSensors
from touchline.recordings.logs.tick_sensors import TICKS_PER_S, TickSensors
from touchline.recordings.recorder import Recorder, RecordingReport
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.frames import GNSS_FRAME, MAP_FRAME
from touchline.schemas.layout import FixedLayout
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.services.robot_sim import layouts
from touchline.services.robot_sim.packing import Payload, gnss, stamp, stamp_of
from touchline.services.robot_sim.sensors.gnss_truth import GnssReport

IMPORTED: Final = "touchline_imported"
"""Name of the metadata record with a session's sources."""
MISFITS: Final = "misfits"
"""Name of its value with the fields of the mapping that do not fit the log, a line each."""
NO_START: Final = "no_start"
"""Name of its value with the reason why the estimator cannot start; empty if it can."""
_FIELD_T: Final = 2e-5
_CLOCK_TICKS: Final = 10
_SLICE_TICKS: Final = 1000
_NO_ORIENTATION: Final = (0.0, 0.0, 0.0, 1.0, -1.0, *(0.0,) * 8)
_KNOWN: Final = (0.0,) * 9
_UNKNOWN: Final = (-1.0, *(0.0,) * 8)
_OF_ANTENNA: Final = FixedLayout(m.Odometry, {"header.frame_id": MAP_FRAME, "child_frame_id": GNSS_FRAME})
_TOPICS: Final = (
    topics.CLOCK,
    topics.SETUP,
    topics.GNSS_FIX,
    topics.GNSS_STATUS,
    topics.IMU,
    topics.MAGNETIC_FIELD,
    topics.JOINT_STATES,
    topics.REFERENCE,
)


def write_session(
    path: Path,
    setup: Setup,
    sensors: ForeignSensors,
    at_ticks: TickSensors,
    latency_s: float,
    made_from: dict[str, str],
    progress: Callable[[float], None] = lambda done: None,
) -> RecordingReport:
    """Write a session.

    Args:
        path: MCAP file to write.
        setup: Setup of the robot.
        sensors: Fixes and reference of the log.
        at_ticks: Its other sensors.
        latency_s: Age of a fix when it arrives.
        made_from: Files and mapping, for the metadata.
        progress: Called with the fraction done.

    Raises:
        RecordingError: The file cannot be written.
    """
    recorder = Recorder(path.absolute(), topics=_TOPICS)
    recorder.note(IMPORTED, made_from)
    counts = dict.fromkeys((topic.name for topic in _TOPICS), 0)
    for tick, payloads in _messages(setup, sensors, at_ticks, latency_s):
        for topic, payload in payloads:
            counts[topic.name] += 1
            recorder.write(topic.name, payload, counts[topic.name])
        if tick % _SLICE_TICKS == 0:
            progress(tick / at_ticks.ticks)
    return recorder.finish()


def _messages(
    setup: Setup, sensors: ForeignSensors, at_ticks: TickSensors, latency_s: float
) -> Iterator[tuple[int, list[Payload]]]:
    """Yield (tick, messages after it)."""
    yield (
        0,
        [(topics.CLOCK, layouts.CLOCK.pack(*stamp(0))), (topics.SETUP, encode(m.String(data=setup.model_dump_json())))],
    )
    joints = layouts.joint_states(tuple(actuator.joint for actuator in setup.vehicle.drive.actuators))
    placed = _Placed(setup.scenario, sensors, at_ticks, latency_s)
    rates = np.diff(at_ticks.angles_rad, axis=0, prepend=at_ticks.angles_rad[:1]) * TICKS_PER_S
    felt = np.isfinite(at_ticks.imu)
    for i in range(at_ticks.ticks):
        tick = i + 1
        time, payloads = stamp(tick), list[Payload]()
        if at_ticks.imu_there[i]:
            payloads.append((topics.IMU, _imu(time, at_ticks.imu[i].tolist(), bool(felt[i, 2]), bool(felt[i, 3]))))
        if not math.isnan(heading := float(at_ticks.heading_rad[i])):
            field = _FIELD_T * math.sin(heading), _FIELD_T * math.cos(heading), 0.0
            payloads.append((topics.MAGNETIC_FIELD, layouts.MAGNETIC_FIELD.pack(*time, *field, *_KNOWN)))
        if at_ticks.wheels_there[i]:
            payloads.append(
                (topics.JOINT_STATES, joints.pack(*time, *at_ticks.angles_rad[i].tolist(), *rates[i].tolist()))
            )
        after = placed.after(tick)
        if tick % _CLOCK_TICKS == 0 or (after and not payloads):
            payloads.append((topics.CLOCK, layouts.CLOCK.pack(*time)))
        yield tick, payloads + after


def _imu(time: tuple[int, int], values: list[float], turns: bool, pushes: bool) -> bytes:
    """Encode an IMU message; as in ROS, the first covariance of what is not measured is −1."""
    rates, force = _KNOWN if turns else _UNKNOWN, _KNOWN if pushes else _UNKNOWN
    return layouts.IMU.pack(*time, *_NO_ORIENTATION, *values[:3], *rates, *values[3:], *force)


class _Placed:
    """Fixes and the reference, in order of arrival."""

    def __init__(self, scenario: Scenario, sensors: ForeignSensors, at_ticks: TickSensors, latency_s: float) -> None:
        origin = scenario.origin
        self._frame = local_frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        self._begin_s, self._ticks = at_ticks.begin_s, at_ticks.ticks
        self._due: dict[int, list[Payload]] = {}
        if sensors.fixes is not None:
            self._take_fixes(sensors.fixes, latency_s)
        if (track := sensors.reference) is not None:
            for time_s, place, heading in zip(
                track.time_s - self._begin_s, track.place_m, track.heading_rad, strict=True
            ):
                self._put(time_s, 0.0, [_reference(time_s, place.tolist(), float(heading), track.of_antenna)])

    def after(self, tick: int) -> list[Payload]:
        """Return the payloads that arrive in a tick."""
        return self._due.get(tick, [])

    def _put(self, time_s: float, latency_s: float, payloads: list[Payload]) -> None:
        tick = math.ceil((time_s + latency_s) * TICKS_PER_S - 1e-6)
        if time_s >= 0.0 and tick <= self._ticks + 1:
            self._due.setdefault(min(tick, self._ticks), []).extend(payloads)

    def _take_fixes(self, fixes: FixSeries, latency_s: float) -> None:
        for i, time_s in enumerate((fixes.time_s - self._begin_s).tolist()):
            latitude, longitude, altitude_m = to_geodetic(self._frame, *fixes.place_m[i].tolist())
            variance = float(fixes.sigma_m[i]) ** 2
            report = GnssReport(
                stamp_s=time_s,
                latitude_deg=latitude,
                longitude_deg=longitude,
                altitude_m=altitude_m,
                variance_m2=variance,
                vertical_variance_m2=4.0 * variance,
                fix=int(fixes.fix[i]),
                satellites=int(fixes.satellites[i]),
                correction_age_s=float(fixes.age_s[i]),
            )
            self._put(time_s, latency_s, gnss(report))


def _reference(time_s: float, place: list[float], heading_rad: float, of_antenna: bool) -> Payload:
    half = 0.5 * heading_rad
    turned = (0.0, 0.0, math.sin(half), math.cos(half)) if not math.isnan(heading_rad) else (math.nan,) * 4
    layout = _OF_ANTENNA if of_antenna else layouts.ODOMETRY
    payload = layout.pack(*stamp_of(time_s), *place, *turned, *(0.0,) * 36, *(0.0,) * 6, *(0.0,) * 36)
    return topics.REFERENCE, payload
