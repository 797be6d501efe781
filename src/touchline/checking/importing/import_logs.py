"""Session made from the logs of another robot or receiver."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from touchline.checking.importing.limited_reader import read_limited
from touchline.checking.importing.session_writer import MISFITS, NO_START, write_session
from touchline.recordings.logs.foreign_sensors import FIXED, ForeignSensors, sensors_of
from touchline.recordings.logs.misfits import does_not_fit, misfits
from touchline.recordings.logs.reversals import in_words
from touchline.recordings.logs.tick_sensors import TickSensors, tick_sensors
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import ODOMETRY, Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED

_RATES_HZ: Final = (1, 2, 5, 10, 20)
_STOOD_RAD: Final = 1e-3
_UNKNOWN_ROBOT: Final = {
    "drive": {"side_slip_m_rtm": 0.02},
    "imu": {"gyro_density_radps_rthz": 0.002},
}
"""Noise figures of a robot whose data sheets nobody has given: 2 cm over a metre sideways, and 0.9° after a minute. Our
own is ten times better at either; if this one is worse, the estimator adapts."""


@dataclass
class ImportedLogs:
    """Result of an import.

    Attributes:
        figures: Figures of the session, for people and as JSON.
        remarks: What was left out or assumed, a line each.
        problem: Why the recording is incomplete; empty if it is complete.
    """

    figures: dict[str, Any]
    remarks: list[str] = field(default_factory=list)
    problem: str = ""


def load_mapping(path: Path) -> LogMapping:
    """Load the mapping in a file.

    Raises:
        SpecError: The file cannot be read, or is no mapping.
    """
    return parse(LogMapping, read_text(path), path.name)


def import_logs(
    paths: Sequence[Path],
    mapping: LogMapping,
    out: Path,
    folder: Path = Path(),
    progress: Callable[[float, str], None] = lambda done, doing: None,
) -> ImportedLogs:
    """Make a session from logs of one drive.

    Args:
        paths: The logs.
        mapping: Streams of the sensors.
        out: MCAP file to write.
        folder: Folder of the vehicle's file, if the mapping names one.
        progress: Called with the fraction done and the present stage.

    Raises:
        LogError, SpecError: The logs or the mapping cannot be used.
        RecordingError: The session cannot be written.
    """
    progress(0.0, "reading")
    wanted = {part.stream for part in (mapping.fixes, mapping.imu, mapping.wheels, mapping.reference) if part}
    listed, content = read_limited(paths, wanted)
    notes = {stream.name: stream.note for stream in listed if stream.name in wanted - content.tables.keys()}
    content.problems += [f"{name}: {note}" for name, note in notes.items() if note]
    sensors = sensors_of(mapping, content)
    vehicle = _vehicle(mapping, folder)
    at_ticks = tick_sensors(sensors, mapping, vehicle)
    misfitting = misfits(mapping, sensors, at_ticks, vehicle)
    odometry_alone = sensors.fixes is None and at_ticks.drives
    if odometry_alone:
        vehicle = vehicle.model_copy(update={"positioning": ODOMETRY})
        at_ticks = _facing(at_ticks, sensors)
    onboard = _with_rate(_of_unknown_robot(mapping.onboard), sensors)
    scenario = Scenario(name=mapping.name[:40] or "imported", origin=sensors.origin)
    setup = Setup(vehicle=vehicle, onboard=onboard, scenario=scenario)
    made_from = {
        "logs": ", ".join(path.name for path in paths),
        "sha256": ", ".join(_sha256(path) for path in paths),
        "begins_at_s": repr(at_ticks.begin_s),
        "mapping": mapping.model_dump_json(exclude_defaults=True),
        MISFITS: "\n".join(misfitting),
        NO_START: "" if odometry_alone else at_ticks.starts,
    }
    latency_s = mapping.fixes.latency_s if mapping.fixes is not None else 0.0
    report = write_session(
        out, setup, sensors, at_ticks, latency_s, made_from, lambda done: progress(0.3 + 0.7 * done, "writing")
    )
    remarks = content.problems + sensors.remarks + [does_not_fit([each]) for each in misfitting]
    if mapping.wheels is not None and mapping.wheels.unsigned:
        remarks.append(f"wheels: {_reversing(at_ticks)}")
    if odometry_alone:
        remarks.append("the log has no fixes: the estimator runs on odometry alone")
    elif at_ticks.starts:
        remarks.append(f"the estimator cannot start on this session: {at_ticks.starts}")
    elif not at_ticks.drives:
        remarks.append("the log has no odometry: the session can be looked at, but not estimated")
    figures = _figures(sensors, at_ticks) | {"messages": report.messages, "bytes": report.bytes, "path": str(out)}
    return ImportedLogs(figures, remarks, report.problem)


def _reversing(at_ticks: TickSensors) -> str:
    """Return where wheels without a sign were taken to turn backward."""
    if not at_ticks.reverses:
        return "no stretch was found in which the course of the fixes is opposite to the heading"
    spans = [(begin_s - at_ticks.begin_s, end_s - at_ticks.begin_s) for begin_s, end_s in at_ticks.reverses]
    return f"taken to turn backward {in_words(spans, at_ticks.ticks / 100)}, by the course of the fixes"


def _vehicle(mapping: LogMapping, folder: Path) -> Vehicle:
    name = mapping.vehicle
    vehicle = load_vehicle(name if name in SHIPPED or Path(name).is_absolute() else folder / name)
    if mapping.antenna_m is None:
        return vehicle
    axes = ("gnss_antenna_x_m", "gnss_antenna_y_m", "gnss_antenna_z_m")
    return vehicle.changed(body=dict(zip(axes, mapping.antenna_m, strict=True)))


def _facing(at_ticks: TickSensors, sensors: ForeignSensors) -> TickSensors:
    """Return the sensors with a magnetometer that reads the reference's first heading until the wheels turn."""
    known = sensors.reference.heading_rad if sensors.reference is not None else np.zeros(1)
    known = known[np.isfinite(known)]
    turned = np.abs(at_ticks.angles_rad - at_ticks.angles_rad[0]).max(axis=1) >= _STOOD_RAD
    stands = np.cumsum(turned) == 0
    return replace(at_ticks, heading_rad=np.where(stands, known[0] if len(known) else 0.0, math.nan))


