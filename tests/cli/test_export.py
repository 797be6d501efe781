"""``touchline export``: tables of topics, and a map of what was painted."""

import csv
import json
from pathlib import Path

import numpy as np
import pymap3d
import pytest
import shapely
from typer.testing import CliRunner

from tests.bridge.foreign import foreign
from tests.bridge.said import messages, record
from tests.command import app
from touchline.recordings.channels import is_drawn, topic_at
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorder import Recorder
from touchline.schemas.cdr import encode
from touchline.schemas.curves import Curve
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import PaintMarks, String, Trajectory
from touchline.schemas.messages.turf_tank import Path as DrivenPath
from touchline.schemas.messages.turf_tank import Segment
from touchline.schemas.scenario import Origin, Scenario
from touchline.schemas.setup import Setup

ORIGIN = Origin(latitude_deg=-33.5, longitude_deg=151.25, altitude_m=40.0)
SQUARE = [[0, 0], [0, 10], [10, 10], [10, 0]]  # clockwise, as nobody wants it on a map
HOLE = [[4, 4], [6, 4], [6, 6], [4, 6]]
TEMPLATE = {
    "name": "t",
    "segments": [{"id": "arc", "arc": {"start": [20, 0], "center": [20, 9.15], "sweep_angle": 3.0}}],
    "areas": [{"id": "solid", "outline": SQUARE, "holes": [HOLE]}],
    "obstacles": [{"id": "post", "corners": HOLE}],
}


def export(*arguments: str | Path) -> int:
    return CliRunner().invoke(app, ["export", *map(str, arguments)], catch_exceptions=False).exit_code


@pytest.fixture
def session(tmp_path: Path) -> Path:
    return record(tmp_path / "a.mcap", messages(200)).finish().path


@pytest.fixture
def painted(tmp_path: Path) -> Path:
    recorder = Recorder(tmp_path / "painted.mcap")
    setup = Setup(scenario=Scenario(origin=ORIGIN))
    segment = Segment(id="arc", curve=Curve.from_arc((20, 0), (20, 9.15), 3.0).to_message())
    recorder.write("setup", encode(String(data=setup.model_dump_json())), 0)
    recorder.write("template", encode(String(data=json.dumps(TEMPLATE))), 0)
    recorder.write("plan", encode(Trajectory(path=DrivenPath(segments=(segment,)))), 0)
    marks = PaintMarks(segment_id="arc", width_m=0.12, x_m=[20.0, 23.0], y_m=[0.0, -4.0])
    recorder.write("truth/paint", encode(marks), 0)
    return recorder.finish().path


def test_a_row_for_each_message_and_a_column_for_each_field_with_its_unit(session: Path, tmp_path: Path) -> None:
    table = tmp_path / "imu.csv"
    assert export(session, "--topic", "imu/data_raw", "--csv", table) == 0
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 200
    assert [float(row["angular_velocity.z [rad/s]"]) for row in rows[:3]] == [0.0, 0.5, 1.0]
    assert rows[7]["time [s]"] == "0.07" and rows[7]["topic"] == "/tt2/imu/data_raw"
    assert rows[0]["orientation_covariance[8]"] == "0.0"


def test_several_topics_have_each_their_columns_and_lists_are_json(session: Path, tmp_path: Path) -> None:
    table = tmp_path / "two.csv"
    assert export(session, "--topic", "truth/paint", "--topic", "/tt2/clock", "--csv", table) == 0
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    paint = [row for row in rows if row["topic"] == "/tt2/truth/paint"]
    assert json.loads(paint[1]["x_m [m]"]) == [0.0, 10.0] and paint[1]["clock.sec [s]"] == ""
    assert len(rows) == 40 and len(paint) == 20


