"""Tables as loggers and spreadsheets write them: times, separators, decimal commas, names and units of columns."""

import numpy as np
import pytest

from touchline.recordings.logs.foreign_sensors import sensors_of
from touchline.recordings.logs.formats import open_log
from touchline.recordings.logs.log_table import LogError
from touchline.schemas.log_mapping import FixSource, LogMapping

EPOCH_S = 1_719_828_000.0  # 2024-07-01T10:00:00Z


def read(path, text, encoding="utf-8"):
    path.write_text(text, encoding=encoding)
    content = open_log(path).read([path.stem])
    return content.tables[path.stem], content.problems


TIMES = {
    "time_s": ["0.0", "0.1", "0.2"],
    "t": ["0", "0.1", "0.2"],
    "Time [ms]": ["0", "100", "200"],
    "time_ms": ["0", "100", "200"],
    "timestamp (us)": ["0", "100000", "200000"],
    "TimeUS": ["0", "100000", "200000"],
    "timestamp_ns": ["0", "100000000", "200000000"],
    "elapsed (s)": ["0", "0.1", "0.2"],
}
EPOCHS = {
    "time": ["2024-07-01T10:00:00.0Z", "2024-07-01T10:00:00.1Z", "2024-07-01T10:00:00.2Z"],
    "Date Time": ["2024-07-01 10:00:00", "2024-07-01 10:00:00.1", "2024-07-01 10:00:00.2"],
    "datetime": ["2024-07-01T12:00:00.0+02:00", "2024-07-01T12:00:00.1+02:00", "2024-07-01T12:00:00.2+02:00"],
    "timestamp": ["1719828000000", "1719828000100", "1719828000200"],
    "Timestamp": ["1719828000000000", "1719828000100000", "1719828000200000"],
    "%time": ["1719828000000000000", "1719828000100000000", "1719828000200000000"],
    "epoch": ["1719828000.0", "1719828000.1", "1719828000.2"],
    "utc": ["2024/07/01 10:00:00", "2024/07/01 10:00:00.1", "2024/07/01 10:00:00.2 UTC"],
    "unix_time": ["01.07.2024 10:00:00", "01.07.2024 10:00:00.1", "1.7.2024 10:00:00.2"],
    "date,time": ["2024-07-01,10:00:00", "2024-07-01,10:00:00.1", "2024-07-01,10:00:00.2"],
    "GPS Week,TOW [s]": ["2321,122400.0", "2321,122400.1", "2321,122400.2"],
    "week,iTOW": ["2321,122400000", "2321,122400100", "2321,122400200"],
}


@pytest.mark.parametrize(("name", "cells"), [*TIMES.items(), *EPOCHS.items()], ids=[*TIMES, *EPOCHS])
def test_times_are_understood(tmp_path, name, cells):
    table, problems = read(tmp_path / "log.csv", f"{name},x\n" + "".join(f"{cell},1\n" for cell in cells))
    begin_s = EPOCH_S if name in EPOCHS else 0.0
    assert table.time_s == pytest.approx(begin_s + np.array([0.0, 0.1, 0.2]), abs=1e-4)
    assert problems == []


def test_times_of_the_day_go_on_behind_midnight(tmp_path):
    table, _ = read(tmp_path / "log.csv", "time,x\n23:59:59,1\n00:00:00.5,2\n00:00:01,3\n")
    assert np.diff(table.time_s) == pytest.approx([1.5, 0.5])


@pytest.mark.parametrize(
    ("head", "rows"),
    [
        ("time_s,lat,lon,alt", ["0,48.5,11.25,500", "1,48.5,11.25,500"]),
        ("time_s;Latitude;Longitude;Height", ["0;48,5;11,25;500", "0,1;48,5;11,25;500"]),
        (
            '"time_s","Latitude [deg]","Longitude [deg]","Altitude [m]"',
            ['"0","48.5","11.25","500"', "0.1,48.5,11.25,500"],
        ),
        ("time_s\tlatitude\tlng\televation (ft)", ["0\t48.5\t11.25\t1640.42", "0.1\t48.5\t11.25\t1640.42"]),
        ("time_s|LAT|LON|ALT|", ["0|48.5|11.25|500|", "0.1|48.5|11.25|500|"]),
        ("# time_s, lat, long, ele", ["# comment", "0, 48.5, 11.25, 500", "", "0.1, 48.5, 11.25, 500"]),
        ("# Logger 3000\n# of today, 1, 2, 3\ntime_s,gps_lat,gps_lon,gps_altitude", ["0,48.5,11.25,500"] * 2),
        ("time_s;lat;lon;alt", ["0;4.8500000000000e1;11,25;0.500,0"] * 1 + ["1;48.5;11,25;500"]),
        ("time_s,latitude (rad),longitude (rad),alt [cm]", ["0,0.846484687,0.196349541,50000"] * 2),
    ],
)
@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("utf-16", "\n")])
def test_places_are_found_by_usual_names_units_and_separators(tmp_path, head, rows, encoding, end):
    path = tmp_path / "log.csv"
    text = end.join([*head.split("\n"), *rows, ""])
    path.write_bytes(text.encode(encoding))
    table = open_log(path).read(["log"]).tables["log"]
    assert len(table.time_s) == 2
    assert table.columns["latitude_deg"] == pytest.approx(48.5)
    assert table.columns["longitude_deg"] == pytest.approx(11.25)
    assert table.columns["altitude_m"][-1] == pytest.approx(500.0, abs=0.01)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a,b\n1,2\n", "has no column with the time among a,b; name one of them time_s, time_ms"),
        ("time,x\n0,1\n100,1\n200,1\n", "the column 'time' steps by 100 in an unknown unit; name it time_ms"),
        ("date,x\n07/01/2024,1\n", r"the column 'date' has no time in '07/01/2024'; give ISO 8601, as in 2024-07-01"),
        (
            "time_s,lat,lon\n0,5,48,5,11,2\n1,5,48,5,11,2\n",
            r"2 of 2 lines have not the 3 columns .* give decimal points",
        ),
        ("time_s,x,x\n0,1,2\n", "has two columns of the same name"),
    ],
)
def test_what_is_not_understood_is_refused_by_column_and_name(tmp_path, text, told):
    with pytest.raises(LogError, match=told):
        read(tmp_path / "log.csv", text)


