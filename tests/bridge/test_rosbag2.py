"""Folders and databases that ROS 2's recorder writes are read, or refused in one line."""

import re
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from tests.bridge.foreign import foreign
from tests.bridge.said import messages
from touchline.recordings.compare import compare
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replayer import Timeline
from touchline.schemas.cdr import encode, typestore
from touchline.schemas.messages import String


def bag(path: Path, plugin: StoragePlugin, mode: CompressionMode = CompressionMode.NONE, version: int = 9) -> Path:
    """The usual messages as rosbags writes them for ROS 2."""
    writer = Writer(path, version=version, storage_plugin=plugin)  # type: ignore[arg-type]
    if mode is not CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for number, (topic, message) in enumerate(messages(60)):
            if topic.name not in connections:
                name, kind = f"/tt2/{topic.name}", topic.type.ros_type
                connections[topic.name] = writer.add_connection(name, kind, typestore=typestore())
            writer.write(connections[topic.name], 10**18 + number, encode(message))
    return path


SAID = [(f"/tt2/{topic.name}", encode(message)) for topic, message in messages(60)]


@pytest.mark.parametrize("plugin", StoragePlugin)
@pytest.mark.parametrize("version", [8, 9])
def test_a_folder_gives_what_was_recorded(tmp_path: Path, plugin: StoragePlugin, version: int) -> None:
    folder = bag(tmp_path / "bag", plugin, version=version)
    reader = RecordingReader(folder)
    assert [(message.topic, message.payload) for message in reader.messages()] == SAID
    assert reader.summary.problem == "" and reader.summary.complete and reader.fraction == 1.0
    assert len(list(Timeline(folder).cues())) == len(SAID)


def test_a_database_alone_is_the_same_as_its_folder_and_as_mcap(tmp_path: Path) -> None:
    folder, other = bag(tmp_path / "a", StoragePlugin.SQLITE3), bag(tmp_path / "b", StoragePlugin.MCAP)
    assert compare(folder, next(folder.glob("*.db3"))).identical
    result = compare(folder, other)
    assert result.identical, list(result.lines())


def test_a_folder_without_metadata_is_read_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    for number in (0, 2, 10):
        said = [("/a", 10**9 * number + n, encode(String(data=f"{number}.{n}"))) for n in range(3)]
        foreign(tmp_path / f"run_{number}.mcap", said)
    found = [message.log_time_ns for message in RecordingReader(tmp_path).messages()]
    assert found == sorted(found) and len(found) == 9


def test_a_file_that_the_metadata_name_and_that_is_gone_is_told(tmp_path: Path) -> None:
    folder = bag(tmp_path / "bag", StoragePlugin.MCAP)
    metadata = folder / "metadata.yaml"
    name = next(folder.glob("*.mcap")).name
    metadata.write_text(re.sub(rf"( *- ){re.escape(name)}\n", r"\g<0>\1bag_1.mcap\n", metadata.read_text()))
    held = read_summary(folder)
    assert held.messages == len(SAID)
    assert held.problem == "an unknown number of messages is lost (bag_1.mcap is not there)"


def emptied(folder: Path) -> None:
    for file in folder.iterdir():
        file.unlink()


def without_files(folder: Path) -> None:
    next(folder.glob("*.mcap")).unlink()


def no_yaml(folder: Path) -> None:
    (folder / "metadata.yaml").write_text("{]")


@pytest.mark.parametrize(
    ("change", "said"), [(emptied, "without a recording"), (without_files, "none is there"), (no_yaml, "metadata.yaml")]
)
def test_a_folder_that_is_no_recording_is_refused_in_a_line(
    tmp_path: Path, change: Callable[[Path], None], said: str
) -> None:
    folder = bag(tmp_path / "bag", StoragePlugin.MCAP)
    change(folder)
    with pytest.raises(RecordingError, match=said) as refusal:
        RecordingReader(folder)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_what_rosbag2_has_compressed_is_refused_with_the_remedy(tmp_path: Path, mode: CompressionMode) -> None:
    for plugin in StoragePlugin:
        folder = bag(tmp_path / plugin.name, plugin, mode)
        with pytest.raises(RecordingError, match="ros2 bag convert"):
            RecordingReader(folder)


def test_a_damaged_database_gives_what_is_left_or_a_line(tmp_path: Path) -> None:
    original = next(bag(tmp_path / "bag", StoragePlugin.SQLITE3).glob("*.db3"))
    data = original.read_bytes()
    outcomes = set()
    for at in range(0, len(data), len(data) // 40):
        path = tmp_path / "damaged.db3"
        path.write_bytes(data[:at] + b"\xff" * min(3000, len(data) - at) + data[at + 3000 :])
        try:
            held = read_summary(path)
        except RecordingError as error:
            assert "\n" not in str(error)
            outcomes.add("refused")
        else:
            outcomes.add("told" if held.problem else "read")
            assert held.problem or held.messages == len(SAID)
    assert "told" in outcomes and "refused" in outcomes


def test_a_database_that_is_none_of_rosbag2s_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE cats (name TEXT)")
    with pytest.raises(RecordingError, match="rosbag2 database"):
        RecordingReader(path)
