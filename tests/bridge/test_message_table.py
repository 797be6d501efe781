"""Messages as tables are the messages, also of files that are damaged, broken off, or in parts."""

from pathlib import Path

import pytest

from touchline.recordings.reader import RecordingReader

SESSION = Path(__file__).resolve().parents[2] / "examples" / "sessions" / "square.mcap"


def cut(data):
    del data[len(data) * 3 // 5 :]


def flipped(data):
    for place in (2, 3, 5):
        data[len(data) * place // 7] ^= 0xFF


def in_order(tables):
    placed = [pair for each in tables for pair in zip(each.place.tolist(), each.messages(), strict=True)]
    return [message for _, message in sorted(placed, key=lambda pair: pair[0])]


@pytest.mark.parametrize(
    ("harm", "parts"),
    [(lambda data: None, 1), (cut, 2), (flipped, 2)],
    ids=["whole", "broken off, in parts", "damaged, in parts"],
)
def test_tables_hold_what_there_is(tmp_path, harm, parts):
    data = bytearray(SESSION.read_bytes())
    harm(data)
    path = tmp_path / "session.mcap"
    path.write_bytes(data)
    if parts == 2:
        (tmp_path / "session.part2.mcap").write_bytes(SESSION.read_bytes())
    one, other, some = (RecordingReader(path) for _ in range(3))
    messages = [message._replace(sequence=0) for message in one.messages()]
    assert len(messages) > 3000
    tables = other.tables(lambda topic: True)
    assert in_order(tables) == messages
    assert other.summary == one.summary
    wanted = [message for message in messages if message.topic.endswith("/imu/data_raw")]
    (imu,) = some.tables(lambda topic: topic.endswith("/imu/data_raw"))
    assert list(imu.messages()) == wanted
    begin, end = 100, 900
    assert list(imu.rows(begin, end).messages()) == wanted[begin:end]
    assert some.summary == one.summary