def test_degrees_that_are_counted_are_told_with_the_scale(tmp_path):
    _, problems = read(tmp_path / "log.csv", "time_s,Lat,Lon\n0,485000000,112500000\n1,485000000,112500000\n")
    assert "the column 'Lat' is no latitude_deg (4.85e+08)" in problems[0]
    assert '"latitude_deg": {"column": "Lat", "scale": 1e-7}' in problems[0]


@pytest.mark.parametrize(
    ("head", "rows", "time_s"),
    [
        ("date,time,millis", ["260314,123825300,1000", "260314,123825300,1020", "260314,123825400,1040"], 1.0),
        (
            "time,UNIX_TIMESTAMP(ts)",
            ["0000-00-00 00:00:00,1719828000", "0000-00-00,1719828000.02", ",1719828000.04"],
            EPOCH_S,
        ),
    ],
)
def test_another_column_gives_the_time_where_the_first_cannot_be_read(tmp_path, head, rows, time_s):
    table, problems = read(tmp_path / "log.csv", "\n".join([head, *rows, ""]))
    assert table.time_s == pytest.approx(time_s + np.array([0.0, 0.02, 0.04]), abs=1e-5)
    assert "; the time is that of '" in problems[0]


@pytest.mark.parametrize(
    ("head", "latitude", "rate"),
    [
        ("%time,field.latitude,field.longitude,field.angular_velocity.z", "field.latitude", "field.angular_velocity.z"),
        ("Time,latitude,longitude,angular_velocity.z", "latitude", "angular_velocity.z"),
    ],
)
def test_columns_of_messages_that_were_written_as_tables_are_known(tmp_path, head, latitude, rate):
    table, _ = read(tmp_path / "log.csv", f"{head}\n0.0,48.5,11.25,0.1\n0.1,48.5,11.25,0.2\n")
    assert table.columns["latitude_deg"].tolist() == table.columns[latitude].tolist() == [48.5, 48.5]
    assert table.columns["longitude_deg"].tolist() == [11.25, 11.25]
    assert table.columns["gyro_z_radps"].tolist() == table.columns[rate].tolist()


KINDS = {
    "fix_quality": (["RTK Fixed", "RTK Float", "DGPS", "Invalid", ""], [3.0, 2.0, 1.0, 0.0, None]),
    "Quality": (["4", "5", "2", "0", "1"], [3.0, 2.0, 1.0, 0.0, 1.0]),
    "fix_type": (["6", "5", "4", "1", "3"], [3.0, 2.0, 1.0, 0.0, 1.0]),
    "carrier": (["fixed", "float", "none", "NARROW_INT", "3D"], [3.0, 2.0, 0.0, 3.0, 1.0]),
}


@pytest.mark.parametrize("name", KINDS)
def test_kinds_of_fixes_are_known_by_words_and_by_numbers_with_one_meaning(tmp_path, name):
    cells, kinds = KINDS[name]
    rows = "".join(f"{i},{cell}\n" for i, cell in enumerate(cells))
    table, _ = read(tmp_path / "log.csv", f"time_s,{name}\n{rows}")
    found = [None if np.isnan(kind) else kind for kind in table.columns["fix_kind"]]
    assert found == kinds
    assert np.array_equal(table.columns[name], table.columns["fix_kind"], equal_nan=True)


def test_a_column_of_threes_is_no_rtk_fix_unless_the_mapping_says_so(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,lat,lon,fix\n" + "".join(f"{i},48.5,{11.25 + 1e-6 * i},3\n" for i in range(3)))
    content = open_log(path).read(["log"])
    unnamed = sensors_of(LogMapping(fixes=FixSource(stream="log")), content)
    named = sensors_of(LogMapping(fixes=FixSource(stream="log", columns={"fix": "fix"})), content)
    assert unnamed.fixes.fix.tolist() == [1, 1, 1]
    assert any("their kind is not in the log" in remark for remark in unnamed.remarks)
    assert named.fixes.fix.tolist() == [3, 3, 3]
