"""Mappings that do not fit their log: the log's own sensors tell the field, and nothing of one that fits."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from touchline.checking.calibrating.drive_calibration import calibrate
from touchline.checking.estimating.estimate_figures import verdict
from touchline.checking.estimating.estimator_run import run_estimator
from touchline.checking.importing.import_logs import import_logs, load_mapping
from touchline.checking.reality.log_fit import fit_log
from touchline.recordings.logs.foreign_sensors import sensors_of
from touchline.recordings.logs.formats import read_logs
from touchline.recordings.logs.log_table import LogContent, LogError, LogTable
from touchline.recordings.logs.misfits import misfits
from touchline.recordings.logs.tick_sensors import tick_sensors
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import SpecError
from touchline.schemas.log_mapping import LogMapping

LOGS = Path(__file__).parents[1] / "logs"
EXAMPLES = LOGS.parents[1] / "examples" / "imports"
DEGREES = 180.0 / math.pi
VEHICLE = load_vehicle("turf-tank-two")
ORIGIN_DEG = (48.0, 11.0)
M_PER_DEG = (111_200.0, 74_500.0)


def drive():
    """Tables of 160 s: straights, bends to both sides, stops; IMU and wheels at 50 Hz, fixes at 5 Hz, a reference."""
    time_s = np.arange(0.0, 160.0, 0.02)
    rng = np.random.default_rng(1)
    speed = np.convolve(np.where(time_s % 40.0 > 4.0, 1.0, 0.0), np.full(50, 0.02), "same")
    turn = np.convolve(
        np.select([time_s % 16.0 > 13.0, time_s % 16.0 > 9.0], [-0.45, 0.6], 0.0), np.full(25, 0.04), "same"
    )
    turn *= speed
    heading = 2.0 + 0.02 * np.cumsum(turn)
    east, north = (0.02 * np.cumsum(speed * part(heading)) for part in (np.cos, np.sin))
    track_m, radius_m = VEHICLE.drive.track_width_m, VEHICLE.drive.wheel_radius_m
    columns = {
        "speed_mps": speed * (1.0 + rng.normal(0.0, 0.02, len(time_s))),
        "yaw_rate_radps": turn * 1.03 + rng.normal(0.0, 0.01, len(time_s)),
        "left": np.cumsum(speed - 0.5 * track_m * turn) * 0.02 / radius_m,
        "right": np.cumsum(speed + 0.5 * track_m * turn) * 0.02 / radius_m,
        "gyro_x_radps": rng.normal(0.0, 0.02, len(time_s)),
        "gyro_y_radps": rng.normal(0.0, 0.02, len(time_s)),
        "gyro_z_radps": turn + rng.normal(0.002, 0.005, len(time_s)),
        "accel_x_mps2": np.gradient(speed, 0.02) + rng.normal(0.1, 0.2, len(time_s)),
        "accel_y_mps2": speed * turn + rng.normal(-0.1, 0.2, len(time_s)),
        "accel_z_mps2": 9.81 + rng.normal(0.0, 0.2, len(time_s)),
        "heading_rad": np.angle(np.exp(1j * heading)),
        "heading_deg": np.degrees(heading) % 360.0,
        "still_rad": np.zeros(len(time_s)),
        "linear_z": rng.normal(0.0, 0.2, len(time_s)),
        "east_m": east,
        "north_m": north,
    }
    fixes = {
        "east_m": east[::10] + rng.normal(0.0, 0.005, len(time_s[::10])),
        "north_m": north[::10] + rng.normal(0.0, 0.005, len(time_s[::10])),
        "sigma_m": np.full(len(time_s[::10]), 0.01),
        "variance_m2": np.full(len(time_s[::10]), 1e-4),
        "sigma_mm": np.full(len(time_s[::10]), 10.0),
    }
    east_m, north_m = fixes["east_m"], fixes["north_m"]
    places = {
        "latitude_deg": ORIGIN_DEG[0] + north_m / M_PER_DEG[0],
        "longitude_deg": ORIGIN_DEG[1] + east_m / M_PER_DEG[1],
        "sigma_m": fixes["sigma_m"],
    }
    times = {"log": time_s, "fixes": time_s[::10], "places": time_s[::10]}
    of_stream = {"log": columns, "fixes": fixes, "places": places}
    return {name: LogTable(name, "csv", times[name], of_stream[name]) for name in times}


TABLES = drive()
PLACES = ("latitude_deg", "longitude_deg")


def scaled(column, scale, offset=0.0):
    return {"column": column, "scale": scale, "offset": offset}


def all_scaled(names, scale):
    return {name: scaled(name, scale) for name in names}


def mapping(*, fixes=None, imu=None, wheels=None, reference=None, **other):
    on_earth = fixes is not None and "latitude_deg" in fixes
    parts = {
        "fixes": {"stream": "places" if on_earth else "fixes", "taken_as": "fixed", "columns": fixes or {}},
        "imu": {"stream": "log"} | (imu or {}),
        "wheels": {"stream": "log", "columns": wheels or {}},
        "reference": {"stream": "log", "columns": reference or {}},
    }
    return LogMapping.model_validate(parts | other)


def told(given, tables=None):
    sensors = sensors_of(given, LogContent(dict(tables or TABLES)))
    return misfits(given, sensors, tick_sensors(sensors, given, VEHICLE), VEHICLE)


JOINTS = {"left_rad": "left", "right_rad": "right"}
RATES = ("gyro_x_radps", "gyro_y_radps", "gyro_z_radps")
FORCES = ("accel_x_mps2", "accel_y_mps2", "accel_z_mps2")
FITTING = {
    "speed": mapping(),
    "wheels": mapping(wheels=JOINTS),
    "degrees": mapping(fixes={name: name for name in PLACES}),
    "wheels 5 % off": mapping(wheels=all_scaled(("speed_mps", "yaw_rate_radps"), 1.05)),
    "gyro 5 % off": mapping(imu={"columns": all_scaled(RATES, 0.95)}),
    "accelerometer 5 % off": mapping(imu={"columns": all_scaled(FORCES, 1.05)}),
    "compass": mapping(imu={"columns": {"yaw_rad": "heading_rad"}}),
    "heading at the start": mapping(heading={"start_rad": 2.1}),
}
MISFITTING = {
    "gyro in degrees": (mapping(imu={"columns": all_scaled(RATES, DEGREES)}), "imu.columns.gyro_x_radps", "degrees"),
    "gyro clockwise": (mapping(imu={"columns": all_scaled(RATES, -1.0)}), "imu.columns.gyro_x_radps", "opposite sign"),
    "compass clockwise": (
        mapping(imu={"columns": {"yaw_rad": scaled("heading_deg", -math.pi / 180.0)}}),
        "imu.columns.yaw_rad",
        "opposite sign",
    ),
    "compass in degrees": (mapping(imu={"columns": {"yaw_rad": "heading_deg"}}), "imu.columns.yaw_rad", "degrees"),
    "km/h": (mapping(wheels={"speed_mps": scaled("speed_mps", 3.6)}), "wheels.columns.speed_mps", "scale 0.2778"),
    "mm/s": (mapping(wheels={"speed_mps": scaled("speed_mps", 1000.0)}), "wheels.columns.speed_mps", "scale 0.001"),
    "m/s for mm/s": (
        mapping(wheels={"speed_mps": scaled("speed_mps", 0.001)}),
        "wheels.columns.speed_mps",
        "scale 1000",
    ),
    "no speed": (mapping(wheels={"speed_mps": scaled("speed_mps", 0.0)}), "wheels.columns.speed_mps", "stand"),
    "wheels' turn in degrees": (
        mapping(wheels={"yaw_rate_radps": scaled("yaw_rate_radps", DEGREES)}),
        "wheels.columns.yaw_rate_radps",
        "degrees",
    ),
    "wheels' turn clockwise": (
        mapping(wheels={"yaw_rate_radps": scaled("yaw_rate_radps", -1.0)}),
        "wheels.columns.yaw_rate_radps",
        "opposite sign",
    ),
    "wheels exchanged": (
        mapping(wheels={"left_rad": "right", "right_rad": "left"}),
        "wheels.columns.left_rad and right_rad",
        "exchange",
    ),
    "wheels in degrees": (
        mapping(wheels={"left_rad": scaled("left", DEGREES), "right_rad": scaled("right", DEGREES)}),
        "wheels.columns.left_rad and right_rad",
        "degrees",
    ),
    "one wheel backward": (
        mapping(wheels={"left_rad": scaled("left", -1.0), "right_rad": "right"}),
        "wheels.columns.left_rad",
        "opposite sign",
    ),
    "backward": (
        mapping(wheels={"speed_mps": scaled("speed_mps", -1.0)}),
        "imu.axes",
        "if the wheels count backward",
    ),
    "fixes in cm": (
        mapping(fixes={"east_m": scaled("east_m", 100.0), "north_m": scaled("north_m", 100.0)}),
        "fixes.columns.east_m and north_m",
        "scale 0.01",
    ),
    "north, east": (
        mapping(fixes={"east_m": "north_m", "north_m": "east_m"}, wheels=JOINTS),
        "fixes.columns.east_m and north_m",
        "exchange",
    ),
    "longitude, latitude": (
        mapping(fixes={"latitude_deg": "longitude_deg", "longitude_deg": "latitude_deg"}, wheels=JOINTS),
        "fixes.columns.latitude_deg and longitude_deg",
        "exchange",
    ),
    "radians": (
        mapping(fixes=all_scaled(PLACES, math.pi / 180.0)),
        "fixes.columns.latitude_deg and longitude_deg",
        "scale of 57.2958",
    ),
    "variance": (mapping(fixes={"sigma_m": "variance_m2"}), "fixes.columns.sigma_m", '"sigma_m": 0.01'),
    "σ in mm": (mapping(fixes={"sigma_m": "sigma_mm"}), "fixes.columns.sigma_m", "scale 0.001"),
    "upside down": (mapping(imu={"axes": ("x", "-y", "-z")}), "imu.axes", 'give ["x", "y", "z"]'),
    "on its side": (mapping(imu={"axes": ("x", "z", "-y")}), "imu.axes", 'give ["x", "y", "z"]'),
    "upright": (mapping(imu={"axes": ("z", "y", "-x")}), "imu.axes", 'give ["x", "y", "z"]'),
    "turned by 90°": (mapping(imu={"axes": ("y", "-x", "z")}), "imu.axes", 'give ["x", "y", "z"]'),
    "turned by 180°": (mapping(imu={"axes": ("-x", "-y", "z")}), "imu.axes", 'give ["x", "y", "z"]'),
    "no gravity": (
        mapping(imu={"columns": {"accel_z_mps2": "linear_z"}}),
        "imu.columns.accel_x_mps2",
        '"accelerometer": false',
    ),
    "in g": (mapping(imu={"columns": all_scaled(FORCES, 1 / 9.80665)}), "imu.columns.accel_x_mps2", "9.807 times"),
    "gravity down": (mapping(imu={"columns": all_scaled(FORCES, -1.0)}), "imu.columns.accel_x_mps2", "opposite sign"),
    "start from north": (
        mapping(heading={"start_rad": 0.5 * math.pi - 2.0}),
        "heading.start_rad",
        "as if clockwise from north",
    ),
    "reference from north": (
        mapping(reference={"heading_rad": scaled("heading_rad", -1.0, 0.5 * math.pi)}),
        "reference.columns.heading_rad",
        "clockwise",
    ),
    "reference in degrees": (
        mapping(reference={"heading_rad": "heading_deg"}),
        "reference.columns.heading_rad",
        "in degrees",
    ),
    "reference's quaternion": (
        mapping(reference={"heading_rad": "still_rad"}),
        "reference.columns.heading_rad",
        "x, y, z, w",
    ),
}


@pytest.mark.parametrize("name", FITTING)
def test_nothing_is_said_of_a_mapping_that_fits(name):
    assert told(FITTING[name]) == []


@pytest.mark.parametrize("name", MISFITTING)
def test_the_field_is_told_with_its_remedy(name):
    given, field, remedy = MISFITTING[name]
    (line,) = told(given)
    assert line.startswith(field)
    assert remedy in line


@pytest.mark.parametrize(("name", "path"), [("plaza1", EXAMPLES / "plaza1.json"), ("husky", LOGS / "husky.json")])
def test_of_real_logs_nothing_is_said_but_the_sign_of_their_gyro(name, path):
    _, content = read_logs(sorted(LOGS.glob(f"{name}_*.csv")), None)
    assert told(load_mapping(path), content.tables) == []
    given = json.loads(path.read_text())
    quantity = "turn_rad" if name == "plaza1" else "yaw_rate_radps"
    given["imu"]["columns"] = {quantity: scaled(quantity, -1.0)}
    (line,) = told(LogMapping.model_validate(given), content.tables)
    assert "opposite sign" in line


def test_without_a_gyro_either_may_be_wrong():
    given = MISFITTING["wheels exchanged"][0].model_copy(update={"imu": None})
    (line,) = told(given)
    assert line.startswith("fixes.columns.east_m and north_m")
    assert "or else wheels.columns.left_rad and right_rad counts clockwise" in line
    assert told(mapping(wheels=JOINTS).model_copy(update={"imu": None})) == []
    assert told(mapping().model_copy(update={"wheels": None})) == []


@pytest.mark.parametrize(("scale", "part"), [(1000.0, "fixes.stream"), (1e-3, "fixes.stream"), (1e9, "fixes.stream")])
def test_stamps_in_another_unit_are_refused_by_the_stream(scale, part):
    tables = {name: LogTable(name, "csv", table.time_s * scale, table.columns) for name, table in TABLES.items()}
    with pytest.raises(LogError, match=f"^{part}: .* so they are not in seconds; name the column"):
        told(mapping(), tables)


def test_counted_degrees_are_told_by_what_they_read():
    given = mapping(fixes=all_scaled(PLACES, 1e7))
    with pytest.raises(LogError, match=r"fixes\.columns\.latitude_deg up to 480,.* give scales that make them degrees"):
        told(given)


def test_import_estimate_calibrate_and_fit_say_it_alike(tmp_path):
    for table in (TABLES["log"], TABLES["fixes"]):
        columns = np.column_stack([table.time_s, *table.columns.values()])
        head = ",".join(("time_s", *table.columns))
        np.savetxt(tmp_path / f"{table.stream}.csv", columns, "%.6f", ",", header=head, comments="")
    given, field, _ = MISFITTING["gyro clockwise"]
    session = tmp_path / "session.mcap"
    done = import_logs([tmp_path / "log.csv", tmp_path / "fixes.csv"], given, session)
    (said,) = [line for line in done.remarks if "does not fit" in line]
    assert field in said
    assert verdict(run_estimator(session)) == [said]
    for tried in (calibrate, fit_log):
        with pytest.raises(SpecError, match=r"the mapping does not fit the log: imu\.columns\.gyro_x_radps"):
            tried(session, None)
