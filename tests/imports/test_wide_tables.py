"""Tables with all sensors in a row: slow ones are held over several, and odometry may lack a yaw rate."""

import numpy as np
import pytest

from touchline.recordings.logs.foreign_sensors import sensors_of
from touchline.recordings.logs.formats import open_log
from touchline.recordings.logs.held_readings import between_changes, changes
from touchline.schemas.log_mapping import FixSource, ImuSource, LogMapping, WheelSource


def wide(path, rows):
    path.write_text("time_s,lat,lon,speed,heading_deg\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return open_log(path).read([path.stem])


def turning(n=200, hold=5):
    """50 Hz, of which fixes and speed are of 10 Hz; the compass turns clockwise through north by 0.4°/row."""
    held = [i - i % hold for i in range(n)]
    return [
        (i / 50, 48.5 + 1e-6 * k, 11.25, round(0.001 * k, 6), (350.0 + 0.4 * i) % 360.0) for i, k in enumerate(held)
    ]


MAPPING = LogMapping(
    fixes=FixSource(stream="log", taken_as="fixed"),
    imu=ImuSource(stream="log", columns={"yaw_rad": {"column": "heading_deg", "scale": -np.pi / 180}}),
    wheels=WheelSource(stream="log"),
)


def test_held_fixes_count_once_each(tmp_path):
    found = sensors_of(MAPPING, wide(tmp_path / "log.csv", turning()))
    assert found.fixes.time_s.tolist() == [i / 10 for i in range(40)]
    assert "fixes: 160 of 200 rows repeat the one before, and are left out" in found.remarks


def test_a_speed_without_a_yaw_rate_turns_as_the_compass_does(tmp_path):
    found = sensors_of(MAPPING, wide(tmp_path / "log.csv", turning()))
    speed, yaw_rate = found.travel.values.T
    assert yaw_rate == pytest.approx(-np.radians(0.4) * 50, rel=1e-6)
    assert speed[:196] == pytest.approx(0.001 * np.arange(196), abs=1e-9)  # and is interpolated where it was held
    assert "wheels: they have no yaw rate, and are taken to turn as the IMU does" in found.remarks


def test_readings_at_the_rate_of_the_rows_are_all_their_own():
    time_s = np.arange(400) / 20
    values = np.where(time_s < 15, 0.0, time_s)  # three quarters at rest
    assert changes(time_s, values[:, None]).all()
    assert between_changes(time_s, values).tolist() == values.tolist()


def test_a_held_reading_that_does_not_change_for_long_is_read_again():
    time_s = np.arange(1000) / 50
    values = np.floor(np.minimum(time_s, 10.0))  # 1 Hz, and from 10 s on at rest
    own = np.flatnonzero(changes(time_s, values[:, None]))
    assert np.diff(time_s[own]).max() <= 1.5 + 1e-9
    assert len(own) == 11 + 6


def test_a_held_reading_of_a_moving_robot_that_comes_late_is_read_once():
    time_s = np.arange(400) / 20
    values = np.floor(time_s * 10)  # 10 Hz
    late = np.isin(np.arange(400), (101, 102, 103))
    values[late] = values[100]
    own = changes(time_s, values[:, None])
    assert not own[late].any()
    assert own.sum() == 199
