"""A session made from the logs of another robot or receiver."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from touchline.checking.importing.reading_apart import read_apart
from touchline.checking.importing.session_writer import write_session
from touchline.recordings.logs.foreign_sensors import FIXED, ForeignSensors, sensors_of
from touchline.recordings.logs.tick_sensors import TickSensors, tick_sensors
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.log_mapping import LogMapping
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.spec import parse, read_text
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED

_RATES_HZ: Final = (1, 2, 5, 10, 20)


@dataclass
class ImportedLogs:
    """What came of an import.

    Attributes:
        figures: Of the session, for people and as JSON.
        told: What was left out or assumed, a line each.
        problem: Why the recording is not whole; empty if it is.
    """

    figures: dict[str, Any]
    told: list[str] = field(default_factory=list)
    problem: str = ""


def load_mapping(path: Path) -> LogMapping:
    """The mapping in a file.

    Raises:
        SpecError: It cannot be read, or is none.
    """
    return parse(LogMapping, read_text(path), path.name)


def import_logs(
    paths: Sequence[Path],
    mapping: LogMapping,
    out: Path,
    folder: Path = Path(),
    progress: Callable[[float, str], None] = lambda done, doing: None,
) -> ImportedLogs:
    """Make a session of logs that belong together.

    Args:
        paths: Of the logs.
        mapping: What of them is which sensor.
        out: MCAP file to write.
        folder: Where the vehicle's file is, if the mapping names one.
        progress: Told the fraction done and what is being done.

    Raises:
        LogError, SpecError: The logs or the mapping cannot be used.
        RecordingError: The session cannot be written.
    """
    progress(0.0, "reading")
    wanted = {part.stream for part in (mapping.fixes, mapping.imu, mapping.wheels, mapping.reference) if part}
    listed, content = read_apart(paths, wanted)
    notes = {stream.name: stream.note for stream in listed if stream.name in wanted - content.tables.keys()}
    content.problems += [f"{name}: {note}" for name, note in notes.items() if note]
    sensors = sensors_of(mapping, content)
    vehicle = _vehicle(mapping, folder)
    at_ticks = tick_sensors(sensors, mapping, vehicle)
    onboard = _with_rate(mapping.onboard, sensors)
    scenario = Scenario(name=mapping.name[:40] or "imported", origin=sensors.origin)
    setup = Setup(vehicle=vehicle, onboard=onboard, scenario=scenario)
    made_from = {
        "logs": ", ".join(path.name for path in paths),
        "sha256": ", ".join(_sha256(path) for path in paths),
        "begins_at_s": repr(at_ticks.begin_s),
        "mapping": mapping.model_dump_json(exclude_defaults=True),
    }
    latency_s = mapping.fixes.latency_s if mapping.fixes is not None else 0.0
    report = write_session(
        out, setup, sensors, at_ticks, latency_s, made_from, lambda done: progress(0.3 + 0.7 * done, "writing")
    )
    told = content.problems + sensors.told
    if at_ticks.starts:
        told.append(f"the estimator cannot start on this session: {at_ticks.starts}")
    elif not at_ticks.drives:
        told.append("the log has no odometry: the session can be looked at, but the estimator has nothing to go by")
    figures = _figures(sensors, at_ticks) | {"messages": report.messages, "bytes": report.bytes, "path": str(out)}
    return ImportedLogs(figures, told, report.problem)


def _vehicle(mapping: LogMapping, folder: Path) -> Vehicle:
    name = mapping.vehicle
    vehicle = load_vehicle(name if name in SHIPPED or Path(name).is_absolute() else folder / name)
    if mapping.antenna_m is None:
        return vehicle
    axes = ("gnss_antenna_x_m", "gnss_antenna_y_m", "gnss_antenna_z_m")
    return vehicle.changed(body=dict(zip(axes, mapping.antenna_m, strict=True)))


def _with_rate(onboard: OnboardConfig, sensors: ForeignSensors) -> OnboardConfig:
    """The configuration with the receiver's rate as the log has it, unless the mapping says it."""
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
