"""Streams of receivers with the difficulties of real ones, and times that go by."""

from datetime import date
from functools import reduce
from operator import xor

import numpy as np
import pytest
from pyubx2 import UBXMessage

from touchline.recordings.logs import receiver_frames
from touchline.recordings.logs.formats import open_log
from touchline.recordings.logs.log_table import LogError
from touchline.recordings.logs.receiver_time import ReceiverClock
from touchline.recordings.logs.time_order import in_order


def sentence(text: str) -> bytes:
    return f"${text}*{reduce(xor, text.encode()):02X}\r\n".encode()


def gga(clock: str, quality: int = 4) -> bytes:
    return sentence(f"GNGGA,{clock},4807.20000000,N,01131.20000000,W,{quality},12,0.7,500.0,M,46.0,M,1.0,0001")


def week_pvt(second_of_week: int, day: int, hour: int, minute: int, second: int) -> bytes:
    told = {"validDate": 1, "validTime": 1, "fixType": 3, "gnssFixOk": 1, "carrSoln": 2, "lat": 48.12, "lon": 11.5}
    clock = {"year": 2024, "month": 4, "day": day, "hour": hour, "min": minute, "second": second}
    return UBXMessage("NAV", "NAV-PVT", 0, iTOW=1000 * second_of_week, hAcc=14, **clock, **told).serialize()


def pvt(second: int) -> bytes:
    return week_pvt(86_390 + second, 1, 0, 0, second)


def read(path, stream):
    content = open_log(path).read([stream])
    return content.tables[stream], content.problems


def test_a_mixed_damaged_stream_gives_what_is_whole(tmp_path):
    wrong = bytearray(pvt(2))
    wrong[20] ^= 0xFF
    # A length that claims more than follows hides nothing of what does.
    claims = b"\xb5\x62\x01\x07\xff\x7f"
    path = tmp_path / "mixed.ubx"
    path.write_bytes(b"# text\n" + pvt(0) + gga("000001.00") + bytes(wrong) + claims + pvt(3) + pvt(4)[:30])
    table, problems = read(path, "NAV-PVT")
    assert np.diff(table.time_s).tolist() == [3.0]
    assert table.columns["fix"].tolist() == [3.0, 3.0]
    assert table.columns["sigma_m"] == pytest.approx(0.014 / 2**0.5)
    assert any("1 messages have a wrong checksum" in each for each in problems)
    assert any("cut off" in each for each in problems)


def test_talkers_protocols_and_the_end_of_the_gps_week_in_one_stream(tmp_path):
    """Two constellations and both, with corrections between them; the week's seconds begin anew at a leap second."""
    rtcm = b"\xd3\x00\x02\x43\xf0"  # of type 1087
    rtcm += receiver_frames._crc24q(rtcm).to_bytes(3, "big")
    path = tmp_path / "week.ubx"
    week = 604_800
    with path.open("wb") as stream:
        for i in range(-3, 3):
            second = week + i
            day = (7, 23, 59, 60 + i - 1) if i < 1 else (8, 0, 0, i - 1)
            stream.write(week_pvt(second % week, *day) + rtcm + gga("120000.00").replace(b"GNGGA", b"GPGGA")[:-4])
            stream.write(b"\r\n" + gga(f"12000{i + 3}.00") + sentence(f"GLGSV,1,1,0{i + 3}"))
    table, problems = read(path, "NAV-PVT")
    assert np.diff(table.time_s) == pytest.approx(1.0)
    fixes, _ = read(path, "GGA")
    assert len(fixes.time_s) == 6
    assert np.diff(fixes.time_s) == pytest.approx(1.0)
    names = {stream.name: stream.messages for stream in open_log(path).streams()}
    assert (names["RTCM-1087"], names["GSV"], names["NAV-PVT"]) == (6, 6, 6)
    assert any("6 messages have a wrong checksum" in each for each in problems)


def test_sentences_pass_midnight_and_have_their_sigma(tmp_path):
    path = tmp_path / "night.nmea"
    gst = sentence("GNGST,000000.00,0.01,0.02,0.02,0.0,0.012,0.011,0.03")
    path.write_bytes(gga("235959.00", 5) + gga("000000.00") + gst + gga("000001.00", 0))
    table, _ = read(path, "GGA")
    assert np.diff(table.time_s).tolist() == [1.0, 1.0]
    assert table.columns["fix"].tolist() == [2.0, 3.0, 0.0]
    assert table.columns["sigma_north_m"][1] == 0.012
    assert np.isnan(table.columns["sigma_north_m"][0])
    assert table.columns["longitude_deg"][0] == pytest.approx(-11.52)
    assert table.columns["altitude_m"][0] == 546.0


def test_a_leap_second_and_a_first_date_disturb_no_time():
    clock = ReceiverClock()
    first_s = clock.of_week(100.0, 1_000_000.0)
    assert clock.of_week(101.0, 1_000_000.0) - first_s == 1.0  # 23:59:60 and 00:00:00 are the same stamp
    later = ReceiverClock()
    before_s = later.of_day(10.0)
    assert later.dated(date(2024, 1, 1), 11.0) - (before_s + later.shift_s) == 1.0


def test_stamps_are_put_in_order():
    kept, told = in_order(np.array([1.0, 2.0, 2.0, 1.5, np.nan, 3.0, -500.0]))
    assert kept.tolist() == [0, 3, 1, 5]
    assert len(told) == 4


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("nothing.bin", b"\0\1\2\3" * 50, "of no known format"),
        ("empty.bag", b"", "is empty"),
        ("cut.bag", b"#ROSBAG V2.0\nxx", "cannot be read as a ROS 1 bag"),
        ("pointer.bag", b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n", "is a Git LFS pointer"),
        ("names.csv", b"a,b\n1,2\n", "has no column with the time"),
        ("words.pos", b"% program\nhello\n", "has no line with time"),
    ],
)
def test_what_is_no_log_is_refused_in_a_line(tmp_path, name, content, told):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(LogError, match=told):
        open_log(path).streams()


def test_sentences_without_checksums_are_read_if_the_log_has_none(tmp_path):
    bare = b"".join(gga(f"00000{i}.00").split(b"*")[0] + b"\r\n" for i in range(5))
    path = tmp_path / "bare.nmea"
    path.write_bytes(bare + gga("000005.00"))
    table, problems = read(path, "GGA")
    assert len(table.time_s) == 1  # a log with checksums, in which the others are damaged
    path.write_bytes(bare)
    table, problems = read(path, "GGA")
    assert table.columns["latitude_deg"] == pytest.approx(np.full(5, 48.12))
    assert problems == ["bare.nmea: 5 sentences have no checksum; damage in them goes unnoticed"]