def _of_unknown_robot(onboard: OnboardConfig) -> OnboardConfig:
    """Return the configuration with `_UNKNOWN_ROBOT` in those fields that the mapping leaves out."""
    groups = {}
    for name, values in _UNKNOWN_ROBOT.items():
        group = getattr(onboard, name)
        left_out = {field: value for field, value in values.items() if field not in group.model_fields_set}
        groups[name] = group.model_copy(update=left_out)
    return onboard.model_copy(update=groups)


def _with_rate(onboard: OnboardConfig, sensors: ForeignSensors) -> OnboardConfig:
    """Return the configuration with the log's receiver rate, unless the mapping sets one."""
    fixes = sensors.fixes
    if fixes is None or len(fixes.time_s) < 2 or "rate_hz" in onboard.gnss.model_fields_set:
        return onboard
    found_hz = 1.0 / float(np.median(np.diff(fixes.time_s)))
    rate_hz = min(_RATES_HZ, key=lambda each: abs(math.log(each / found_hz)))
    return onboard.model_copy(update={"gnss": onboard.gnss.model_copy(update={"rate_hz": rate_hz})})


def _figures(sensors: ForeignSensors, at_ticks: TickSensors) -> dict[str, Any]:
    fixes = sensors.fixes
    return {
        "duration_s": at_ticks.ticks / 100,
        "fixes": len(fixes.time_s) if fixes is not None else 0,
        "fixed_pct": 100.0 * float((fixes.fix == FIXED).mean()) if fixes is not None else None,
        "sigma_median_m": float(np.median(fixes.sigma_m[fixes.fix > 0])) if fixes is not None else None,
        "gyro_pct": 100.0 * float((at_ticks.imu_there & np.isfinite(at_ticks.imu[:, 2])).mean()),
        "accelerometer_pct": 100.0 * float((at_ticks.imu_there & np.isfinite(at_ticks.imu[:, 3])).mean()),
        "wheels_pct": 100.0 * float(at_ticks.wheels_there.mean()),
        "reference_points": len(sensors.reference.time_s) if sensors.reference is not None else 0,
    }


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    files = sorted(each for each in path.rglob("*") if each.is_file()) if path.is_dir() else [path]
    for each in files:
        with each.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