def test_json_messages_have_columns_too(tmp_path: Path) -> None:
    said = [("/j", 5, b'{"a": 1, "b": {"c": "x"}}'), ("/j", 6, b'{"a": 2, "d": [1, 2]}'), ("/j", 7, b"{")]
    path = foreign(tmp_path / "a.mcap", said, encoding="json", schema_encoding="jsonschema", schema="{}")
    assert export(path, "--topic", "/j", "--csv", tmp_path / "j.csv") == 1  # one is no JSON
    with (tmp_path / "j.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["a"], row["b.c"], row["d"]) for row in rows] == [("1", "x", ""), ("2", "", "[1, 2]")]


def test_parquet_has_the_schemas_types_and_units(session: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = tmp_path / "a.parquet"
    assert export(session, "--topic", "truth/paint", "--topic", "imu/data_raw", "--parquet", table) == 0
    found = parquet.read_table(table)
    assert found.num_rows == 220
    kinds = {field.name: str(field.type) for field in found.schema}
    assert kinds["x_m [m]"] == "list<element: double>" and kinds["first_index"] == "uint32"
    assert kinds["segment_id"] == "string" and kinds["header.stamp.sec [s]"] == "int32"
    assert found.schema.field("angular_velocity.z [rad/s]").metadata == {b"unit": b"rad/s"}
    assert [each for each in found["x_m [m]"].to_pylist() if each is not None][1] == [0.0, 10.0]


def positions(geometry: dict) -> np.ndarray:
    parts = [geometry["coordinates"]] if geometry["type"] == "LineString" else geometry["coordinates"]
    return np.vstack([np.array(part) for part in parts])


def test_the_map_is_rfc_7946_and_where_the_field_is(painted: Path, tmp_path: Path) -> None:
    assert export(painted, "--geojson", tmp_path / "field.geojson") == 0
    found = json.loads((tmp_path / "field.geojson").read_text())
    assert found["type"] == "FeatureCollection"
    features = {(each["properties"]["is"], each["properties"]["id"]): each for each in found["features"]}
    assert set(features) == {
        ("template", "arc"),
        ("area", "solid"),
        ("obstacle", "post"),
        ("plan", "arc"),
        ("paint", "arc"),
    }
    for each in found["features"]:
        lon, lat = positions(each["geometry"]).T
        assert np.all(np.abs(lon - 151.25) < 0.001) and np.all(np.abs(lat + 33.5) < 0.001)
    solid = features["area", "solid"]["geometry"]
    outer, hole = (shapely.LinearRing(ring) for ring in solid["coordinates"])
    assert outer.is_ccw and not hole.is_ccw
    assert all(ring[0] == ring[-1] for ring in solid["coordinates"])
    paint = positions(features["paint", "arc"]["geometry"])
    east, north, _ = pymap3d.geodetic2enu(paint[:, 1], paint[:, 0], 40.0, -33.5, 151.25, 40.0)
    assert np.allclose(np.column_stack((east, north)), [[20.0, 0.0], [23.0, -4.0]], atol=2e-4)
    assert features["paint", "arc"]["properties"]["width_m"] == 0.12
    for kind in ("template", "plan"):
        place = positions(features[kind, "arc"]["geometry"])
        x, y, _ = pymap3d.geodetic2enu(place[:, 1], place[:, 0], 40.0, -33.5, 151.25, 40.0)
        middle = np.hypot((x[1:] + x[:-1]) / 2 - 20.0, (y[1:] + y[:-1]) / 2 - 9.15)
        assert np.all(np.abs(middle - 9.15) < 0.0012), "chords stay within a millimetre"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "give --csv, --parquet"),
        (["--csv", "a.csv"], "name a topic"),
        (["--topic", "clock"], "give --csv or --parquet"),
        (["--topic", "nope", "--csv", "a.csv"], "has no topic nope"),
        (["--geojson", "a.geojson"], "setup"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], said: str
) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    recorder.write("template", encode(String(data=json.dumps(TEMPLATE))), 0)
    path = recorder.finish().path
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TouchlineError, match=said):
        export(path, *arguments)
    assert not (tmp_path / "a.csv").exists()


def test_a_copy_for_viewers_has_all_of_the_recording_and_what_the_recorder_would_have_drawn(tmp_path, capsys):
    square = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "square.mcap"
    first, again = tmp_path / "first.mcap", tmp_path / "again.mcap"
    assert export(square, "--viewer", first) == 0
    recorder = Recorder(tmp_path / "recorded.mcap")
    before = list(RecordingReader(square).messages())
    for each in before:
        topic = topic_at(each.topic)
        recorder.write(topic.name, each.payload, each.sequence)
    recorder.finish()
    copied, recorded = (
        [each for each in RecordingReader(path).messages() if is_drawn(each.topic, ["tt2"])]
        for path in (first, tmp_path / "recorded.mcap")
    )
    assert len(copied) > 400
    assert [each[:5] for each in copied] == [each[:5] for each in recorded]
    kept = [each for each in RecordingReader(first).messages() if not is_drawn(each.topic, ["tt2"])]
    assert kept == before
    assert export(first, "--viewer", again) == 0  # what it has for viewers is drawn anew, not twice
    assert list(RecordingReader(again).messages()) == list(RecordingReader(first).messages())
    with pytest.raises(TouchlineError, match="is there already"):
        export(square, "--viewer", first)
