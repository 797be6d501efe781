"""The files of a recording that went on in next parts are one session."""

import shutil
from itertools import islice
from pathlib import Path

import pytest

from tests.bridge.said import messages, sent
from touchline.recordings.compare import compare
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recorder import Existing, Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replayer import Timeline
from touchline.schemas import topics
from touchline.schemas.cdr import encode

SAID = list(enumerate(messages(100)))


def part(path: Path, said: list, before: tuple[Path, ...] = ()) -> Path:
    recorder = Recorder(path, continues=before)
    for number, (topic, message) in said:
        recorder.write(topic.name, encode(message), number)
    return recorder.finish().path


def in_parts(folder: Path) -> Path:
    """A session whose second part begins with the template, which the bridge hears again."""
    first = part(folder / "session.mcap", SAID[:120])
    part(folder / "session.part2.mcap", [SAID[0], *SAID[120:]], (first,))
    return first


def test_parts_are_the_same_session_as_one_file(tmp_path: Path) -> None:
    first, whole = in_parts(tmp_path), part(tmp_path / "whole.mcap", SAID)
    result = compare(first, whole)
    assert result.identical, list(result.lines())
    assert len(list(Timeline(first).cues())) == len(SAID)
    held = read_summary(first)
    assert [file.path.name for file in held.files] == ["session.mcap", "session.part2.mcap"]
    assert sent(held) == len(SAID) + 1 and held.complete


def test_a_folder_of_the_parts_is_the_session_too(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    first = in_parts(tmp_path / "folder")
    assert compare(first, tmp_path / "folder").identical


def test_a_part_that_is_broken_off_is_named(tmp_path: Path) -> None:
    first = in_parts(tmp_path)
    first.write_bytes(first.read_bytes()[:-100])
    held = read_summary(first)
    assert not held.complete and held.problem == "session.mcap is broken off, or still being written"
    assert [file.complete for file in held.files] == [False, True]


@pytest.mark.parametrize("size_bytes", [0, 3])
def test_a_next_part_that_has_just_been_created_has_nothing_yet(size_bytes: int, tmp_path: Path) -> None:
    first = in_parts(tmp_path)
    second = tmp_path / "session.part2.mcap"
    second.write_bytes(second.read_bytes()[:size_bytes])
    held = read_summary(first)
    assert sent(held) == 120 and not held.complete
    assert held.problem == "session.part2.mcap is broken off, or still being written"
    second.write_bytes(b"other" * 3)
    with pytest.raises(RecordingError, match=r"part2\.mcap: is not an MCAP recording"):
        read_summary(first)


def test_a_part_alone_is_itself_and_a_gap_ends_the_session(tmp_path: Path) -> None:
    first = in_parts(tmp_path)
    second = tmp_path / "session.part2.mcap"
    assert [message.topic for message in islice(RecordingReader(second).messages(), 1)] == ["/tt2/template"]
    second.rename(tmp_path / "session.part3.mcap")
    assert sent(read_summary(first)) == 120


def test_an_older_recordings_parts_are_moved_with_it_and_never_mixed_with_the_new_one(tmp_path: Path) -> None:
    first = in_parts(tmp_path)
    shutil.copytree(tmp_path, before := tmp_path / "before")
    fresh = part(first, SAID[:5])
    assert sent(read_summary(fresh)) == 5
    assert compare(before / "session.mcap", tmp_path / "session.1.mcap").identical
    recorder = Recorder(tmp_path / "session.1.mcap", existing=Existing.REPLACE)
    recorder.write(topics.TEMPLATE.name, encode(SAID[0][1][1]), 0)
    assert sent(read_summary(recorder.finish().path)) == 1
