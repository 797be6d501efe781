"""GPX tracks as fixes, with what is wrong in them told."""

import math

import pytest

from touchline.checking.importing.import_logs import import_logs
from touchline.checking.importing.mapping_proposal import proposal
from touchline.recordings.logs.formats import open_log
from touchline.recordings.logs.log_table import LogError

HEAD = '<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/1" version="1.1"><trk><trkseg>'
END = "</trkseg></trk></gpx>"


def point(second: float, extra: str = "") -> str:
    clock = f"<time>2024-07-01T10:00:{second:06.3f}Z</time>"
    return f'<trkpt lat="48.5" lon="{11.25 + 1e-6 * second}"><ele>500</ele>{clock}{extra}</trkpt>'


def test_a_track_is_a_log_of_fixes(tmp_path):
    path = tmp_path / "track.gpx"
    path.write_text(HEAD + "".join(point(i, "<fix>rtk</fix><sat>12</sat>" * (i > 1)) for i in range(20)) + END)
    table = open_log(path).read(["track"]).tables["track"]
    assert table.time_s[0] == 1_719_828_000.0
    assert table.columns["satellites"][2] == 12.0
    assert math.isnan(table.columns["fix"][0])
    done = import_logs([path], proposal([path]), tmp_path / "session.mcap")
    assert (done.figures["fixes"], done.figures["fixed_pct"]) == (20, 90.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (HEAD + point(1) + point(2) + "<trkpt", "the rest cannot be read: unclosed token"),
        (HEAD + END, "has no track point; export a track"),
        (HEAD + '<trkpt lat="1" lon="2"/>' + END, "its 1 track points have no time"),
        ('<!DOCTYPE gpx [<!ENTITY a "aaaa">]>' + HEAD + END, "declares a document type"),
        ("<gpx>" + "<a>" * 100_000, "nested more than 64 deep"),
    ],
    ids=["cut", "empty", "timeless", "entities", "deep"],
)
def test_what_is_wrong_with_a_track_is_told(tmp_path, text, told):
    path = tmp_path / "track.gpx"
    path.write_text(text)
    try:
        (problem,) = open_log(path).read(["track"]).problems
    except LogError as error:
        problem = str(error)
    assert told in problem
