"""Viewers' topics, read by others with nothing but the schemas in the recording: equal values in every message.

rosbags and mcap-ros2-support here; @mcap/core with @foxglove/rosmsg2-serialization, with which Foxglove and Lichtblick
decode, where `make node-readers` has installed them.
"""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from touchline.recordings.recorder import Recorder
from touchline.recordings.viewing.viewing import WORK
from touchline.recordings.viewing_copy import copy_with_viewing
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Header, PaintMarks, Time
from touchline.schemas.topics import OBSTACLE_MARKERS, PAINT, VIEWING, WORK_MARKERS

ROOT = Path(__file__).resolve().parents[2]
SQUARE = ROOT / "examples" / "sessions" / "square.mcap"
NODE = ROOT / "build" / "node-readers"
TYPES = sorted({topic.type.ros_type for topic in VIEWING})


@pytest.fixture(scope="module", params=["square", "strokes"])
def recording(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of a shipped session, and one of so many strokes that there are older ones."""
    path = tmp_path_factory.mktemp("readers") / f"{request.param}.mcap"
    if request.param == "square":
        copy_with_viewing(SQUARE, path)
        return path
    recorder = Recorder(path)
    for number in range(100):
        header = Header(frame_id="map", stamp=Time(sec=2 * number, nanosec=number))
        points = {"x_m": np.array([0.1, 1 / 3, 2.0]), "y_m": np.array([0.0, number / 7, -number])}
        marks = PaintMarks(header=header, segment_id="s", first_index=4 * number, width_m=0.1, **points)
        recorder.write(PAINT.name, encode(marks), number)
    recorder.finish()
    return path


def plain(value: Any) -> Any:
    """A message of rosbags or mcap-ros2-support as JSON has it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, str | int | float | bool):
        return value
    if isinstance(value, bytes):
        return list(value)
    names = getattr(value, "__slots__", None) or value.__dataclass_fields__
    fields = [name for name in names if not name.startswith("__") and not name.isupper()]  # no constants
    return {name.lstrip("_"): plain(getattr(value, name)) for name in fields}


@pytest.fixture(scope="module")
def by_rosbags(recording: Path) -> list[Any]:
    found, stores = [], {}
    with recording.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if schema is not None and schema.name in TYPES:
                if schema.name not in stores:
                    stores[schema.name] = get_typestore(Stores.EMPTY)
                    stores[schema.name].register(get_types_from_msg(schema.data.decode(), schema.name))
                values = plain(stores[schema.name].deserialize_cdr(message.data, schema.name))
                found.append([channel.topic, str(message.log_time), str(message.publish_time), values])
    return found


def differing(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Places where values differ; a field of the schema that a reader leaves out counts as well."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in one.keys() | other.keys():
            yield from differing(one.get(name), other.get(name), f"{place}.{name}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other, strict=True)):
            yield from differing(*pair, f"{place}[{number}]")
    elif one != other:
        yield f"{place}: {one!r}, {other!r}"


def test_every_topic_is_there(by_rosbags: list[Any], recording: Path) -> None:
    found = {topic.removeprefix("/tt2/") for topic, *_ in by_rosbags}
    work = {topic.name for topic in WORK}
    drawn = {topic.name for topic in VIEWING} - {WORK_MARKERS.name, OBSTACLE_MARKERS.name}
    assert found == (work if recording.stem == "strokes" else drawn)


def test_mcap_ros2_support_reads_the_same(by_rosbags: list[Any], recording: Path) -> None:
    with recording.open("rb") as stream:
        decoded = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(
            topics=sorted({topic for topic, *_ in by_rosbags})
        )
        theirs = [
            [channel.topic, str(message.log_time), str(message.publish_time), plain(values)]
            for _, channel, message, values in decoded
        ]
    assert not list(differing(by_rosbags, theirs))


@pytest.mark.skipif(not (NODE / "node_modules").is_dir(), reason="`make node-readers` installs its packages")
def test_foxgloves_own_libraries_read_the_same(by_rosbags: list[Any], recording: Path) -> None:
    script = ROOT / "tests" / "foreign_readers" / "read.mjs"
    done = subprocess.run(
        ["node", str(script), str(NODE), str(recording), *TYPES],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    theirs = [json.loads(line) for line in done.stdout.splitlines()]
    assert not list(differing(by_rosbags, theirs))
